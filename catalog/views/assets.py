"""Styles and scripts of the pages, as files beside this one; no page fetches anything from elsewhere."""

from __future__ import annotations

from functools import cache
from importlib.resources import files


@cache
def asset(name: str) -> str:
    """Return the text of a file of this package, such as `style.css` or `report/report.js`."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
