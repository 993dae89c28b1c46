"""The sources that Sphinx gets: a tree like the repository's, so that the READMEs' links hold on the site.

`pages/` lies at the root of it, READMEs and their pictures lie where they lie in the repository, and what
else these link to gets pages.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from plotly.offline import get_plotlyjs

from motionary.catalog import Catalog
from motionary.workflows.documentation import links
from motionary.workflows.documentation.making import made, makers

HERE = "workflows/documentation"
README_FOLDERS = ("pipeline", "catalog", "workflows", "tests")


def stage(repository: Path, sources: Path, catalog: Catalog) -> None:
    """Write the sources of the site, all but the notebooks.

    Parameters
    ----------
    repository : Path
        The root of a clone.
    sources : Path
        A folder that is made.
    catalog : Catalog
        Of the embedded library, for the pictures.
    """
    known = makers(repository, catalog)
    for page, text in pages(repository):
        _write(sources / page, made(text, known))
    shown: set[str] = set()
    for readme in readmes(repository):
        text = (repository / readme).read_text(encoding="utf-8")
        _write(sources / readme, links.rewritten(text, readme, repository))
        shown |= set(links.linked_sources(text, readme, repository))
    for source in sorted(shown):
        if source.endswith(links.PICTURE):
            _copy(repository / source, sources / source)
        else:
            _write(sources / links.page_of(source), links.source_page(source, repository))
    shutil.copy(repository / HERE / "conf.py", sources)
    shutil.copytree(repository / HERE / "static", sources / "static")
    shutil.copy(repository / "catalog" / "web" / "static" / "icon.svg", sources / "static")
    _write(sources / "static" / "plotly.js", get_plotlyjs())


def pages(repository: Path) -> Iterator[tuple[str, str]]:
    """List the pages, by their paths on the site, with their texts."""
    folder = repository / HERE / "pages"
    for file in sorted(folder.rglob("*.md")):
        yield file.relative_to(folder).as_posix(), file.read_text(encoding="utf-8")


def readmes(repository: Path) -> list[str]:
    """List the READMEs of the repository, by their paths in it."""
    found = [file for top in README_FOLDERS for file in (repository / top).rglob("README.md")]
    return ["README.md", *sorted(file.relative_to(repository).as_posix() for file in found)]


def _copy(file: Path, to: Path) -> None:
    to.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(file, to)


def _write(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
