"""The one error every reader raises for a file it cannot read."""

from __future__ import annotations

import os


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
