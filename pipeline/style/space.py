"""The style space of a cluster: the principal axes of its clips' residuals.

Principal component analysis (Pearson 1901) by the singular values of the centred vectors. The vectors are not
divided by their deviations: a joint that hardly moves does not count as much as one that does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionary.pipeline.motion import FloatArray

_NO_VARIANCE = 1e-10  # of the vectors' mean square: what rounding leaves of equal vectors is far below


@dataclass(frozen=True, eq=False)
class StyleSpace:
    """Axes along which the clips of a cluster differ, r of them, the widest first.

    Parameters
    ----------
    mean : array (d,)
        The mean vector, the space's origin.
    axes : array (r, d)
        Orthonormal.
    explained_variance_ratio : array (r,)
        The share of all variance along each axis, falling.
    scores : array (n, r)
        Where the clips that it was fitted on lie.
    """

    mean: FloatArray
    axes: FloatArray
    explained_variance_ratio: FloatArray
    scores: FloatArray

    @classmethod
    def fit(cls, vectors: ArrayLike, axes: int = 8) -> StyleSpace:
        """Find the axes of a cluster.

        Parameters
        ----------
        vectors : array (n, d)
            `Residual.vector` of each clip, all of one kind and number of stretches.
        axes : int
            The most to keep.

        Returns
        -------
        StyleSpace
            r is the least of `axes`, n - 1 and d, less the axes along which nothing varies: one clip, or
            several equal ones, give a space of no axes, two different clips one of ratio 1.

        Raises
        ------
        ValueError
            There is no vector, shapes disagree, a value is not finite, or `axes` is below 1.
        """
        rows = _checked(vectors)
        if not len(rows):
            raise ValueError("there is no vector to fit a style space on")
        if axes < 1:
            raise ValueError(f"axes is {axes}; a style space keeps at least 1 where there is one")
        mean = rows.mean(axis=0)
        most = min(axes, len(rows) - 1, rows.shape[1])
        if most < 1:
            return cls(mean, np.zeros((0, rows.shape[1])), np.zeros(0), np.zeros((len(rows), 0)))
        return cls._analysed(rows, mean, most)

    @classmethod
    def _analysed(cls, rows: FloatArray, mean: FloatArray, most: int) -> StyleSpace:
        if np.mean((rows - mean) ** 2) <= _NO_VARIANCE * np.mean(rows**2):
            return cls(mean, np.zeros((0, rows.shape[1])), np.zeros(0), np.zeros((len(rows), 0)))
        # Not scikit-learn's PCA, which is this: importing it takes longer than a night's few new clips.
        _, deviations, axes = np.linalg.svd(rows - mean, full_matrices=False)
        ratio = (deviations**2 / np.sum(deviations**2))[:most]
        kept = ratio > _NO_VARIANCE
        axes = _pointing_forwards(axes[:most][kept])
        return cls(mean, axes, ratio[kept], (rows - mean) @ axes.T)

    def transform(self, vectors: ArrayLike) -> FloatArray:
        """Find where other clips lie.

        Parameters
        ----------
        vectors : array (k, d)
            As for `fit`.

        Returns
        -------
        array (k, r)

        Raises
        ------
        ValueError
            Shapes disagree or a value is not finite.
        """
        rows = _checked(vectors)
        if rows.shape[1] != len(self.mean):
            raise ValueError(
                f"vectors have {rows.shape[1]} values and this space was fitted on {len(self.mean)}: "
                "take residuals of one kind, rig and number of stretches"
            )
        return (rows - self.mean) @ self.axes.T


def _pointing_forwards(axes: FloatArray) -> FloatArray:
    """Choose of each axis and its opposite the one whose largest value is positive."""
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=1)[:, None], axis=1)
    return axes * np.sign(largest)


def _checked(vectors: ArrayLike) -> FloatArray:
    rows = np.asarray(vectors, dtype=np.float64)
    if rows.ndim != 2:
        raise ValueError(f"vectors have shape {rows.shape}; it needs (clips, values)")
    if not np.isfinite(rows).all():
        clip, value = np.argwhere(~np.isfinite(rows))[0]
        raise ValueError(f"vector {clip} holds {rows[clip, value]} at {value}; values must be finite")
    return rows
