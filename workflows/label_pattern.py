"""Labels read from the names of clips: a regular expression whose named groups are label columns.

A pattern can be written such that a search takes longer than anyone waits (`(a+)+$`: each further letter
doubles it), on names as short as names are. What a pattern may take is therefore limited, in processor time,
so that a busy machine refuses nothing: a sound one takes microseconds a clip. The limit needs a POSIX system
and the main thread; elsewhere a search is waited for.
"""

from __future__ import annotations

import re
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import NoReturn

from motionary.pipeline.tables import TABLES
from motionary.workflows.errors import UserError

LIMIT = 5.0
"""Seconds of processor time for the names of a whole library."""


class PatternError(UserError):
    """A pattern cannot be used; the message says why, with the place and the mend."""


def labels_by_pattern(
    pattern: str, clip_ids: Sequence[str]
) -> tuple[tuple[str, ...], Mapping[str, Mapping[str, str | None]]]:
    """Search a pattern in the names of clips.

    Parameters
    ----------
    pattern : str
        Regular expression with named groups, as Python's `re` has them; anchor it with ^ or $ where it is to
        match more than a part.
    clip_ids : sequence of str
        The names.

    Returns
    -------
    groups : tuple of str
        In the order of the pattern.
    labels : mapping of clip_id to mapping of group to str or None
        For every clip that the pattern is found in.

    Raises
    ------
    PatternError
        It is not a regular expression, has no named groups or one called like a column that clips have
        anyway, is found in no clip, or takes longer than `LIMIT`.
    """
    try:
        compiled = re.compile(pattern)
    except (re.error, RecursionError, OverflowError) as error:
        raise PatternError(f"the label pattern {pattern!r} is not a regular expression: {error}") from None
    groups = tuple(compiled.groupindex)
    if not groups:
        raise PatternError(
            f"the label pattern {pattern!r} has no named groups, and these are the labels; "
            "write (?P<action>...) around what is the action"
        )
    taken = [name for name in groups if name in TABLES["ingested"].names]
    if taken:
        raise PatternError(
            f"the label pattern {pattern!r} calls a group {taken[0]!r}, which every clip has anyway; "
            "give it another name"
        )
    labels = {}
    with _limited(pattern):
        for clip_id in clip_ids:
            if match := compiled.search(clip_id):
                labels[clip_id] = {name: value or None for name, value in match.groupdict().items()}
    if not labels:
        raise PatternError(
            f"the label pattern {pattern!r} is found in none of {len(clip_ids)} clips; "
            f"it is searched in names like {clip_ids[0]!r}"
        )
    return groups, labels


@contextmanager
def _limited(pattern: str) -> Iterator[None]:
    """End a search that takes too long; `re` looks for signals while it searches."""

    def stop(*_: object) -> NoReturn:
        raise PatternError(
            f"the label pattern {pattern!r} takes more than {LIMIT:g} s of processor time; a repeat within a "
            "repeat, such as (a+)+, may take for ever: write it without"
        )

    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, LIMIT)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)
