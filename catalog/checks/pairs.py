"""Pairs: each of the N (N - 1) / 2 is there once, and its distances are distances."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.catalog.checks.found import MOST_TOLD, Found, parts
from motionary.catalog.landmarks import clustered_clips, route_of
from motionary.catalog.query import Catalog
from motionary.pipeline.clustering.condensed import places_of
from motionary.pipeline.stages.columns import matrix


def pairs_are_there_once(catalog: Catalog) -> Found:
    """Every two clips are compared in one row, the earlier clip_id first; some are not where the run says so.

    Of a run by landmarks, every two of these.

    In memory are one file of pairs and a byte for every pair.
    """
    ids = pa.array(clustered_clips(catalog), pa.string())
    clips = len(ids)
    seen = np.zeros(clips * (clips - 1) // 2, np.uint8)
    wrong = []
    for file, rows in parts(catalog, "pairs", ["clip_a", "clip_b"]):
        known = [pc.index_in(column, ids) for column in rows.columns]
        for column, found in zip(rows.columns, known, strict=True):
            strangers = pc.unique(column.filter(pc.is_null(found))).to_pylist()
            wrong += [f"{clip_id} is compared in {file} and is no clip" for clip_id in strangers]
        a, b = (found.fill_null(-1).to_numpy().astype(np.int64) for found in known)
        swapped = np.flatnonzero((a >= b) & (a >= 0) & (b >= 0))
        wrong += [_pair_of(rows, row) + f" of {file} do not stand in order" for row in swapped[:MOST_TOLD]]
        inside = np.flatnonzero((a >= 0) & (b >= 0) & (a != b))
        place = places_of(np.minimum(a, b)[inside], np.maximum(a, b)[inside], clips)
        again = inside[_repeated(place) | (seen[place] > 0)]
        wrong += [_pair_of(rows, row) + f" are compared again in {file}" for row in again[:MOST_TOLD]]
        seen[place] = 1
    missing = len(seen) - np.count_nonzero(seen)
    if missing and route_of(catalog) != "pruned":
        wrong.append(f"{missing} of {len(seen)} pairs are missing, the first of {_nth(ids, np.argmin(seen))}")
    return Found(f"{np.count_nonzero(seen)} pairs of {clips} clips", wrong)


def distances_are_sound(catalog: Catalog) -> Found:
    """No distance is negative, infinite or not a number, and those that bound each other do.

    B-DTW is the smaller of DTW and another [DC eq. 1]; the fuzzy interval runs from the least of the curve to
    its greatest [DC eq. 10].
    """
    names = ["dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high"]
    wrong, count = [], 0
    for file, rows in parts(catalog, "pairs", ["clip_a", "clip_b", "curve", *names]):
        if not len(rows):
            continue
        count += len(rows)
        curve = matrix(rows["curve"])
        values = {name: rows[name].to_numpy() for name in names}
        faults = {
            f"{name} is no distance": ~(np.isfinite(column) & (column >= 0))
            for name, column in values.items()
        }
        faults["the curve holds what is no distance"] = ~(np.isfinite(curve) & (curve >= 0)).all(axis=1)
        faults["b_dtw exceeds dtw"] = values["b_dtw"] > values["dtw"]
        faults["fuzzy_low is not the least of the curve"] = _differ(values["fuzzy_low"], curve.min(axis=1))
        faults["fuzzy_high is not the greatest of the curve"] = _differ(
            values["fuzzy_high"], curve.max(axis=1)
        )
        for fault, where in faults.items():
            wrong += [
                f"{fault}: {_pair_of(rows, row)} of {file}" for row in np.flatnonzero(where)[:MOST_TOLD]
            ]
    return Found(f"{count} pairs", wrong)


def _differ(one: NDArray, other: NDArray) -> NDArray[np.bool_]:
    """Say where two columns differ; what is not a number has been told already."""
    return ~(one == other) & ~np.isnan(one) & ~np.isnan(other)


def _repeated(place: NDArray[np.int64]) -> NDArray[np.bool_]:
    repeated = np.ones(len(place), bool)
    repeated[np.unique(place, return_index=True)[1]] = False
    return repeated


def _pair_of(rows: pa.Table, row: int) -> str:
    return f"{rows['clip_a'][int(row)]} and {rows['clip_b'][int(row)]}"


def _nth(ids: pa.Array, place: np.intp) -> str:
    """Name the clips of a pair by its place in condensed order."""
    first = 0
    while (row := len(ids) - 1 - first) <= place:
        first, place = first + 1, place - row
    return f"{ids[first]} and {ids[first + 1 + int(place)]}"
