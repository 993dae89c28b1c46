"""Trajectories computed from several sequences, to compare with a reference that is one of them [CoTW 5].

Figure 10 sets the sequence that the similarity index chooses (`reference.py`) beside four trajectories which
no one performed: the mean, the median, the minimum and the maximum of all, frame by frame and DOF by DOF. The
paper judges them by eye, "mean, median and similarity index select the smoothest references, while minimum
and maximum select trajectories with many local extrema"; `roughness` puts a number on that.
"""

from __future__ import annotations

import numpy as np

from motionary.pipeline.alignment.rounding import rounding_level
from motionary.pipeline.alignment.warp import checked_stack
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.motion import FloatArray


def computed_trajectories(clips: FloatArray) -> dict[str, FloatArray]:
    """Compute the mean, median, minimum and maximum trajectory of length-matched sequences.

    Parameters
    ----------
    clips : array (N, frames, dofs)
        Length-matched sequences, such as `uniform` makes them.

    Returns
    -------
    dict of str to array (frames, dofs)
        "mean", "median", "minimum" and "maximum".

    Raises
    ------
    ValueError
        `clips` is not (clips, frames, dofs), is empty, or holds a value that is not finite.
    """
    clips = checked_stack(clips)
    return {
        "mean": clips.mean(axis=0),
        "median": np.median(clips, axis=0),
        "minimum": clips.min(axis=0),
        "maximum": clips.max(axis=0),
    }


def roughness(values: FloatArray, weights: FloatArray | None = None) -> float:
    """Measure how sharply a trajectory turns for how much it moves.

    Per DOF the norm of its second differences over the norm of its first, which grows with the number of
    local extrema and with corners, and changes with neither scale nor offset: 0 for a straight line, about
    2 sin(omega / 2) for a sinusoid of omega rad a frame, at most 2. Lengths must agree where trajectories are
    compared.

    Parameters
    ----------
    values : array (frames, dofs)
        At least 3 frames.
    weights : array (dofs,), optional
        Not negative; 1 each by default.

    Returns
    -------
    float
        Weighted mean over the DOFs that move, 0 where none does. In a DOF that does not, there is nothing to
        turn.

    Raises
    ------
    ValueError
        `values` is not (frames, dofs) with 3 frames or more.
    """
    values = np.asarray(values)
    if values.ndim != 2 or len(values) < 3:
        raise ValueError(f"values have shape {values.shape}; it needs (frames, dofs), 3 frames or more")
    weights = checked_weights(weights, values.shape[1])
    moving = (values.std(axis=0, dtype=np.float64) > rounding_level(values)) & (weights > 0)
    if not moving.any():
        return 0.0
    steps = np.diff(values[:, moving].astype(np.float64), axis=0)
    turns = np.linalg.norm(np.diff(steps, axis=0), axis=0) / np.linalg.norm(steps, axis=0)
    return float(np.average(turns, weights=weights[moving]))
