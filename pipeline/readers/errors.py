"""The one error every reader raises for a file it cannot read."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class ReadError(Exception):
    """A motion file that cannot be read: where, what is wrong, and how to mend it.

    Parameters
    ----------
    path : path
        The file at fault, which for an AMC may be its ASF.
    line : int or None
        Line number from 1; None where the fault has no line.
    what : str
        What is wrong.
    mend : str
        What to do about it.

    Notes
    -----
    The four arguments are the exception's own, so it survives pickling between processes.
    """

    def __init__(self, path: str | os.PathLike[str], line: int | None, what: str, mend: str) -> None:
        super().__init__(os.fspath(path), line, what, mend)
        self.path = os.fspath(path)
        self.line = line
        self.what = what
        self.mend = mend

    def __str__(self) -> str:
        place = self.path if self.line is None else f"{self.path}:{self.line}"
        return f"{place}: {self.what}; {self.mend}"


@contextmanager
def opening(path: Path) -> Iterator[None]:
    """Turn what the system says of a file that cannot be opened or read into one error.

    Raises
    ------
    ReadError
        There is no such file, it is no file but a pipe, a socket or a device, or it cannot be read.
    """
    try:
        if is_special(path):
            raise ReadError(path, None, "this is a pipe, a socket or a device", "put a file in its place")
        yield
    except FileNotFoundError as error:
        raise ReadError(path, None, "there is no such file", "check the path") from error
    except OSError as error:
        reason = error.strerror or str(error)
        raise ReadError(
            path, None, f"the file cannot be opened ({reason})", "check its permissions"
        ) from error


def is_special(path: Path) -> bool:
    """Say whether a path leads to what is neither file nor folder; opening such a thing may wait for ever."""
    mode = path.stat().st_mode
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))
