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


def size_text(size: float, up: bool = False) -> str:
    """Write a size with two digits or more: 2.1 GB; rounded up where that much is needed."""
    for unit, bytes_ in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= bytes_:
            digits = 1 if size < 10 * bytes_ else 0
            shown = size / bytes_
            shown = math.ceil(shown * 10**digits) / 10**digits if up else shown
            return f"{shown:.{digits}f} {unit}"
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
    return f"about {size_text(needed, up=True)}{of_allowed}"
