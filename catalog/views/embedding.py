"""A map of clips in two dimensions, from their distances: t-SNE [van der Maaten, Hinton 2008].

A map of many classes cannot keep all distances; it is to keep neighbours together, for whoever looks at a
clip wants to see what is like it. What was tried, on the weighted distance: T is trustworthiness and C
continuity (Venna, Kaski 2001) at k = 10; *same* the share of clips whose nearest on the map has their label,
which in the distances themselves is 1.00 on the embedded library's 80 takes and .87 on 270 real clips of 22
labels.

| method | embedded: T, C, same | real: T, C, same |
|---|---|---|
| t-SNE, perplexity 30, with 80 takes 20 | .97 .97 .99 | .99 .99 .90 |
| isomap, 10 neighbours | .87 .95 .73 | .97 .98 .78 |
| Laplacian eigenmaps, 10 neighbours | .90 .92 .98 | .96 .97 .73 |
| least stress, metric (SMACOF) | .93 .94 .95 | .95 .95 .71 |
| classical scaling | .89 .90 .93 | .86 .92 .58 |
| classical scaling of square roots | .89 .93 .95 | .89 .94 .61 |

Of a large library some clips, the *landmarks*, are laid out, and every other is placed among the three
landmarks nearest to it, a nearer one weighing more: with half of the real clips as landmarks .98 .99 .81. The
rival is landmark scaling (de Silva, Tenenbaum 2004).

`pytest -s tests/test_charts_library.py -k rivals` prints all of this where the real clips are.

What the map does not keep: how far apart groups lie, and how wide they are.

The layout is the same bit for bit on one machine: it starts from classical scaling instead of by chance, and
runs on one thread, for sums of several differ in the last bit. The origin is the mean of the clips that are
laid out, axis x the direction in which they spread most; on each axis the place furthest from 0 is positive,
and the furthest place of all lies at 1.
"""

from __future__ import annotations

from threading import Lock

import numpy as np
from numpy.typing import NDArray

NEIGHBOURS = 3
"""Landmarks that a clip is placed by."""

_PERPLEXITY = 30.0
_FEWEST = 8  # clips that have neighbourhoods to keep; of fewer the start is as good
_ALONE = Lock()
"""The limit on threads is the process's: of two that overlap, the second would put back the first one's."""


def laid_out(distances: NDArray[np.floating]) -> NDArray[np.float64]:
    """Lay clips out such that like ones lie together.

    Parameters
    ----------
    distances : array (N, N)
        Symmetric, 0 on the diagonal. Memory grows with N squared; 1,500 clips take some 6 s.

    Returns
    -------
    array (N, 2)
        Within -1 and 1; all 0 where all distances are.
    """
    from sklearn.manifold import TSNE
    from threadpoolctl import threadpool_limits  # limits what is loaded by then, so that it comes second

    distances = np.asarray(distances, dtype=np.float64)
    if not distances.any():
        return np.zeros((len(distances), 2))
    with _ALONE, threadpool_limits(limits=1):
        places = _with_signs(_scaled(distances))
        if len(distances) < _FEWEST:
            return places
        # The start is as small as scikit-learn's own: a large one holds groups where they begin.
        start = (1e-4 * places / places[:, 0].std()).astype(np.float32)
        perplexity = min(_PERPLEXITY, len(distances) / 4)
        method = TSNE(metric="precomputed", init=start, perplexity=perplexity, n_jobs=1)
        return _with_signs(method.fit_transform(distances).astype(np.float64))


def placed_among(
    landmarks: NDArray[np.float64], nearest: NDArray[np.intp], distances: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Place further clips among those that are laid out.

    Parameters
    ----------
    landmarks : array (M, 2)
        Places from `laid_out`.
    nearest : array (N, k)
        Of each clip, the landmarks nearest to it.
    distances : array (N, k)
        To them.

    Returns
    -------
    array (N, 2)
        The mean of their places, weighted by 1 / distance^2; a clip at distance 0 of one lies on it.
    """
    distances = np.asarray(distances, dtype=np.float64)
    nearest_one = distances.min(axis=1, keepdims=True)
    on_it = nearest_one == 0
    weights = np.where(on_it, distances == 0, (nearest_one / np.where(on_it, 1.0, distances)) ** 2)
    weights = weights / weights.sum(axis=1, keepdims=True)
    return np.einsum("nk,nkc->nc", weights, landmarks[nearest])


def _scaled(distances: NDArray[np.floating]) -> NDArray[np.float64]:
    """Classical scaling [Torgerson 1952]: the two widest axes of the centred squares."""
    from scipy.linalg import eigh

    squares = distances**2
    means = squares.mean(axis=0)
    inner = -0.5 * (squares - means - means[:, None] + means.mean())
    first = max(len(inner) - 2, 0)
    values, vectors = eigh(inner, subset_by_index=[first, len(inner) - 1])
    places = vectors[:, ::-1] * np.sqrt(np.maximum(values[::-1], 0.0))
    return np.pad(places, ((0, 0), (0, 2 - places.shape[1])))


def _with_signs(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn places to their principal axes, and give these their signs and the whole its size."""
    places = places - places.mean(axis=0)
    _, _, axes = np.linalg.svd(places, full_matrices=False)
    places = places @ axes.T if len(places) > 1 else places
    furthest = np.take_along_axis(places, np.abs(places).argmax(axis=0)[None], axis=0)
    places = places * np.where(furthest < 0, -1.0, 1.0)
    return places / (np.linalg.norm(places, axis=1).max() or 1.0)
