"""The style space and how well it separates labels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.style import StyleSpace, style_accuracy


def test_axes_are_those_of_the_covariance():
    rng = np.random.default_rng(0)
    vectors = rng.normal(size=(30, 6)) * [5, 3, 2, 1, 0.5, 0.1] + 7
    space = StyleSpace.fit(vectors, axes=4)
    values, axes = np.linalg.eigh(np.cov(vectors.T))
    np.testing.assert_allclose(space.explained_variance_ratio, values[::-1][:4] / values.sum())
    agree = np.abs(np.sum(space.axes * axes.T[::-1][:4], axis=1))
    np.testing.assert_allclose(agree, 1)
    np.testing.assert_allclose(space.scores, (vectors - vectors.mean(axis=0)) @ space.axes.T)


@settings(max_examples=50, deadline=None)
@given(clips=st.integers(1, 12), values=st.integers(1, 30), axes=st.integers(1, 10), seed=st.integers(0, 99))
def test_spaces_of_any_shape(clips, values, axes, seed):
    vectors = np.random.default_rng(seed).normal(size=(clips, values))
    space = StyleSpace.fit(vectors, axes)
    kept = min(axes, clips - 1, values)
    assert space.axes.shape == (kept, values)
    assert space.scores.shape == (clips, kept)
    np.testing.assert_allclose(space.axes @ space.axes.T, np.eye(kept), atol=1e-9)
    np.testing.assert_allclose(space.transform(vectors), space.scores, atol=1e-9)
    assert (np.diff(space.explained_variance_ratio) <= 1e-12).all()
    assert space.explained_variance_ratio.sum() <= 1 + 1e-9
    if kept == min(clips - 1, values):
        np.testing.assert_allclose(space.mean + space.scores @ space.axes, vectors, atol=1e-8)
    assert StyleSpace.fit(vectors, axes).axes.tolist() == space.axes.tolist()


def test_one_clip_two_clips_and_equal_clips():
    vector = np.random.default_rng(1).normal(size=40)
    alone = StyleSpace.fit([vector])
    assert (alone.axes.shape, alone.scores.shape, alone.explained_variance_ratio.shape) == (
        (0, 40),
        (1, 0),
        (0,),
    )
    assert alone.transform([vector, 2 * vector]).shape == (2, 0)
    pair = StyleSpace.fit([vector, -vector])
    assert pair.explained_variance_ratio.tolist() == pytest.approx([1.0])
    assert np.abs(pair.scores).ravel().tolist() == pytest.approx([np.linalg.norm(vector)] * 2)
    assert StyleSpace.fit([vector] * 5).scores.shape == (5, 0)
    assert StyleSpace.fit(np.zeros((4, 40))).scores.shape == (4, 0)
    # Two different clips, each thrice: one axis, not five.
    assert StyleSpace.fit([vector, -vector] * 3).axes.shape == (1, 40)


def test_what_a_space_refuses():
    space = StyleSpace.fit(np.random.default_rng(2).normal(size=(5, 8)))
    with pytest.raises(ValueError, match="have 9 values and this space was fitted on 8"):
        space.transform(np.zeros((1, 9)))
    with pytest.raises(ValueError, match=r"shape \(8,\)"):
        space.transform(np.zeros(8))
    with pytest.raises(ValueError, match="vector 1 holds nan at 2"):
        StyleSpace.fit([[1, 2, 3], [1, 2, np.nan]])
    with pytest.raises(ValueError, match="no vector"):
        StyleSpace.fit(np.zeros((0, 3)))
    with pytest.raises(ValueError, match="axes is 0"):
        StyleSpace.fit(np.eye(3), axes=0)


def clips(seed: int, apart: float, bodies: int = 4, styles: int = 3, each: int = 2):
    """Random vectors; styles lie `apart` deviations from each other, and bodies even further."""
    rng = np.random.default_rng(seed)
    style_at, body_at = rng.normal(size=(styles, 30)) * apart, rng.normal(size=(bodies, 30)) * 3
    who, how = np.divmod(np.arange(bodies * styles * each) // each, styles)
    vectors = style_at[how] + body_at[who] + rng.normal(size=(len(who), 30))
    return vectors, [f"style {one}" for one in how], [f"body {one}" for one in who]


def test_styles_that_lie_apart_are_told_apart_and_others_are_not():
    assert style_accuracy(*clips(0, apart=8)) == 1.0
    assert np.mean([style_accuracy(*clips(seed, apart=0)) for seed in range(8)]) == pytest.approx(
        1 / 3, abs=0.12
    )


def test_bodies_are_left_out():
    # Style is a whim of each body: what is learnt of the others says the opposite.
    rng = np.random.default_rng(3)
    sign = np.repeat([1, -1], 20)
    label = np.tile(["calm", "wild"], 20)
    value = np.where(label == "calm", sign, -sign)[:, None] + rng.normal(size=(40, 5)) / 9
    assert style_accuracy(value, label, np.repeat(["one", "other"], 20)) < 0.1


def test_a_style_that_only_one_body_does_is_missed():
    vectors = np.repeat([[0.0], [5.0], [9.0]], [6, 6, 2], axis=0) + np.arange(14)[:, None] / 100
    styles = ["a"] * 6 + ["b"] * 6 + ["c"] * 2
    bodies = ["x", "y"] * 6 + ["x"] * 2
    assert style_accuracy(vectors, styles, bodies) == pytest.approx(12 / 14)


def test_what_cannot_be_cross_validated():
    vectors, styles, bodies = clips(0, 1)
    with pytest.raises(ValueError, match="24 styles and 23 bodies"):
        style_accuracy(vectors, styles, bodies[1:])
    with pytest.raises(ValueError, match="to leave one out there must be two"):
        style_accuracy(vectors, styles, ["x"] * 24)
    with pytest.raises(ValueError, match="without 'x' there are only clips of style"):
        style_accuracy(vectors, ["a"] * 23 + ["b"], ["y"] * 23 + ["x"])
    with pytest.raises(ValueError, match="vector 2 holds inf at 0"):
        style_accuracy([[0], [1], [np.inf], [3]], list("aabb"), list("xyxy"))
