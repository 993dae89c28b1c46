"""Groups of clips -> clusters with the numbers that they had before."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
import pyarrow as pa
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

from motionary.pipeline.tables import TABLES

VERSION = 2
MAKES = ("members", "lineage")


def identify(
    groups: pa.Table, members: pa.Table, lineage: pa.Table, names: Mapping[str, str], after: str
) -> dict[str, pa.Table]:
    """Give each group of clips the number of the cluster that it shares most clips with.

    The numbers are assigned such that the clips that keep theirs are as many as can be; a group without one
    gets a number that no cluster ever had.

    Parameters
    ----------
    groups : pyarrow.Table
        The group of every clip.
    members, lineage : pyarrow.Table
        What this stage made in the earlier run; empty in a first one.
    names : mapping of str to str
        Of every clip that was there before, what it was called.
    after : str
        The snapshot of the earlier run.

    Returns
    -------
    dict of str to pyarrow.Table
        `members`, in the order of `groups`, and `lineage`: the earlier rows, then what became of every
        cluster.
    """
    before = dict(zip(members["clip_id"].to_pylist(), members["cluster_id"].to_pylist(), strict=True))
    clip_ids, group_of = groups["clip_id"].to_pylist(), groups["group"].to_pylist()
    shared = Counter(
        (group, before.get(names.get(clip_id, ""))) for clip_id, group in zip(clip_ids, group_of, strict=True)
    )
    ever = [
        one for side in ("cluster_id", "previous_id") for one in lineage[side].to_pylist() if one is not None
    ]
    number = _numbers(shared, 1 + max(ever, default=0))
    rows = _lineage_rows(shared, number, set(before.values()), after)
    return {
        "members": pa.table(
            {"clip_id": clip_ids, "cluster_id": [number[group] for group in group_of]},
            schema=TABLES["members"],
        ),
        "lineage": pa.concat_tables([lineage, pa.Table.from_pylist(rows, schema=TABLES["lineage"])]),
    }


Shared = Counter[tuple[int, int | None]]
"""How many clips a group has of each earlier cluster; of none, those that are new."""


def _numbers(shared: Shared, unused: int) -> dict[int, int]:
    groups = sorted({group for group, _ in shared})
    chosen = _matched(groups, shared)
    for group in groups:
        if group not in chosen:
            chosen[group] = unused
            unused += 1
    return chosen


def _matched(groups: list[int], shared: Shared) -> dict[int, int]:
    """Match groups with earlier clusters such that most clips are in both; few of all pairs share any."""
    pairs = sorted((group, one, clips) for (group, one), clips in shared.items() if one is not None)
    if not pairs:
        return {}
    row_of, earlier = {group: row for row, group in enumerate(groups)}, sorted({one for _, one, _ in pairs})
    column_of = {one: column for column, one in enumerate(earlier)}
    # The matching takes every row: one more column a row stands for none, and a clip more everywhere keeps
    # that from being a zero, which a sparse matrix does not hold.
    none = range(len(earlier), len(earlier) + len(groups))
    rows = [row_of[group] for group, _, _ in pairs] + [*range(len(groups))]
    places = rows, [column_of[one] for _, one, _ in pairs] + [*none]
    weights = np.array([clips + 1 for _, _, clips in pairs] + [1] * len(groups), float)
    overlap = csr_array((weights, places), shape=(len(groups), none.stop))
    columns = min_weight_full_bipartite_matching(overlap, maximize=True)[1]
    return {
        group: earlier[column] for group, column in zip(groups, columns, strict=True) if column < len(earlier)
    }


def _lineage_rows(shared: Shared, number: Mapping[int, int], previous: set[int], after: str) -> list[dict]:
    now, seen = set(number.values()), {one for _, one in shared}
    rows: list[dict] = []
    for (group, one), clips in shared.items():
        event = _event(number[group], one, previous, now)
        if one is not None or number[group] not in previous:
            rows.append({"event": event, "cluster_id": number[group], "previous_id": one, "clips": clips})
    rows += [{"event": "gone", "cluster_id": None, "previous_id": one, "clips": 0} for one in previous - seen]
    rows.sort(key=lambda row: (row["cluster_id"] or np.inf, row["previous_id"] or 0))
    return [{"after": after, **row} for row in rows]


def _event(cluster_id: int, previous_id: int | None, previous: set[int], now: set[int]) -> str:
    if previous_id is None:
        return "new"
    if previous_id == cluster_id:
        return "kept"
    if previous_id not in now:
        return "merged"
    return "moved" if cluster_id in previous else "split"
