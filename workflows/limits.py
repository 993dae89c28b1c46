"""What a nightly run may change at most; past it, the run is published nowhere.

A share on the network that is half mounted looks like a library that lost half its clips, a new capture rig
like a wave of unreadable files, and a setting changed by mistake like clusters thrown into disorder. Nobody
watches at night, so the old snapshot stays until somebody has looked.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from motionary.catalog import Catalog
from motionary.workflows.errors import UserError
from motionary.workflows.nightly_settings import Limits

if TYPE_CHECKING:
    from motionary.catalog.history import Difference


class LimitExceeded(UserError):
    """A run changes more than it may; the message names each limit with both numbers."""


@dataclass(frozen=True)
class Measured:
    """A limit beside what was found.

    Parameters
    ----------
    name : str
        As in the configuration.
    found, of : int
        Clips that count, and clips in all.
    limit : int or float or None
        A count, or a share of `of`; None is no limit.
    exceeded : bool
        More was found than the limit allows.
    """

    name: str
    found: int
    of: int
    limit: int | float | None
    exceeded: bool

    def __str__(self) -> str:
        return f"{self.name} is {self.limit}, and {self.found} of {self.of} clips are"


def measure(
    limits: Limits, before: Catalog | None, after: Catalog, changes: Difference | None
) -> list[Measured]:
    """Compare what a run changes with its limits.

    Parameters
    ----------
    limits : Limits
        Those of the configuration.
    before, after : Catalog
        What is published, None where nothing is; and what would be.
    changes : Difference, optional
        The difference of the two; None where there is nothing before.
    """
    quarantined, clips = len(after.quarantine), len(after.clips)
    measured = [_measured("max_quarantined", quarantined, quarantined + clips, limits.max_quarantined)]
    if before is not None and changes is not None:
        earlier, removed = len(before.clips), len(changes.removed)
        measured += [
            _measured("max_moved", len(changes.moved), earlier - removed, limits.max_moved),
            _measured("max_removed", removed, earlier, limits.max_removed),
            _measured("max_relabelled", len(changes.relabelled), earlier - removed, limits.max_relabelled),
        ]
    return measured


def refuse_if_exceeded(measured: list[Measured], clips: int) -> None:
    """Refuse to publish.

    Raises
    ------
    LimitExceeded
        A limit is exceeded, or no clip at all could be read.
    """
    if exceeded := [one for one in measured if one.exceeded]:
        raise LimitExceeded(
            "; ".join(map(str, exceeded))
            + "; nothing is published: look at the report, then mend the library or raise the limit"
        )
    if not clips:
        raise LimitExceeded("no clip of the library can be read; nothing is published: look at the report")


def _measured(name: str, found: int, of: int, limit: int | float | None) -> Measured:
    if limit is None:
        return Measured(name, found, of, None, False)
    # The share as it is written: 0.29 of 100 is 29, which floating point has a little less.
    most = Fraction(str(limit)) * of if isinstance(limit, float) else limit
    return Measured(name, found, of, limit, found > most)
