"""Inputs that hypothesis draws for the tests of distances."""

import numpy as np
from hypothesis import strategies as st


@st.composite
def costs(draw, longest=7, kinds=("ties", "continuous")):
    """Cost matrices: of a few whole numbers, so that totals often tie, or of any magnitude."""
    m, n = draw(st.integers(1, longest)), draw(st.integers(1, longest))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if draw(st.sampled_from(kinds)) == "ties":
        return rng.integers(0, draw(st.integers(1, 5)), size=(m, n)).astype(np.float64)
    return rng.random((m, n)) * 10.0 ** draw(st.integers(-6, 6))


@st.composite
def clip_lists(draw, most=5, longest=20):
    """Float32 clips of one dimension count and different lengths; some are repeated, or nearly."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    d = draw(st.integers(1, 70))
    lengths = draw(st.lists(st.integers(1, longest), min_size=1, max_size=most))
    clips = [np.cumsum(rng.normal(size=(length, d)), axis=0).astype(np.float32) for length in lengths]
    if draw(st.booleans()):
        clips.append(clips[0] + np.float32(1e-6))
        clips.append(clips[0].copy())
    return clips
