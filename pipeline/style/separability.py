"""How well styles are told apart: labels predicted from residuals, for bodies never seen.

Every body is left out once and the styles of its clips are predicted from all other bodies' clips, so a
classifier cannot win by knowing people. It is plain on purpose: each value in units of its deviation, the
first 20 principal components, logistic regression.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

_COMPONENTS = 20


def style_accuracy(vectors: ArrayLike, styles: Sequence[str], bodies: Sequence[str]) -> float:
    """Predict styles from residuals, leaving one body out at a time.

    Parameters
    ----------
    vectors : array (n, d)
        `Residual.vector` of each clip, all against one reference, or any vectors of one length.
    styles, bodies : sequence of n str
        How, and by whom.

    Returns
    -------
    float
        Share of the n clips whose style is predicted, 0 .. 1. A style that only the left-out body does
        counts as missed.

    Raises
    ------
    ValueError
        Lengths disagree, a value is not finite, there is one body only, or a body's clips are all that there
        are of every style but one.
    """
    rows, labels, groups = np.asarray(vectors, dtype=np.float64), np.asarray(styles), np.asarray(bodies)
    if rows.ndim != 2 or not len(rows) == len(labels) == len(groups):
        raise ValueError(
            f"vectors have shape {rows.shape}, and there are {len(labels)} styles and {len(groups)} bodies; "
            "it needs (clips, values) and one style and body a clip"
        )
    if not np.isfinite(rows).all():
        clip, value = np.argwhere(~np.isfinite(rows))[0]
        raise ValueError(f"vector {clip} holds {rows[clip, value]} at {value}; values must be finite")
    names = np.unique(groups)
    if len(names) < 2:
        raise ValueError(f"bodies are {names.tolist()}; to leave one out there must be two")
    for body in names.tolist():
        known = np.unique(labels[groups != body])
        if len(known) < 2:
            raise ValueError(
                f"without {body!r} there are only clips of style {known.tolist()}; it needs two styles"
            )
    return _cross_validated(rows, labels, groups)


def _cross_validated(rows: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> float:
    from sklearn.decomposition import PCA
    from sklearn.linear_model import LogisticRegression
    from sklearn.model_selection import LeaveOneGroupOut
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    right = 0
    for seen, left_out in LeaveOneGroupOut().split(rows, labels, groups):
        components = min(_COMPONENTS, len(seen), rows.shape[1])
        classifier = make_pipeline(
            StandardScaler(), PCA(components, svd_solver="full"), LogisticRegression(max_iter=1000)
        )
        classifier.fit(rows[seen], labels[seen])
        right += int(np.sum(classifier.predict(rows[left_out]) == labels[left_out]))
    return right / len(rows)
