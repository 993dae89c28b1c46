"""Sizes of memory and disk as people write them, and what this machine has."""

from __future__ import annotations

import math
import re

_SIZE = re.compile(r"\d+(\.\d*)?\s*([kmgt]i?)?b?", re.IGNORECASE)

_LONGEST = 30  # characters; of a hundred digits nothing can be made


def parse_size(text: str) -> int:
    """Read a size: 4GB is 4e9 bytes, 4GiB 2^32.

    Raises
    ------
    ValueError
        It is no size, or not above 0.
    """
    from dask.utils import parse_bytes

    size = parse_bytes(text) if _SIZE.fullmatch(text.strip()) and len(text) < _LONGEST else 0
    if size <= 0:
        raise ValueError(f"{text!r} is no size; write it as 4GB or 512MiB")
    return size


def size_text(size: float) -> str:
    """Write a size with two digits or more: 2.1 GB."""
    for unit, bytes_ in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= bytes_:
            return f"{size / bytes_:.1f} {unit}" if size < 10 * bytes_ else f"{size / bytes_:.0f} {unit}"
    return f"{math.ceil(size / 1e3)} kB"


def time_text(seconds: float) -> str:
    """Write a span of time in the unit that suits it: 50 s, 12 min, 3.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    if seconds < 100 * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 48 * 3600 else f"{seconds / 86400:.1f} days"


def needed_text(needed: int, allowed: int | None) -> str:
    """Write what is needed of what may be used."""
    of_allowed = f" of {size_text(allowed)} allowed" if allowed is not None else ""
    return f"about {size_text(needed)}{of_allowed}"
