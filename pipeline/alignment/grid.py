"""Every segment length and slack: the warps among which a search chooses [CoTW 4].

For one L the correlations of segments are computed once, for the largest slack, and one table of the
reference's deviations serves all L.

A slack that no segment uses up changes nothing: where the best warp within delta stretches no segment by
more than e < delta frames, it is the best within e .. delta as well, and the next slack to try is e - 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.correlation_tables import correlation_tables, reference_deviations
from motionary.pipeline.alignment.cotw import best_moves, placed_nodes
from motionary.pipeline.alignment.matched import MatchedPair
from motionary.pipeline.alignment.nodes import stretchable
from motionary.pipeline.config import Spacing


@dataclass(frozen=True, eq=False)
class GridWarp:
    """The best warp of one segment length within one slack, the least slack that has it.

    Parameters
    ----------
    segment_length, slack : int
    nodes, moved : array (c + 1,)
        Nodes in length-matched time and in the output.
    """

    segment_length: int
    slack: int
    nodes: NDArray[np.int64]
    moved: NDArray[np.int64]


def all_warps(
    pair: MatchedPair, lengths: Sequence[int], least: int, spacing: Spacing, open_ends: bool
) -> Iterator[GridWarp]:
    """Find the best warp of every slack of some segment lengths, those that are the same once.

    Parameters
    ----------
    pair : MatchedPair
    lengths : sequence of int
        L, each at most m / 2.
    least : int
        The least stretched segment, frames; slacks are 1 .. L - least.
    spacing : {"equal", "boundaries"}
    open_ends : bool
    """
    from motionary.pipeline.alignment.cotw_kernels import used_slack

    if not lengths:
        return
    # The last segment may become a frame shorter: see `nodes.stretchable`.
    deviations = reference_deviations(pair, max(least - 1, 1), pair.frames - 1)
    for length in lengths:
        nodes = placed_nodes(pair, length, pair.frames // length, spacing)
        slack = length - least
        tables = correlation_tables(pair, stretchable(nodes, slack, open_ends, least), deviations)
        while slack >= 1:
            moved = best_moves(tables, stretchable(nodes, slack, open_ends, least), pair.total_weight)
            slack = used_slack(nodes, moved)
            yield GridWarp(length, slack, nodes, moved)
            slack -= 1
