"""Clusters that are worked on together, as many as there is room for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol, TypeVar


class Sized(Protocol):
    """A cluster that knows what it takes."""

    @property
    def held(self) -> int:
        """Bytes that it takes as long as its group is worked on."""

    @property
    def work(self) -> int:
        """Bytes that it takes beside them while it is at work itself."""


_One = TypeVar("_One", bound=Sized)


def groups_within(clusters: Iterable[_One], room: int) -> Iterator[list[_One]]:
    """Divide clusters into groups, each within the room or of one cluster; one of a group works at a time."""
    group: list[_One] = []
    held = work = 0
    for one in clusters:
        held, work = held + one.held, max(work, one.work)
        if group and held + work > room:
            yield group
            group, held, work = [], one.held, one.work
        group.append(one)
    if group:
        yield group
