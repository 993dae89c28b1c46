"""Links of a README lead to files of the repository; on the site each of them is a page.

A README, a notebook and a page are pages already, and a picture stays one. Another file that is linked to
gets a page of its own that shows its text, and a folder means its README, or else what its package says of
itself.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path

_LINK = re.compile(r"(?<=\]\()(?!\w+:|#)([^)#\s]+)")
_PAGES = (".md", ".ipynb")
PICTURE = ".svg"
_LANGUAGES = {".py": "python", ".toml": "toml", ".yaml": "yaml", ".yml": "yaml"}


def rewritten(text: str, at: str, repository: Path) -> str:
    """Let the links of a README lead to pages of the site.

    Parameters
    ----------
    text : str
        Markdown.
    at : str
        The README's path in the repository, with `/`.
    repository : Path

    Raises
    ------
    FileNotFoundError
        A link leads to nothing.
    """

    def page(found: re.Match[str]) -> str:
        source = _linked(found[1], at, repository)
        return posixpath.relpath(page_of(source), posixpath.dirname(at) or ".")

    return _LINK.sub(page, text)


def linked_sources(text: str, at: str, repository: Path) -> Iterator[str]:
    """List the files that a README links to, or shows, and that are no pages, by their paths."""
    for link in _LINK.findall(text):
        source = _linked(link, at, repository)
        if not source.endswith(_PAGES):
            yield source


def page_of(source: str) -> str:
    """Return the path of the page that shows a file, which may be its own."""
    return source if source.endswith((*_PAGES, PICTURE)) else f"{source}.md"


def source_page(source: str, repository: Path) -> str:
    """Write the page that shows a file."""
    text = (repository / source).read_text(encoding="utf-8")
    language = _LANGUAGES.get(Path(source).suffix, "text")
    return (
        f"---\norphan: true\n---\n\n# {source}\n\n``````{{code-block}} {language}\n{text.rstrip()}\n``````\n"
    )


def _linked(link: str, at: str, repository: Path) -> str:
    path = posixpath.normpath(posixpath.join(posixpath.dirname(at), link))
    if (repository / path).is_dir():
        readme = f"{path}/README.md"
        path = readme if (repository / readme).is_file() else f"{path}/__init__.py"
    if not (repository / path).is_file():
        raise FileNotFoundError(f"{at} links to {link}, and there is no {path}; mend the link")
    return path
