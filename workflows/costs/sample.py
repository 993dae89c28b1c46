"""Clips that stand for a library: drawn evenly from all of them in the order of their size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from motionary.pipeline.layout import Clip, Layout

_SEED = 0
_MOST = 128
_BATCH = 16


def sample_size(clips: int) -> int:
    """Return how many clips are read to foretell what all take: all 16 of 16, 69 of 300, at most 128."""
    return min(clips, max(1, int(4 * clips**0.5)), _MOST)


def sampled(layout: Layout, sizes: Mapping[str, int]) -> Layout:
    """Draw clips, one from each of as many equal stretches of the library by size.

    What grows with a clip's size so comes out nearer the library's mean than a plain draw would bring it.
    The clips stand in batches that each are such a sample by themselves: the first few will do where the
    time is short.

    Parameters
    ----------
    layout : Layout
        The library.
    sizes : mapping of str to int
        Bytes by clip.

    Returns
    -------
    Layout
        With two sides.
    """
    ranked = sorted(layout, key=lambda clip: (sizes[clip.clip_id], clip.clip_id))
    count = sample_size(len(ranked))
    ends = np.arange(count + 1) * len(ranked) // max(count, 1)
    chosen = [ranked[place] for place in np.random.default_rng(_SEED).integers(ends[:-1], ends[1:])]
    batches = max(1, round(count / _BATCH))
    return in_two_sides([chosen[start::batches] for start in range(batches)])


def in_two_sides(batches: Sequence[Sequence[Clip]]) -> Layout:
    """Lay batches out as a library with two sides, one where there is one batch."""
    in_order = [sorted(batch, key=lambda clip: clip.clip_id) for batch in batches]
    half = (len(in_order) + 1) // 2
    return Layout([side for side in (in_order[:half], in_order[half:]) if side])
