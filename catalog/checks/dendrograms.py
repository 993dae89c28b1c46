"""Dendrograms and the partitions that they are cut into."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pyarrow as pa

from motionary.catalog.checks.found import Found, wrong_rows
from motionary.catalog.landmarks import approximation, clustered_clips, route_of
from motionary.catalog.query import Catalog


def linkages_are_dendrograms(catalog: Catalog) -> Found:
    """Every linkage merges N clips by N - 1 steps into one cluster, at heights that never fall.

    There is none where the run left far pairs out; by landmarks they are the N clips.

    Heights are compared as they are: merges were sorted by them.
    """
    clips = len(clustered_clips(catalog))
    rows = catalog.sql("from linkage order by method, metric, step")
    cuts = {
        (row["method"], row["metric"]) for row in catalog.sql("select method, metric from cuts").to_pylist()
    }
    keys = list(zip(rows["method"].to_pylist(), rows["metric"].to_pylist(), strict=True))
    wrong, start, met = [], 0, set()
    for key, group in groupby(keys):
        merges = rows.slice(start, length := len(list(group)))
        start += length
        met.add(key)
        wrong += [f"linkage {' '.join(key)}: {problem}" for problem in _faults(merges, clips)]
    if clips > 1 and route_of(catalog) != "pruned":
        wrong += [f"linkage {' '.join(key)} is missing" for key in sorted(cuts - met)]
    return Found(f"{len(met)} linkages of {clips} clips", wrong)


def _faults(merges: pa.Table, clips: int) -> list[str]:
    step, left, right, height, size = (
        merges[name].to_numpy() for name in ("step", "left", "right", "height", "size")
    )
    if not np.array_equal(step, np.arange(clips - 1)):
        return [f"{len(merges)} merges, {clips} clips take {clips - 1}, numbered from 0"]
    children = np.concatenate([left, right])
    if not np.array_equal(np.sort(children), np.arange(2 * clips - 2)):
        return ["a clip or cluster is merged twice or never"]
    if late := np.flatnonzero(np.maximum(left, right) >= clips + step).tolist():
        return [f"step {late[0]} merges a cluster that a later step makes"]
    wrong = []
    if not np.isfinite(height).all() or (height < 0).any():
        wrong.append("a height is no distance")
    elif falls := (1 + np.flatnonzero(np.diff(height) < 0)).tolist():
        wrong.append(
            f"the height falls at step {falls[0]}, from {height[falls[0] - 1]} to {height[falls[0]]}"
        )
    sizes = np.concatenate([np.ones(clips, np.int64), size])
    if unequal := np.flatnonzero(sizes[left] + sizes[right] != size).tolist():
        wrong.append(f"step {unequal[0]} makes a cluster of {size[unequal[0]]} clips, its parts differ")
    return wrong


def partitions_hold_every_clip(catalog: Catalog) -> Found:
    """Every partition puts every clip into one cluster; it has as many as its cut says, from 0.

    One of the cuts is the primary one, from which the published clusters come. Partitions by landmarks hold
    these alone.
    """
    clips = "clips"
    if approximation(catalog) is not None:
        clips = "(select clip_id from clips where clip_id in (select clip_id from partitions))"
    wrong = wrong_rows(
        catalog,
        """select concat_ws(' ', 'partition', method, metric, 'holds', clip_id, count(*), 'times')
           from partitions group by method, metric, clip_id having count(*) > 1""",
        f"""select concat_ws(' ', 'partition', method, metric, 'lacks', clip_id)
           from (select method, metric, clip_id from cuts cross join {clips}
                 except select method, metric, clip_id from partitions)""",
        f"""select concat_ws(' ', 'partition', method, metric, 'holds', clip_id, 'which is no clip of a cut')
           from (select method, metric, clip_id from partitions
                 except select method, metric, clip_id from cuts cross join {clips})""",
        """select concat_ws(' ', 'partition', method, metric, 'has clusters', min(cluster), 'to',
                            max(cluster), 'in all', count(distinct cluster), 'its cut', any_value(n_clusters))
           from partitions join cuts using (method, metric) group by method, metric
           having min(cluster) <> 0 or max(cluster) <> count(distinct cluster) - 1
                  or count(distinct cluster) <> any_value(n_clusters)""",
        """select number || ' cuts are the primary one'
           from (select count(*) filter ("primary") as number from cuts)
           where number <> 1 and exists (from clips)""",
    )
    wrong += _not_of_the_landmarks(catalog)
    seen = catalog.sql("select count(*) as partitions from cuts")["partitions"][0]
    return Found(f"{seen} partitions", wrong)


def _not_of_the_landmarks(catalog: Catalog) -> list[str]:
    """Tell which clips are landmarks or in partitions, and not both."""
    found = approximation(catalog)
    if found is None:
        return []
    held = catalog.sql("select distinct clip_id from partitions")["clip_id"].to_pylist()
    differ = sorted(set(held) ^ set(found.landmarks))
    return [f"{clip_id} is either a landmark or in the partitions, not both" for clip_id in differ]
