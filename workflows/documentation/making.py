"""What a page may ask to be made: a line `<!-- make: WHAT ARGUMENTS -->` becomes what the code says.

So that no page copies what stands in the code: the tables, the commands, the docstrings, the pictures.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from motionary.catalog import Catalog
from motionary.workflows.documentation.command_text import commands_text
from motionary.workflows.documentation.pictures import picture_text
from motionary.workflows.documentation.python_text import python_text
from motionary.workflows.documentation.table_text import tables_text

_ASKED = re.compile(r"^<!-- make: (\w+)((?: \S+)*) -->$", re.MULTILINE)

Maker = Callable[..., str]


def makers(repository: Path, catalog: Catalog) -> dict[str, Maker]:
    """Return what can be made, by name."""
    return {
        "tables": tables_text,
        "commands": commands_text,
        "python": python_text,
        "picture": lambda name: picture_text(catalog, name),
        "file": lambda path: _file_text(repository / path),
    }


def made(text: str, known: dict[str, Maker]) -> str:
    """Put what a page asks for in its place.

    Raises
    ------
    KeyError
        The page asks for something that nothing makes.
    """
    return _ASKED.sub(lambda found: known[found[1]](*found[2].split()), text)


def asked(text: str) -> list[tuple[str, ...]]:
    """List what a page asks for: what, and its arguments."""
    return [(what, *arguments.split()) for what, arguments in _ASKED.findall(text)]


def _file_text(path: Path) -> str:
    language = path.suffix.removeprefix(".")
    return f"``````{{code-block}} {language}\n{path.read_text(encoding='utf-8').rstrip()}\n``````"
