"""What a catalog cannot do for the person who asks."""

from collections.abc import Sequence


class CatalogError(Exception):
    """A catalog cannot answer; the message says why and what to do."""


class UnknownClip(CatalogError):
    """It has no clip of that name."""


class NoClips(CatalogError):
    """It has no clips at all, and so nothing to compare with."""


def nearest(name: str, known: Sequence[str]) -> str:
    """Ask whether one of the names most like an unknown one was meant; empty where none is like it."""
    from difflib import get_close_matches

    close = get_close_matches(name, known, n=3, cutoff=0.5)
    return f"; did you mean {', '.join(close)}?" if close else ""
