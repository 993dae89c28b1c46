"""The clips of a library that are nearest to one clip, exactly, most of them without their distance [DC 3-5].

Every metric is made of averages of costs. DTW is the average along a path; S-DTW at any threshold is a sum of
at least one zone's B-DTW, each an average along a path inside the zone. So with c the least cost of a pair

    c <= DTW,  c <= B-DTW,  c <= S-DTW(lambda) for every lambda                                    (1)

and what is made of the curve, the weighted distance or low + tau (high - low), grows with each of its values:
with c in place of those that are not computed yet it is a lower bound at any moment. Two more bounds are

    c >= the least distance of their shadows >= the distance of the boxes that hold the shadows    (2)
    B-DTW >= (sum over rows of the row's least cost + (n - 1) c) / (m + n - 1)                     (3)

A shadow is a clip along 16 orthonormal directions alone, those in which the library's frames spread most: no
two frames lie further apart there than they do. (3) holds since a path has a cell in each of the m rows and
at most n - 1 others, none below c, and adding a cell of cost c to the row's least ones can only lower their
average; columns alike. A pair is left as soon as its bound lies above the k-th best distance so far: by (2)
before its costs are computed, by (1) or (3) before a path is, then after each value of the curve, the
greatest lambda first: there one zone is all, and far above c.

The answer is that of comparing all, bit for bit. Costs are rounded to quanta (`fixed_point.py`) of at most
2^-23 of the greatest, which is subtracted. A bound goes through the same additions in the same order as the
distance itself, and rounding never puts a smaller sum above a greater one. Distances are ranked as float32,
which table `pairs` holds, equal ones by their place in the library, and only a bound strictly above counts.
Clips are taken in the order of how far their shadows' means and deviations lie apart, which proves nothing
but puts near ones first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.config import Metric
from motionary.pipeline.distances.cost import PackedClips, pack_clips
from motionary.pipeline.distances.curve import THRESHOLDS, weighted_sums
from motionary.pipeline.distances.lanes import LANES, padded
from motionary.pipeline.distances.nearest_kernels import (
    QUANTUM,
    Best,
    Hidden,
    RankedCurve,
    SearchRoom,
    search,
)
from motionary.pipeline.distances.segment_dtw import make_workspace
from motionary.pipeline.distances.tiles import comparable_clips, room_for_costs
from motionary.pipeline.distances.zones import checked_thresholds
from motionary.pipeline.motion import FloatArray

# Directions of a shadow, and frames taken at once to find them.
_SHADOW, _AT_ONCE = 16, 1 << 16

METRICS: tuple[Metric, ...] = ("dtw", "b_dtw", "weighted", "fuzzy")


@dataclass(frozen=True, eq=False)
class PackedLibrary:
    """Clips laid out once for many searches.

    Parameters
    ----------
    clips : PackedClips
    centre, directions : array (d,), (d, e)
        Mean of all frames, and the e directions, orthonormal, along which they spread most.
    shadows : PackedClips
        The clips along those directions alone, (frames, e).
    least, greatest : array (clips, e)
        The box that holds each clip's shadow.
    summary : array (clips, 2 e)
        Mean and deviation of each clip's shadow.
    radius : array (clips,)
        How far each clip's frames lie from the centre at most.
    """

    clips: PackedClips
    centre: NDArray[np.float64]
    directions: NDArray[np.float64]
    shadows: PackedClips
    least: NDArray[np.float64]
    greatest: NDArray[np.float64]
    summary: NDArray[np.float64]
    radius: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.least)


@dataclass(frozen=True, eq=False)
class Nearest:
    """What a search found.

    Parameters
    ----------
    index : array (found,) int
        Clips of the library, nearest first; equally near ones in the library's order.
    distance : array (found,) float32
        Theirs.
    compared : int
        Clips whose distance was computed.
    pruned : int
        Clips that a bound ruled out before.
    """

    index: NDArray[np.int64]
    distance: NDArray[np.float32]
    compared: int
    pruned: int


def pack_library(clips: Sequence[ArrayLike]) -> PackedLibrary:
    """Lay clips out for `nearest_clips`.

    Parameters
    ----------
    clips : sequence of array (frames, d)
        At least one.

    Raises
    ------
    ValueError
        There is none, or names the one that is empty, not two-dimensional, not finite, too long or of another
        dimension.
    """
    if not len(clips):
        raise ValueError("a library without clips has no nearest one; give at least one clip")
    arrays = comparable_clips(clips, [f"clips[{i}]" for i in range(len(clips))])
    begins = np.cumsum([0, *map(len, arrays[:-1])])
    stacked = np.concatenate(arrays)
    centre = stacked.mean(axis=0, dtype=np.float64)
    directions = _directions(stacked, centre)
    shadows = [_shadow(clip, centre, directions) for clip in arrays]
    cast = np.concatenate(shadows).astype(np.float64)
    return PackedLibrary(
        pack_clips(arrays),
        centre,
        directions,
        pack_clips(shadows),
        np.minimum.reduceat(cast, begins),
        np.maximum.reduceat(cast, begins),
        _summaries(cast, begins),
        np.array([_radius(clip, centre) for clip in arrays]),
    )


def nearest_clips(
    query: ArrayLike,
    library: PackedLibrary,
    k: int = 10,
    metric: Metric = "weighted",
    thresholds: ArrayLike = THRESHOLDS,
    *,
    tau: float = 0.5,
    groups: ArrayLike | None = None,
    among: ArrayLike | None = None,
    prune: bool = True,
) -> Nearest:
    """Find the clips nearest to one, or the groups of clips.

    Parameters
    ----------
    query : array (frames, d)
        Of the library's dtype, or converted to it.
    library : PackedLibrary
        N clips.
    k : int
        How many.
    metric : {"dtw", "b_dtw", "weighted", "fuzzy"}
        Fuzzy ranks by low + tau (high - low).
    thresholds : sequence of float (T,)
        lambda of the curve, each 0 to 1.
    tau : float
        0 to 1; `fuzzy_tau` of the configuration.
    groups : array (N,) of int, optional
        A number a clip. Then the k nearest groups are found, each by its nearest clip.
    among : array of int, optional
        Only these clips of the library.
    prune : bool
        Whether bounds are used. The answer is the same.

    Returns
    -------
    Nearest
        Of min(k, clips or groups) clips.

    Raises
    ------
    ValueError
        The query cannot be compared with the library, or an argument is out of its range.
    """
    _check(k, metric, tau)
    packed = library.clips
    given = np.asarray(query, dtype=packed.rows.dtype)
    asked, _ = comparable_clips([given, packed.rows[:1]], ["query", "the library"])
    lambdas = checked_thresholds(thresholds)
    numbers = _checked_groups(groups, len(library))
    shadow = _shadow(asked, library.centre, library.directions)
    rounding = _rounding(asked)
    margins = _margins(_radius(asked, library.centre) + library.radius, rounding)
    bounds, apart = _bounds(shadow.astype(np.float64), library, rounding)
    order = _checked_places(among, len(library))
    order = order[np.argsort(apart[order], kind="stable")]
    best = Best(np.full(k, np.inf, dtype=np.float32), np.full(k, len(library)), np.full(k, -1))
    curve = RankedCurve(lambdas, weighted_sums(np.eye(len(lambdas)), lambdas), float(tau))
    one, room = pack_clips([asked]), _room(asked, packed, len(lambdas))
    hidden = Hidden(pack_clips([shadow]), library.shadows, bounds - margins, margins, 1 - rounding)
    number = METRICS.index(metric)
    compared = search(one, packed, hidden, order, numbers, number, curve, prune, best, room)
    found = best.clip < len(library)
    return Nearest(best.clip[found], best.distance[found], compared, len(order) - compared)


def _check(k: int, metric: str, tau: float) -> None:
    if k < 1:
        raise ValueError(f"k is {k}; ask for at least one clip")
    if metric not in METRICS:
        raise ValueError(f"metric is {metric!r}; it must be one of {', '.join(map(repr, METRICS))}")
    if not 0 <= tau <= 1:
        raise ValueError(f"tau is {tau}; it must lie in 0 .. 1")


def _checked_groups(groups: ArrayLike | None, clips: int) -> NDArray[np.int64]:
    numbers = np.arange(clips) if groups is None else np.array(groups, dtype=np.int64)
    if numbers.shape != (clips,):
        raise ValueError(f"{len(numbers)} groups for {clips} clips; give one a clip")
    return numbers


def _checked_places(among: ArrayLike | None, clips: int) -> NDArray[np.int64]:
    places = np.arange(clips) if among is None else np.unique(np.asarray(among, dtype=np.int64))
    outside = places[(places < 0) | (places >= clips)]
    if len(outside):
        raise ValueError(f"among holds {outside[0]}; the library's clips are 0 to {clips - 1}")
    return places


def _room(query: FloatArray, library: PackedClips, values: int) -> SearchRoom:
    rows, columns = sorted((len(query), int(library.frames.max())))
    dtype = library.rows.dtype
    return SearchRoom(
        room_for_costs(rows, columns, dtype),
        make_workspace(rows, columns),
        np.empty(padded(columns, LANES), dtype=dtype),
        np.empty(values),
    )


def _directions(stacked: FloatArray, centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """Find the principal directions of frames, `_SHADOW` of them at most."""
    scale = max(float(stacked.max()), -float(stacked.min())) or 1.0  # its square may be too large a number
    moment = np.zeros((len(centre), len(centre)))
    for begin in range(0, len(stacked), _AT_ONCE):
        part = (stacked[begin : begin + _AT_ONCE] - centre) / scale
        moment += part.T @ part
    return np.linalg.eigh(moment)[1][:, ::-1][:, :_SHADOW]


def _shadow(clip: FloatArray, centre: NDArray[np.float64], directions: NDArray[np.float64]) -> FloatArray:
    return ((clip - centre) @ directions).astype(clip.dtype)


def _radius(clip: FloatArray, centre: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(clip - centre, axis=1).max())


def _summaries(stacked: FloatArray, begins: NDArray[np.int64]) -> NDArray[np.float64]:
    """Mean and deviation (clips, 2 d) of clips that stand one after another."""
    frames = np.diff(begins, append=len(stacked))[:, None]
    means, squares = (np.add.reduceat(stacked**power, begins, dtype=np.float64) / frames for power in (1, 2))
    return np.hstack([means, np.sqrt(np.maximum(squares - means**2, 0.0))])


def _rounding(query: FloatArray) -> float:
    """Of a cost, more than the rounding of it and of its shadow: each adds at most d squares."""
    return 4 * (query.shape[1] + 8) * float(np.finfo(query.dtype).eps)


def _margins(radii: NDArray[np.float64], rounding: float) -> NDArray[np.float64]:
    """How far a shadow may come to lie from its place, and a quantum of the greatest cost there can be."""
    return radii * (rounding + 2 * QUANTUM)


def _bounds(
    shadow: NDArray[np.float64], library: PackedLibrary, rounding: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances of the shadows' boxes (2), and how far apart the clips seem to be."""
    least, greatest = shadow.min(axis=0), shadow.max(axis=0)
    between = np.maximum(np.maximum(library.least - greatest, least - library.greatest), 0.0)
    apart = np.linalg.norm(library.summary - _summaries(shadow, np.zeros(1, dtype=np.int64)), axis=1)
    return np.linalg.norm(between, axis=1) * (1 - rounding), apart
