"""Text files as people have them, read into lines, and lines into numbers.

UTF-8 with or without its byte-order mark, else Latin-1; CR, LF and CRLF, mixed; `#` and `//` comments.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from motionary.pipeline.motion import FloatArray
from motionary.pipeline.readers.errors import ReadError, opening

LARGEST = 1e12  # beyond any unit, any angle: such a value is damage, and squares of it still are finite

_COMMENT = re.compile(r"(?:^|\s)(?:#|//).*")


def read_lines(path: Path) -> list[str]:
    """Read a text file into its lines, without their ends.

    Raises
    ------
    ReadError
        The file is missing, may not be read, is empty, or is not text.
    """
    with opening(path):
        data = path.read_bytes()
    if b"\0" in data:
        line = 1 + len(re.findall(rb"\r\n?|\n", data[: data.index(b"\0")]))
        raise ReadError(
            path, line, "this is a binary or UTF-16 file, not text", "export it again as plain text"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if not text.strip():
        raise ReadError(path, 1, "the file is empty", "copy or export it again")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def without_comment(line: str) -> str:
    """Cut a line at a word that begins with `#` or `//`."""
    if "#" in line or "//" in line:
        return _COMMENT.sub("", line)
    return line


def shown(text: str, width: int = 40) -> str:
    """Quote a piece of a file for a message: printable, on one line, shortened."""
    quoted = ascii(text.strip())
    return quoted if len(quoted) <= width else quoted[:width] + "..."


def to_numbers(path: Path, rows: Sequence[tuple[int, Sequence[str]]]) -> FloatArray:
    """Convert words to finite numbers.

    Parameters
    ----------
    path : Path
        For the error.
    rows : sequence of (line, words)
        Line number from 1 and the words found there.

    Returns
    -------
    array (number of words,)
        The values in reading order.

    Raises
    ------
    ReadError
        A word is no number, not finite, or larger than 1e12; it names the first such word's line.
    """
    words = [word for _, row in rows for word in row]
    letters = "".join(words)
    if letters.isascii() and "_" not in letters:  # float() would take 1_000 and other scripts' digits
        try:
            values = np.array(list(map(float, words)), dtype=np.float64)
        except ValueError:
            pass
        else:
            if (np.abs(values) <= LARGEST).all():  # false for NaN too
                return values
    line, word, what = next(
        (line, word, what) for line, row in rows for word in row if (what := _fault(word)) is not None
    )
    mend = "write numbers with a decimal point; cut or mend the damaged frames, or export the file again"
    raise ReadError(path, line, f"{shown(word)} is {what}", mend)


def to_count(word: str) -> int | None:
    """Convert a word of decimal digits to an integer; None where it is none."""
    return int(word) if word.isascii() and word.isdigit() and len(word) <= 12 else None


def _fault(word: str) -> str | None:
    if not word.isascii() or "_" in word:
        return "not a number"
    try:
        value = float(word)
    except ValueError:
        return "not a number"
    if not np.isfinite(value):
        return "not finite"
    return None if abs(value) <= LARGEST else "too large for a length or an angle"
