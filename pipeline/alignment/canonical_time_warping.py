"""Canonical time warping (CTW): a path, and the space in which sequences are compared along it.

**Zhou, De la Torre**, *Canonical time warping for alignment of human behavior*, NIPS 2009, as [GTW] 1 and 4.4
tell it. Two sequences X and Y, which may differ in what and how many DOFs they have, are projected to where
they correlate (canonical correlation analysis, `multiset_cca.py`), and joined there by dynamic time warping:

    least  sum over the path of |V_x^T x_i - V_y^T y_k|^2,    V_x, V_y those of eq. 8 for the path before

Both steps take turns until a path repeats. A path never costs more than the one before it at the same
projections (`CanonicalWarp.costs`), but the constraint on the projections holds the path as well, so the
alternation need not descend. The path of least cost a dimension is kept: rounds may keep other numbers of
dimensions, and the constraint gives each the same weight.

- The start decides much. Where both have the same number of DOFs it is the nearest path of both, each
  centred (V = I), which takes DOF j of one to be DOF j of the other; else, with nothing to compare, a uniform
  path, as [GTW] begins. A uniform path is a local minimum for many takes, and the nearest one is no guide
  where DOFs mean different things: `start` chooses.
- Projections are regularised (lambda of eq. 7, in units of each sequence's own variance). A take has hardly
  more frames than DOFs, and at 0 some projection agrees perfectly along any path, which so repeats at once;
  near 1 only the largest movement counts. Where there are few DOFs, little regularisation sees through more.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.dtw import nearest_path
from motionary.pipeline.alignment.multiset_cca import Embedding, multiset_cca
from motionary.pipeline.alignment.path_warp import PathWarp, path_warp
from motionary.pipeline.alignment.uniform import uniform_times
from motionary.pipeline.alignment.warp import at_a_clear_size, checked_sequence
from motionary.pipeline.motion import FloatArray


@dataclass(frozen=True, eq=False)
class CanonicalWarp(PathWarp):
    """The warp that canonical time warping found, with the space that it was found in.

    Parameters
    ----------
    embedding : Embedding
        The projections in which the path costs least: of the moving sequence, of the reference.
    costs : array (rounds, 2)
        The sum of squared distances in each round's projections: along the path that they were made for, and
        along the path found with them, which is never more.
    """

    embedding: Embedding
    costs: FloatArray


def canonical_time_warping(
    moving: FloatArray,
    reference: FloatArray,
    regularisation: float = 0.01,
    kept: float = 0.9,
    start: Literal["nearest", "uniform"] | None = None,
    most_rounds: int = 50,
) -> CanonicalWarp:
    """Warp one sequence along the path on which it correlates with another of whatever kind.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, other dofs)
        The sequence whose timing it takes, of as many or other DOFs.
    regularisation : float
        lambda, from 0 (correlation) to 1 (covariance).
    kept : float
        Share of the total correlation that the dimensions compared hold, the fewest that do.
    start : {"nearest", "uniform"}, optional
        The first path. "nearest" by default where both have the same number of DOFs, which it takes for the
        same DOFs; else "uniform".
    most_rounds : int
        Pairs of steps at most, at least 1.

    Returns
    -------
    CanonicalWarp
        Path and mean times as of `dtw`, the projections and the costs. Where a sequence does not move nothing
        correlates: the first path, no round and a space of no dimensions.

    Raises
    ------
    ValueError
        A sequence is not (frames, dofs) or holds a value that is not finite, a setting is out of range, the
        sequences are too long (n + m above 2^19), or one so small that its projection is beyond 64 bits.
    """
    moving = checked_sequence(moving, "moving").astype(np.float64)
    reference = checked_sequence(reference, "reference").astype(np.float64)
    if most_rounds < 1:
        raise ValueError(f"most_rounds is {most_rounds}; it takes one round at least")
    path = _first_path(moving, reference, start)
    # Each by itself: their proportion counts in the first path alone.
    (moving,), own = at_a_clear_size(moving)
    (reference,), others = at_a_clear_size(reference)
    least, best, space = np.inf, path, _no_space(moving, reference)
    costs: list[tuple[float, float]] = []
    # What stands still throughout correlates with nothing: the first path is as good as any.
    most = most_rounds if all(np.ptp(one, axis=0).any() for one in (moving, reference)) else 0
    seen: set[bytes] = set()
    while len(costs) < most and path.tobytes() not in seen:
        seen.add(path.tobytes())
        embedding = multiset_cca([moving[path[:, 0]], reference[path[:, 1]]], regularisation, kept)
        one, other = embedding.project([moving, reference])
        before, path = path, nearest_path(one, other)
        costs.append((_cost(one, other, before), _cost(one, other, path)))
        of_a_dimension = costs[-1][1] / one.shape[1]
        if of_a_dimension < least:
            least, best, space = of_a_dimension, path, embedding
    warp = path_warp(best, len(moving))
    space = _in_their_units(space, own, others)
    return CanonicalWarp(
        warp.source_time, warp.moving_frames, warp.path, space, np.array(costs).reshape(-1, 2)
    )


def _in_their_units(space: Embedding, *exponents: int) -> Embedding:
    """Return projections and means for sequences as they were given."""
    both = list(zip(space.projections, space.means, exponents, strict=True))
    with np.errstate(over="ignore"):
        projections = tuple(np.ldexp(projection, exponent) for projection, _, exponent in both)
    if not all(np.isfinite(projection).all() for projection in projections):
        raise ValueError(
            "a sequence's values are so small that its projection is beyond 64 bits; use a smaller unit"
        )
    means = tuple(np.ldexp(mean, -exponent) for _, mean, exponent in both)
    return replace(space, projections=projections, means=means)


def _no_space(*sequences: FloatArray) -> Embedding:
    none = np.empty(0)
    return Embedding(
        tuple(np.empty((values.shape[1], 0)) for values in sequences),
        tuple(values.mean(axis=0) for values in sequences),
        none,
        none,
    )


def _first_path(moving: FloatArray, reference: FloatArray, start: str | None) -> NDArray[np.int64]:
    dofs = moving.shape[1], reference.shape[1]
    if start is None:
        start = "nearest" if dofs[0] == dofs[1] else "uniform"
    if start == "uniform":
        steps = max(len(moving), len(reference))
        times = [uniform_times(len(values), steps) for values in (moving, reference)]
        return np.rint(np.stack(times, axis=1)).astype(np.int64)
    if start != "nearest":
        raise ValueError(f'start is {start!r}; it must be "nearest" or "uniform"')
    if dofs[0] != dofs[1]:
        raise ValueError(
            f'moving has {dofs[0]} DOFs and reference {dofs[1]}; nothing is nearest: take start="uniform"'
        )
    return nearest_path(moving - moving.mean(axis=0), reference - reference.mean(axis=0))


def _cost(moving: FloatArray, reference: FloatArray, path: NDArray[np.int64]) -> float:
    return float(((moving[path[:, 0]] - reference[path[:, 1]]) ** 2).sum())
