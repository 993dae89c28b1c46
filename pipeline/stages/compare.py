"""Two batches of clips -> a tile of pairs [DC 3-5]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.pipeline.config import DistanceConfig
from motionary.pipeline.origins import Block
from motionary.pipeline.stages.columns import matrices_by_clip
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("pairs",)

Values = dict[str, NDArray[np.float32]]
"""Of every distance, its values for all clips of one batch with all of another."""


def compare(
    first: pa.Table,
    second: pa.Table,
    config: DistanceConfig,
    most: float | None = None,
    carried: Sequence[tuple[dict[str, pa.Table], Block]] = (),
) -> dict[str, pa.Table]:
    """Compute every distance between the clips of two sides.

    Parameters
    ----------
    first, second : pyarrow.Table
        `resampled` of two sides, or twice of one; a pair of clips is compared once.
    config : DistanceConfig
        The thresholds.
    most : float, optional
        mu: pairs whose weighted distance is greater are left out.
    carried : sequence of (tables, Block)
        Earlier results that hold some of the pairs.

    Returns
    -------
    dict of str to pyarrow.Table
        `pairs`.
    """
    one, other = _distinct(first), _distinct(second)
    wanted = _Wanted(thresholds_of(config), np.float64(np.inf if most is None else most))
    values, known = _carried(one.names, other.names, carried)
    if one.clip_ids == other.clip_ids:
        _compute_within(values, known, one.clips, wanted)
        i, j = np.triu_indices(len(one.clip_ids), 1)
        twins = one.place[i[one.place[i] == one.place[j]]]
        for itself in np.unique(twins):
            alone = np.array([itself])
            _compare(values, alone, alone, one.clips, one.clips, wanted)
    else:
        _compute_between(values, known, one.clips, other.clips, wanted)
        i, j = np.indices((len(one.clip_ids), len(other.clip_ids))).reshape(2, -1)
    near = values["weighted"][one.place[i], other.place[j]] <= wanted.most
    i, j = i[near], j[near]
    columns: dict[str, pa.Array] = {}
    columns["clip_a"], columns["clip_b"] = _in_order(one.clip_ids, other.clip_ids, i, j)
    for name in _distances():
        found = values[name][one.place[i], other.place[j]]
        columns[name] = (
            pa.FixedSizeListArray.from_arrays(found.reshape(-1), found.shape[1])
            if name == "curve"
            else pa.array(found)
        )
    return {"pairs": pa.table(columns, schema=TABLES["pairs"])}


class _Wanted(NamedTuple):
    """The lambdas of the curve, and the weighted distance up to which pairs are wanted; infinite: all."""

    thresholds: tuple[float, ...]
    most: np.float64  # a plain float would be rounded to the distances' float32 where the two are compared


@dataclass(frozen=True, eq=False)
class _Side:
    """A side: its clips, and of those with equal frames the first, which stands for the others.

    `place` says of every clip which of `names` and `clips` stands for it.
    """

    clip_ids: list[str]
    names: list[str]
    clips: list[NDArray]
    place: NDArray[np.intp]


def _distinct(resampled: pa.Table) -> _Side:
    place_of: dict[bytes, int] = {}
    batch = matrices_by_clip(resampled)
    names: list[str] = []
    clips: list[NDArray] = []
    place: list[int] = []
    for clip_id, frames in batch.items():
        place.append(place_of.setdefault(frames.tobytes(), len(names)))
        if place[-1] == len(names):
            names.append(clip_id)
            clips.append(frames)
    return _Side([*batch], names, clips, np.array(place, dtype=np.intp))


def _in_order(
    ids: Sequence[str], other_ids: Sequence[str], i: NDArray[np.intp], j: NDArray[np.intp]
) -> tuple[pa.Array, pa.Array]:
    """Name the clips of pairs, given by their places on either side, the earlier clip_id first."""
    names = sorted({*ids, *other_ids})
    rank = {name: place for place, name in enumerate(names)}
    a, b = (np.array([rank[one] for one in side], dtype=np.intp)[k] for side, k in ((ids, i), (other_ids, j)))
    called = pa.array(names, pa.string())
    return called.take(pa.array(np.minimum(a, b))), called.take(pa.array(np.maximum(a, b)))


def _distances() -> list[str]:
    return [name for name in TABLES["pairs"].names if name not in ("clip_a", "clip_b")]


def _carried(
    ids: Sequence[str], other_ids: Sequence[str], carried: Sequence[tuple[dict[str, pa.Table], Block]]
) -> tuple[Values, NDArray[np.bool_]]:
    """Lay out what earlier results hold, and say which pairs those are; infinite is what was left out."""
    shape = (len(ids), len(other_ids))
    width = TABLES["pairs"].field("curve").type.list_size
    values = {
        name: np.zeros((*shape, width) if name == "curve" else shape, np.float32) for name in _distances()
    }
    values["weighted"].fill(np.inf)
    known = np.zeros(shape, dtype=bool)
    for tables, block in carried:
        pairs = tables["pairs"]
        firsts = np.array([block.first.get(one, "") for one in ids], dtype=object)
        seconds = np.array([block.second.get(one, "") for one in other_ids], dtype=object)
        rows = _rows(pairs, firsts, seconds)
        here = rows >= 0
        taken = pairs.take(pa.array(rows[here]))
        for name, value in values.items():
            column = taken[name].combine_chunks()
            value[here] = (
                column.flatten().to_numpy().reshape(-1, width) if name == "curve" else column.to_numpy()
            )
        # What the block spans and does not hold was too far; but a clip is not compared with itself there.
        known |= np.outer(firsts != "", seconds != "") & (firsts[:, None] != seconds)
    return values, known


def _rows(pairs: pa.Table, firsts: NDArray[np.object_], seconds: NDArray[np.object_]) -> NDArray[np.int64]:
    """Find the row of each pair of clips, whichever comes first in it; -1 where there is none."""
    sides = [*pairs["clip_a"].chunks, *pairs["clip_b"].chunks]
    names = pc.unique(pa.chunked_array(sides, pa.string()))
    row_of = np.full((len(names) + 1,) * 2, -1)
    a, b = (pc.index_in(pairs[side], names).to_numpy() for side in ("clip_a", "clip_b"))
    row_of[a, b] = row_of[b, a] = np.arange(len(pairs))
    here = (
        pc.fill_null(pc.index_in(pa.array(side, pa.string()), names), len(names)).to_numpy()
        for side in (firsts, seconds)
    )
    return row_of[np.ix_(*here)]


def _compute_between(
    values: Values,
    known: NDArray[np.bool_],
    clips: Sequence[NDArray],
    others: Sequence[NDArray],
    wanted: _Wanted,
) -> None:
    """Compute the unknown pairs of two sides: together those columns that lack the same rows."""
    if not known.any():
        _compare(values, np.arange(len(known)), np.arange(known.shape[1]), clips, others, wanted)
        return
    lacking, group_of = np.unique(~known, axis=1, return_inverse=True)
    for group, lacks in enumerate(lacking.T):
        columns = np.flatnonzero(group_of.reshape(-1) == group)
        _compare(values, np.flatnonzero(lacks), columns, clips, others, wanted)


def _compute_within(
    values: Values, known: NDArray[np.bool_], clips: Sequence[NDArray], wanted: _Wanted
) -> None:
    """Compute the pairs of one side that are not known; the part above the diagonal counts."""
    other_way = known.T & ~known
    for value in values.values():
        value[other_way] = np.swapaxes(value, 0, 1)[other_way]
    known = known | known.T
    new = np.flatnonzero(~known.any(axis=1))
    old = np.flatnonzero(known.any(axis=1))
    _compare(values, old, new, clips, clips, wanted)
    for name in values:
        values[name][np.ix_(new, old)] = np.swapaxes(values[name][np.ix_(old, new)], 0, 1)
    # Among the old ones a pair is missing only where an earlier result had one clip under two names.
    lacking = old[(~known[np.ix_(old, old)]).sum(axis=1) > 1]
    for some in (new, lacking):
        _among(values, some, clips, wanted)


def _among(values: Values, some: NDArray[np.intp], clips: Sequence[NDArray], wanted: _Wanted) -> None:
    from motionary.pipeline.distances import pairwise_distances
    from motionary.pipeline.distances.pruned import pairwise_under

    chosen = [clips[k] for k in some]
    if np.isinf(wanted.most):
        found = pairwise_distances(chosen, n_jobs=1, thresholds=wanted.thresholds)
        i, j = np.triu_indices(len(some), 1)
    else:
        near = pairwise_under(chosen, wanted.most, wanted.thresholds)
        found, i, j = near.distances, near.first, near.second
    for name, value in values.items():
        value[some[i], some[j]] = value[some[j], some[i]] = getattr(found, name)


def _compare(
    values: Values,
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    clips: Sequence[NDArray],
    others: Sequence[NDArray],
    wanted: _Wanted,
) -> None:
    from motionary.pipeline.distances import compare_clips
    from motionary.pipeline.distances.pruned import compare_under

    if not (len(rows) and len(columns)):
        return
    one, other = [clips[k] for k in rows], [others[k] for k in columns]
    if np.isinf(wanted.most):
        found = compare_clips(one, other, wanted.thresholds)
        for name in values:
            values[name][np.ix_(rows, columns)] = getattr(found, name)
    else:
        near = compare_under(one, other, wanted.most, wanted.thresholds)
        for name in values:
            values[name][rows[near.first], columns[near.second]] = getattr(near.distances, name)


def thresholds_of(config: DistanceConfig) -> tuple[float, ...]:
    """Return the lambdas of the curve that these settings mean."""
    from motionary.pipeline.distances import THRESHOLDS, random_thresholds

    return THRESHOLDS if config.thresholds == "midpoints" else random_thresholds(config.seed)
