"""Warps that are likely to be worth much: eq. 8 made a sum over segments, and maximised exactly [CoTW 4].

The whole output's correlation is a sum over its frames once the output's norms are taken to be those of the
input, which stretching changes little:

    rho ~ sum over t of A(tau(t), t),    A(u, t) = sum over DOFs i of w_i x_i(u) y_i(t) / (|x_i| |y_i|)

with x the length-matched input, y the reference, both centred, and tau the warp. Stretching segment k from l
to l + eta divides its squared steps by (l + eta) / l, so that to first order

    h ~ sum over k of e_k (l / (l + eta) - 1),    e_k = 1/2 sum over i of w_i (k's share of i's squared steps)

Both are sums over segments; Table 1's recurrence finds the greatest rho - p h for any price p. Since |h| is
p h for a p of -1 .. 1, prices from -alpha to alpha are tried, and eq. 8 itself judges what they lead to. A
has no DOFs left, so all segment lengths together cost little more than one table of correlations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.correlation_tables import table_layout
from motionary.pipeline.alignment.cotw import placed_nodes
from motionary.pipeline.alignment.grid import GridWarp
from motionary.pipeline.alignment.matched import MatchedPair
from motionary.pipeline.alignment.nodes import stretchable
from motionary.pipeline.config import Spacing
from motionary.pipeline.motion import FloatArray

_PRICES = (-1.0, 0.0, 1.0)  # of alpha
_TIE = 1e-12


def likely_warps(
    pair: MatchedPair,
    lengths: Sequence[int],
    least: int,
    alpha: float,
    spacing: Spacing,
    open_ends: bool,
) -> Iterator[GridWarp]:
    """Find for every segment length the warps that maximise the sums, one for each price of distortion.

    Parameters
    ----------
    pair : MatchedPair
    lengths : sequence of int
        L, each at most m / 2.
    least : int
        The least stretched segment, frames.
    alpha : float
        Weight of distortion.
    spacing : {"equal", "boundaries"}
    open_ends : bool
    """
    from motionary.pipeline.alignment.agreement_kernels import add_distortion, fill_agreement
    from motionary.pipeline.alignment.cotw_kernels import best_path, used_slack

    agreement, steepness = _agreement(pair), _steepness(pair)
    for length in lengths:
        nodes = placed_nodes(pair, length, pair.frames // length, spacing)
        segments = stretchable(nodes, length - least, open_ends, least)
        layout = table_layout(segments)
        values = np.zeros(layout.start[-1])
        fill_agreement(
            agreement, nodes, segments.low, segments.high, layout.least_eta, layout.most_eta, layout.start,
            values,
        )  # fmt: skip
        priced = np.empty_like(values)
        of_segments = np.diff(steepness[nodes])
        seen: set[tuple[int, ...]] = set()
        for price in dict.fromkeys(alpha * one for one in _PRICES):
            add_distortion(
                values, layout.start, layout.least_eta, layout.places, nodes, of_segments, price, priced
            )
            moved = np.empty(len(nodes), dtype=np.int64)
            best_path(
                priced, layout.start, layout.least_eta, layout.most_eta, layout.first, layout.places,
                nodes, segments.slacks, segments.low, segments.high, _TIE, moved,
            )  # fmt: skip
            if tuple(moved) not in seen:
                seen.add(tuple(moved))
                yield GridWarp(length, used_slack(nodes, moved), nodes, moved)


def _agreement(pair: MatchedPair) -> FloatArray:
    """Return A (m, m): input frame, reference frame."""
    target = pair.target[: pair.frames]
    moves = pair.source_varies & pair.target_varies
    norms = np.sqrt((pair.source**2).sum(axis=0) * (target**2).sum(axis=0))
    scale = np.divide(pair.weights, norms, out=np.zeros(len(norms)), where=moves) / pair.total_weight
    # Not a product by BLAS, whose threads would meet those of a run.
    return np.einsum("ui,ti->ut", pair.source * scale, target)


def _steepness(pair: MatchedPair) -> NDArray[np.float64]:
    """Return the sum of e over the input's frames up to each (m,)."""
    squares = np.diff(pair.source, axis=0) ** 2
    total = squares.sum(axis=0)
    shares = np.divide(pair.weights, total, out=np.zeros(len(total)), where=pair.source_varies & (total > 0))
    return np.append(0.0, np.cumsum(squares @ shares)) / (2 * pair.total_weight)
