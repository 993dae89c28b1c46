"""Inputs that hypothesis draws for the tests of distances.

Whole numbers times a power of two keep every total exact, so that ties are ties for product and reference.
"""

import numpy as np
from hypothesis import strategies as st

SEEDS = st.integers(0, 2**32 - 1)
# Powers of two: costs from about 1e-270 to 1e150, and those that need no scaling most of the time.
SCALES = st.one_of(st.just(0), st.integers(-900, 490)).map(lambda power: 2.0**power)


@st.composite
def costs(draw, longest=7, kinds=("ties", "constant", "continuous")):
    """Cost matrices: of a few whole numbers, so that totals often tie, of one value, or of any; 1 x n too."""
    m, n = draw(st.integers(1, longest)), draw(st.integers(1, longest))
    rng = np.random.default_rng(draw(SEEDS))
    kind = draw(st.sampled_from(kinds))
    if kind == "ties":
        cost = rng.integers(0, draw(st.integers(2, 5)), size=(m, n)).astype(np.float64)
    elif kind == "constant":
        cost = np.full((m, n), draw(st.sampled_from([0.0, 1.0, 3.0])))
    else:
        cost = rng.random((m, n))
    return cost * draw(SCALES)


@st.composite
def zoned_costs(draw, longest=24):
    """Low costs, 0 to 4, in many separate places among high ones, 20 to 24: dozens of zones."""
    m, n = draw(st.integers(longest // 3, longest)), draw(st.integers(longest // 3, longest))
    rng = np.random.default_rng(draw(SEEDS))
    pattern = draw(st.sampled_from([scattered, checkerboard, stairs, rectangles, crossed_blocks]))
    low = pattern(m, n, rng)
    low = low[:, ::-1] if draw(st.booleans()) else low
    values = rng.integers(0, 5, size=(m, n)) if draw(st.booleans()) else 4 * rng.random((m, n))
    return np.where(low, values, 20.0 + values) * draw(SCALES)


def scattered(m, n, rng):
    """Single cells, most of them alone."""
    return rng.random((m, n)) < rng.choice([0.05, 0.15, 0.3])


def checkerboard(m, n, rng):
    """Blocks that touch no other, or each the next by a corner; some are left out."""
    high, wide = rng.integers(1, 4, size=2)
    i, j = np.arange(m)[:, None], np.arange(n)
    if rng.integers(2):
        blocks = (i // high + j // wide) % 2 == 0
    else:
        blocks = (i % (high + 1) < high) & (j % (wide + 1) < wide)
    kept = rng.random((m, n)) < 0.8
    return blocks & kept[i // (high + 1), j // (wide + 1)]


def stairs(m, n, rng):
    """Flights of steps, each sharing one row with the next and no column: one row segment, or transposed."""
    low = np.zeros((max(m, n), max(m, n)), dtype=bool)
    rise, run = rng.integers(1, 4, size=2)
    for step in range(max(m, n)):
        low[step * rise : (step + 1) * rise + 1, step * (run + 1) : step * (run + 1) + run] = True
    low &= ~low.T if rng.integers(2) else True
    return (low if rng.integers(2) else low.T)[:m, :n]


def rectangles(m, n, rng):
    """Overlapping and nested outlines, whose rectangles hold other zones."""
    low = np.zeros((m, n), dtype=bool)
    for _ in range(rng.integers(2, max(3, m * n // 40))):
        top, left = rng.integers(m), rng.integers(n)
        bottom, right = rng.integers(top, min(m, top + 5)), rng.integers(left, min(n, left + 5))
        low[[top, bottom], left : right + 1] = True
        low[top : bottom + 1, [left, right]] = True
    return low


def crossed_blocks(m, n, rng):
    """Blocks on the diagonal, crossed by bands that join some of them."""
    side = rng.integers(1, 4)
    low = np.arange(m)[:, None] // side == np.arange(n) // side
    low &= (np.arange(m)[:, None] % side < max(1, side - 1)) & (np.arange(n) % side < max(1, side - 1))
    low[rng.integers(m), rng.integers(n) :] = True
    low[rng.integers(m) :, rng.integers(n)] = True
    return low


@st.composite
def frame_pairs(draw, longest=12, dtypes=(np.float32, np.float64)):
    """Two clips, near the origin or far from it; some frames are repeated, or nearly."""
    rng = np.random.default_rng(draw(SEEDS))
    m, n, d = draw(st.integers(1, longest)), draw(st.integers(1, longest)), draw(st.integers(1, 130))
    offset, scale = draw(st.sampled_from([0.0, 1.0, 30.0, 1e4])), 10.0 ** draw(st.integers(-6, 6))
    a, b = rng.normal(size=(m, d)) + offset, rng.normal(size=(n, d)) + offset
    for near in (0.0, 1e-6, 1e-3, 0.02):
        b[rng.integers(n)] = a[rng.integers(m)] * (1 + near * rng.normal(size=d))
    dtype = draw(st.sampled_from(dtypes))
    return (a * scale).astype(dtype), (b * scale).astype(dtype)


@st.composite
def clip_lists(draw, most=5, longest=20, dtypes=(np.float32,)):
    """Clips of one dimension count, of equal or very different lengths; some are repeated, or nearly."""
    rng = np.random.default_rng(draw(SEEDS))
    d = draw(st.integers(1, 130))
    lengths = draw(st.lists(st.sampled_from([1, 1, 2, *range(3, longest + 1)]), min_size=1, max_size=most))
    scales = 10.0 ** rng.integers(-2, 3, size=most)
    clips = [scales[k] * np.cumsum(rng.normal(size=(f, d)), axis=0) for k, f in enumerate(lengths)]
    if draw(st.booleans()):
        clips += [clips[0] + 1e-6, clips[0].copy()]
    if draw(st.booleans()):
        clips.append(rng.normal(size=(draw(st.integers(100, 400)), d)))
    dtype = draw(st.sampled_from(dtypes))
    return [clip.astype(dtype) for clip in draw(st.permutations(clips))]
