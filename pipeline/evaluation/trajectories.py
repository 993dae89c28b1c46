"""How alike two sequences in one time are, and how smooth one is.

**[FP]** Randall, Harvey, Williams, *Online alignment of human motion using forward plotting-DTW*, CAVW 34
(2023), compares a warped motion with its target by joint trajectories: the end of a vector of one unit along
the joint, turned by the joint's local rotation. Every coordinate of every joint is ranked against the
target's by Kendall's tau, and the taus are averaged (eq. 2),

    r(A, T) = 1 / (3 k) sum_j sum_a tau(A_ja, T_ja).

Conventions, each with its rival, since the paper names none:

- tau is tau-b, which divides by the pairs of frames that are tied in neither sequence's own column, not by
  all pairs (tau-a): a warp that holds a frame ties its own column, and is not marked down for that alone
- columns in which the *target* does not move are left out, where 3 k would count them as 0: whatever is
  aligned to a target is then averaged over the same columns, and a moving target is worth 1 against itself
- a joint lies along the direction that is given, as its bone does at rest; +Y, where none is
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from motionary.pipeline.alignment.rounding import rounding_level
from motionary.pipeline.alignment.warp import checked_pair, checked_sequence
from motionary.pipeline.motion import FloatArray

ALONG_Y = (0.0, 1.0, 0.0)

THIRD_DIFFERENCE = 4  # frames


def kendall_tau_similarity(values: FloatArray, target: FloatArray) -> float:
    """Compare a warped sequence with the one whose time it is in, by the ranks of their values [FP eq. 2].

    Parameters
    ----------
    values, target : array (frames, columns)
        Frame by frame in one time, such as `joint_trajectories` of both.

    Returns
    -------
    float
        Mean of tau-b over the columns in which the target moves by more than rounding, -1 to 1. A column that
        moves in the target alone is worth 0, and so is the whole where the target does not move at all.

    Raises
    ------
    ValueError
        The two have other shapes, or a value is not finite.
    """
    from scipy.stats import kendalltau

    values, target = _in_one_time(values, target)
    asked, moves = np.flatnonzero(_moves(target)), _moves(values)
    taus = [kendalltau(values[:, one], target[:, one]).statistic if moves[one] else 0.0 for one in asked]
    return float(np.mean(taus)) if taus else 0.0


def mean_distance(values: FloatArray, target: FloatArray) -> float:
    """Measure how far a warped sequence lies from the one whose time it is in: the mean over the frames.

    Parameters
    ----------
    values, target : array (frames, columns)
        Frame by frame in one time.

    Returns
    -------
    float
        Mean Euclidean distance of the two at a frame, in units of the values. The rival, the root of the
        mean *squared* distance, gives more weight to the frames that are furthest off.

    Raises
    ------
    ValueError
        The two have other shapes, or a value is not finite.
    """
    values, target = _in_one_time(values, target)
    return float(np.linalg.norm(values.astype(np.float64) - target, axis=1).mean())


def joint_trajectories(rotations: FloatArray, directions: ArrayLike = ALONG_Y) -> FloatArray:
    """Follow the end of a vector of one unit along every joint [FP 4].

    Parameters
    ----------
    rotations : array (T, J, 4)
        Local rotations, quaternions x, y, z, w; made unit here.
    directions : array (J, 3) or (3,), optional
        Along which each joint lies at rest, made unit here; +Y by default. A turn about this direction leaves
        no trace, so the direction of the joint's bone is the one to give.

    Returns
    -------
    array (T, 3 J)
        x, y and z of the first joint, in its parent's frame, then those of the second.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, or a quaternion or a direction has no length.
    """
    turns = np.asarray(rotations, dtype=np.float64)
    if turns.ndim != 3 or turns.shape[2] != 4 or not turns.size:
        raise ValueError(
            f"rotations have shape {turns.shape}; it needs (frames, joints, 4), at least one of each"
        )
    frames, joints = turns.shape[:2]
    along = np.asarray(directions, dtype=np.float64)
    if along.shape not in ((3,), (joints, 3)):
        raise ValueError(f"directions have shape {along.shape}; {joints} joints need (3,) or ({joints}, 3)")
    # A copy, since scipy takes no array that is read only.
    laid = np.broadcast_to(_unit(along, "directions"), (frames, joints, 3)).reshape(-1, 3).copy()
    turned = Rotation.from_quat(_unit(turns, "rotations").reshape(-1, 4)).apply(laid)
    return turned.reshape(frames, 3 * joints)


def jerk(values: FloatArray, rate: float = 1.0) -> float:
    """Measure how unsteadily a sequence moves: the mean length of its third differences.

    Parameters
    ----------
    values : array (frames, dofs)
        At least 4 frames.
    rate : float
        Frames a second; 1 leaves the result per frame cubed.

    Returns
    -------
    float
        In units of the values a second cubed; 0 where speed changes evenly, as in a parabola.

    Raises
    ------
    ValueError
        `values` is not (frames, dofs) of finite values with 4 frames or more, or `rate` is not positive.
    """
    values = checked_sequence(values, "values")
    if len(values) < THIRD_DIFFERENCE:
        raise ValueError(f"values have {len(values)} frames; a third difference needs {THIRD_DIFFERENCE}")
    if not (np.isfinite(rate) and rate > 0):
        raise ValueError(f"rate is {rate}; it must be positive, in frames a second")
    changes = np.diff(values.astype(np.float64), n=3, axis=0)
    return float(np.linalg.norm(changes, axis=1).mean() * rate**3)


def _in_one_time(values: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    values, target = checked_pair(values, target)
    if len(values) != len(target):
        raise ValueError(
            f"values have {len(values)} frames and target {len(target)}; warp one into the other's time first"
        )
    return values, target


def _moves(values: FloatArray) -> NDArray[np.bool_]:
    """Tell which columns vary by more than rounding (columns,)."""
    return values.std(axis=0, dtype=np.float64) > rounding_level(values)


def _unit(vectors: FloatArray, name: str) -> FloatArray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if not (np.isfinite(lengths) & (lengths > 0)).all():
        raise ValueError(f"{name} hold a value that is not finite, or a vector of no length")
    return vectors / lengths
