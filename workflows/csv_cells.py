"""Text in a CSV that a spreadsheet shows and does not run.

A spreadsheet takes a cell that begins with = + - or @ for a formula, also in the full width of East Asian
scripts, and also after a tab or the end of a line. Such text gets an apostrophe in front, which spreadsheets
take for "this is text". Text that has the apostrophe already gets one more, so that taking one away always
gives back what was there.
"""

from __future__ import annotations

import re

UNSAFE = "^('*[=+\\-@＝＋－＠\t\r\n])"
"""Text that begins like a formula, behind any number of apostrophes; for `re` and for Arrow alike."""

_UNSAFE = re.compile(UNSAFE)


def csv_safe(text: str) -> str:
    """Return text such that no spreadsheet takes it for a formula; `csv_plain` undoes it."""
    return f"'{text}" if _UNSAFE.match(text) else text


def csv_plain(text: str) -> str:
    """Return the text that `csv_safe` was given."""
    return text[1:] if text.startswith("'") and _UNSAFE.match(text) else text
