"""Files that appear under their names whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a place to write a file to, and put it under its own name when all went well.

    Parameters
    ----------
    path : path
        Replaced in one step at the end of the block; left as it was where the block fails.

    Yields
    ------
    Path
        In the same folder, for one writer.
    """
    final = Path(path)
    # os.replace is atomic only within a file system; the name stays short, whatever the file's own is.
    temporary = final.with_name(f".{uuid4().hex}.part")
    try:
        yield temporary
        temporary.replace(final)
    finally:
        temporary.unlink(missing_ok=True)
