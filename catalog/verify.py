"""Whether a snapshot is whole and its tables agree with each other: PASSED or FAILED, check by check.

Checks read files one by one or ask SQL for the rows that are wrong, so that a catalog larger than memory can
be verified. A check that cannot be done, because what it reads is damaged, has failed too: its reason says
so. Damage elsewhere fails none: SQL opens the tables that a query names and no others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from motionary.catalog.checks.alignments import (
    aligned_frames_are_the_references,
    clips_are_aligned,
    clips_have_a_style,
)
from motionary.catalog.checks.clips import (
    clips_are_accounted_for,
    clips_are_unique_and_sorted,
    clips_have_their_frames,
    merged_frames_cover_every_frame,
    the_run_counted_them,
)
from motionary.catalog.checks.clusters import (
    clusters_have_a_reference,
    clusters_hold_every_clip,
    distances_to_references_are_the_pairs,
    labels_are_consistent,
)
from motionary.catalog.checks.dendrograms import linkages_are_dendrograms, partitions_hold_every_clip
from motionary.catalog.checks.files import (
    files_are_as_written,
    manifest_is_complete,
    parquet_reads,
    schemas_are_the_tables,
)
from motionary.catalog.checks.found import MOST_TOLD, Found
from motionary.catalog.checks.pairs import distances_are_sound, pairs_are_there_once
from motionary.catalog.query import Catalog
from motionary.catalog.store import Store


@dataclass(frozen=True)
class Check:
    """The outcome of one check.

    Parameters
    ----------
    name : str
        What is so, if it passed.
    passed : bool
    detail : str
        What was looked at; or what is wrong, with the place.
    """

    name: str
    passed: bool
    detail: str


@dataclass(frozen=True)
class _Rule:
    """A check: its name and what does it."""

    name: str
    find: Callable[[Catalog], Found]


_MANIFEST = "the manifest reads"
_RULES = (
    _Rule("the manifest is complete", manifest_is_complete),
    _Rule("files are as they were written", files_are_as_written),
    _Rule("plain pyarrow reads every file", parquet_reads),
    _Rule("files have their tables' schemas", schemas_are_the_tables),
    _Rule("clips are unique and sorted", clips_are_unique_and_sorted),
    _Rule("inputs are clips or quarantined", clips_are_accounted_for),
    *(
        _Rule(f"clips have their {table}", partial(clips_have_their_frames, table=table))
        for table in ("frames", "features", "resampled")
    ),
    _Rule("merged frames cover every frame", merged_frames_cover_every_frame),
    _Rule("the run counted what is there", the_run_counted_them),
    _Rule("every pair is there once", pairs_are_there_once),
    _Rule("distances are distances", distances_are_sound),
    _Rule("linkages are dendrograms", linkages_are_dendrograms),
    _Rule("partitions hold every clip once", partitions_hold_every_clip),
    _Rule("clusters hold every clip once", clusters_hold_every_clip),
    _Rule("clusters have one reference", clusters_have_a_reference),
    _Rule("distances to references are the pairs'", distances_to_references_are_the_pairs),
    _Rule("labels are consistent", labels_are_consistent),
    _Rule("clips are aligned once", clips_are_aligned),
    _Rule("aligned clips have their reference's frames", aligned_frames_are_the_references),
    _Rule("clips have one style", clips_have_a_style),
)


def verify(store_or_url: Store | str, snapshot: str | int | None = None) -> Iterator[Check]:
    """Check a snapshot of a catalog, from its manifest to its styles.

    Parameters
    ----------
    store_or_url : Store or str
        The catalog.
    snapshot : str or int, optional
        The snapshot's or the run's id, as `Catalog.open` takes it; the published one unless given.

    Yields
    ------
    Check
        As soon as it is done. Without a manifest that reads there is only that one.
    """
    url = store_or_url.url if isinstance(store_or_url, Store) else str(store_or_url)
    try:
        opened = Catalog.open(url, snapshot)
    except Exception as error:  # whatever damage makes of it
        yield Check(_MANIFEST, False, _reason(error))
        return
    with opened:  # a vacuum meanwhile leaves the snapshot alone
        yield Check(_MANIFEST, True, f"{url}, snapshot {opened.snapshot.snapshot_id}")
        for rule in _RULES:
            yield _checked(rule, opened)


def _checked(rule: _Rule, opened: Catalog) -> Check:
    try:
        found = rule.find(opened)
    except Exception as error:  # damaged data may raise anything, and other checks must go on
        return Check(rule.name, False, f"cannot be checked: {_reason(error)}")
    if not found.wrong:
        return Check(rule.name, True, found.seen)
    more = len(found.wrong) - MOST_TOLD
    told = [_one_line(one) for one in found.wrong[:MOST_TOLD]] + ([f"and {more} more"] if more > 0 else [])
    return Check(rule.name, False, "; ".join(told))


def _reason(error: Exception) -> str:
    return _one_line(f"{type(error).__name__}: {error}")


def _one_line(text: str) -> str:
    return " ".join(text.split())
