"""Figures of the player: places, packing, warps, residuals, and the HTML around them."""

import base64
import html
import json
import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.views.assets import asset
from motionary.catalog.views.colours import COLOURS
from motionary.catalog.views.figure_body import body_size
from motionary.catalog.views.figure_data import packed
from motionary.catalog.views.figures import clip_figure, figure_of, scene
from motionary.catalog.views.player import Player, play, play_clips, player_html, player_script
from motionary.pipeline.alignment import Warp
from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.features import sample_times
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.style import residual, standing_toes
from motionary.pipeline.synthetic import template
from tests.style.figures import moved

NASTY = "</script><script>alert(1)</script>\"'<b>&\u202e"


@pytest.fixture(scope="module")
def demo(demo_catalog):
    return Catalog.open(demo_catalog)


def unpacked(stream, shape):
    """Read what `packed` writes, a value at a time."""
    left = stream.tolist()
    rows = np.zeros((shape[0], int(np.prod(shape[1:]))), int)
    for frame in range(len(rows)):
        for column in range(rows.shape[1]):
            byte = left.pop(0)
            if byte == 128:
                turn = int.from_bytes(bytes(left.pop(0) for _ in range(4)), "little", signed=True)
            else:
                turn = byte - 256 if byte > 128 else byte
            last = rows[frame - 1, column] if frame else 0
            step = last - rows[frame - 2, column] if frame > 1 else 0
            rows[frame, column] = last + step + turn
    assert left == []
    return rows.reshape(shape)


def read_text(text, dtype):
    return np.frombuffer(base64.b64decode(text), dtype)


def by_hand(made):
    """Read a figure's JSON as the player does."""
    values = unpacked(read_text(made["positions"], np.uint8), (made["frames"], len(made["joints"]), 3))
    return np.array(made["origin"]) + made["scale"] * values


@given(arrays(np.int16, array_shapes(min_dims=3, max_dims=3, max_side=5)))
@example(np.full((3, 1, 3), -32768, np.int16))
@example(np.array([[[-32768, 32767, 0]], [[32767, -32768, 127]], [[-32768, 32767, -1]]], np.int16))
def test_packed_values_are_read_again(values):
    np.testing.assert_array_equal(unpacked(packed(values), values.shape), values)


@given(
    seed=st.integers(0, 99),
    frames=st.sampled_from([1, 2, 3, 17]),
    joints=st.integers(1, 6),
    unit=st.sampled_from([1e-9, 0.01, 1.0, 100.0, 1e7]),
    away=st.sampled_from([0.0, 1.0, 1e4]),
    fps=st.sampled_from([10.0, 24.0, 30.0, 59.94, 120.0]),
    markers=st.booleans(),
)
def test_places_are_those_of_the_motion(seed, frames, joints, unit, away, fps, markers):
    rng = np.random.default_rng(seed)
    parents = (-1, *(int(rng.integers(joint)) for joint in range(1, joints)))
    skeleton = Skeleton(tuple(map(str, range(joints))), parents, unit * rng.normal(size=(joints, 3)))
    places = unit * rng.normal(size=(frames, joints, 3))
    places[:, 0] = 0
    turned = rng.normal(size=(frames, 0 if markers else joints, 4))
    root = unit * (away + rng.normal(size=(frames, 3)))
    motion = Motion("m", skeleton, fps, root, turned, places=places if markers else None)

    made = json.loads(json.dumps(figure_of(motion).to_dict()))

    assert made["fps"] == min(fps, 30)
    times = sample_times(frames, fps, made["fps"])
    true = motion.sampled(times).positions()
    assert made["frames"] == len(times)
    np.testing.assert_allclose(by_hand(made), true, rtol=0, atol=0.5001 * made["scale"])
    span = np.ptp(true, axis=(0, 1)).max()
    assert made["scale"] <= max(2e-4 * made["size"], 1.0001 * span / 65534)
    assert made["floor"] == pytest.approx(true[..., 1].min(), rel=1e-12, abs=1e-12 * made["size"])


def test_places_of_frames_are_kept_at_a_rate_below_thirty():
    motion = replace(template("walk"), fps=24.0)
    figure = figure_of(motion)
    assert (figure.fps, figure.frames) == (24, motion.frames)
    assert figure.seconds == pytest.approx(motion.seconds)


def test_size_is_the_longest_chain():
    offsets = np.array([[9, 9, 9], [0, 2, 0], [3, 0, 4], [0, 0, -1]], float)
    assert body_size(Skeleton(("a", "b", "c", "d"), (-1, 0, 1, 0), offsets)) == 7.0


def test_point_has_a_size():
    motion = Motion("m", Skeleton(("a",), (-1,), np.zeros((1, 3))), 30, np.zeros((1, 3)), [[[0, 0, 0, 1]]])
    figure = figure_of(motion)
    assert figure.size == 1.0
    assert figure.positions().tolist() == [[[0, 0, 0]]]
    json.dumps(scene([figure]), allow_nan=False)


@pytest.mark.parametrize("turn", [0.0, 1.0, -2.5])
def test_turn_is_where_the_first_frame_faces(turn):
    still = figure_of(template("walk")).turn
    turned = figure_of(moved(template("walk"), turn, (3, 0, 4))).turn
    assert np.exp(1j * (turned - still)) == pytest.approx(np.exp(1j * turn))


def test_only_some_joints_hang_from_the_nearest_kept_one():
    names = ("a", "b", "c", "d", "e")
    offsets = np.arange(15.0).reshape(5, 3)
    motion = Motion(
        "m", Skeleton(names, (-1, 0, 1, 2, 1), offsets), 30, np.zeros((2, 3)), [[[0, 0, 0, 1]] * 5] * 2
    )
    figure = figure_of(motion, joints=["d", "a", "e", "c"])
    assert figure.joints == ("a", "c", "d", "e")
    assert figure.parents == (-1, 0, 1, 0)
    np.testing.assert_allclose(
        figure.positions(), motion.positions()[:, [0, 2, 3, 4]], atol=0.51 * figure.scale
    )
    with pytest.raises(KeyError, match="no joint 'x'"):
        figure_of(motion, joints=["x"])


def test_slim_figure_has_the_canonical_joints(demo):
    clip_id = demo.clips.to_arrow()["clip_id"][0].as_py()
    whole, slim = clip_figure(demo, clip_id), clip_figure(demo, clip_id, slim=True)
    assert set(slim.body) == set(CANONICAL_JOINTS)
    kept = [whole.joints.index(name) for name in slim.joints]
    np.testing.assert_array_equal(slim.positions(), whole.positions()[:, kept])
    np.testing.assert_array_equal(slim.residual, whole.residual[:, kept])
    assert [slim.joints[joint] for joint in slim.contacts] == [
        whole.joints[joint] for joint in whole.contacts
    ]


def test_clip_is_shown_aligned_as_the_catalog_has_it(demo):
    rows = demo.sql("select clip_id, reference_id from alignments where clip_id <> reference_id").to_pylist()
    for row in rows[::20]:
        figure = clip_figure(demo, row["clip_id"])
        assert figure.reference == row["reference_id"]
        aligned = demo.aligned(row["clip_id"]).positions()
        places = figure.warp_times * figure.fps
        before = np.minimum(places.astype(int), figure.frames - 2)
        share = (places - before)[:, None, None]
        shown = figure.positions()
        shown = (1 - share) * shown[before] + share * shown[before + 1]
        # Between two frames the player goes straight and a motion turns.
        np.testing.assert_allclose(shown, aligned, atol=0.015 * figure.size)


def test_residual_is_that_of_the_poses(demo):
    sql = "select clip_id, reference_id from alignments where clip_id <> reference_id limit 1"
    row = demo.sql(sql).to_pylist()[0]
    figure = clip_figure(demo, row["clip_id"])
    pose = residual(demo.aligned(row["clip_id"]), demo.aligned(row["reference_id"]), "pose")
    distance = np.linalg.norm(pose.joints, axis=2)
    shares = figure.residual[:, [figure.body[joint] for joint in CANONICAL_JOINTS]]
    own = shares * figure.residual_max / 255
    # That one turns to the heading after it is warped, this one before.
    np.testing.assert_allclose(own, distance, atol=0.02)
    assert clip_figure(demo, row["reference_id"]).residual_max < 1e-6


def test_residual_is_read_again():
    motion = template("walk")
    warp = Warp(np.linspace(0, motion.frames - 1, 12), motion.frames)
    values = np.random.default_rng(0).uniform(0, 0.7, (12, len(motion.skeleton.names)))
    values[:, 5] = values[:, 4]
    made = figure_of(motion, warp=warp, residual=values).to_dict()["residual"]
    shares = read_text(made["values"], np.uint8).reshape(12, -1)
    assert shares.shape[1] == values.shape[1] - 1
    np.testing.assert_allclose(shares[:, made["column"]] * made["max"] / 255, values, atol=made["max"] / 509)


def test_residual_needs_its_warp():
    motion = template("walk")
    with pytest.raises(ValueError, match=r"residual has shape \(3, 4\)"):
        figure_of(motion, residual=np.zeros((3, 4)))


def test_toes_stand_as_the_pipeline_says():
    walk = figure_of(template("walk"))
    assert [walk.joints[joint] for joint in walk.contacts] == [
        walk.joints[walk.body[f"{side}_toe"]] for side in ("left", "right")
    ]
    left, right = walk.contacts.values()
    np.testing.assert_array_equal(np.stack([left, right], axis=1), standing_toes(template("walk")))
    assert 0.3 < left.mean() < 0.95
    assert (left | right).mean() > 0.8
    assert not (left & right).all()
    made = walk.to_dict()["contacts"]
    bits = np.unpackbits(read_text(made["bits"], np.uint8), bitorder="little")[: 2 * walk.frames]
    np.testing.assert_array_equal(bits.reshape(-1, 2), np.stack([left, right], axis=1))


def test_unknown_rig_is_a_figure():
    skeleton = Skeleton(("hub", "spoke"), (-1, 0), np.eye(2, 3))
    made = figure_of(Motion("m", skeleton, 30, np.zeros((4, 3)), [[[0, 0, 0, 1]] * 2] * 4)).to_dict()
    assert made["body"] == {}
    assert "contacts" not in made


def test_figure_without_legs_stands_nowhere():
    walk = template("walk")
    skeleton = replace(walk.skeleton, offsets=np.zeros_like(walk.skeleton.offsets))
    figure = figure_of(replace(walk, skeleton=skeleton))
    assert figure.body
    assert figure.contacts == {}


def test_scene_needs_a_figure():
    with pytest.raises(ValueError, match="no figure is given"):
        scene([])


def test_no_such_clip(demo):
    with pytest.raises(CatalogError, match="no clip 'nowhere'"):
        clip_figure(demo, "nowhere")


@pytest.mark.parametrize(
    "file",
    [
        "bandai/dataset-1_dance-short_normal_001.bvh",
        "hdm05/HDM_dg_jogLeftCircle4StepsRstart_010_120.amc",
        "cmu/006_14.bvh",
    ],
)
def test_ten_seconds_of_a_real_clip_are_tens_of_kilobytes(shared_data, file):
    figure = figure_of(read_motion(shared_data / file))
    text = json.dumps(figure.to_dict())
    limit = 99e3 if len(figure.joints) <= 40 else 160e3
    assert len(text) * 10 / figure.seconds < limit


def test_page_holds_names_as_text():
    shown = scene([figure_of(template("walk"), name=NASTY)])
    made = player_html(shown, name='a"b')
    assert made.count("<script") == 1
    assert made.count("</script>") == 1
    assert 'id="a&quot;b"' in made
    text = re.search(r'<script type="application/json"[^>]*>(.*)</script>', made, re.DOTALL).group(1)
    assert json.loads(text) == shown


def test_script_is_one_module_that_fetches_nothing():
    script = asset("player.js")
    assert "</" + "script" not in script.lower()
    assert "http" not in script
    assert not re.search(r"^\s*import\b|\bimport\(", script, re.MULTILINE)
    assert player_script().count("<script") == 1


def test_script_has_the_colours_of_the_charts():
    (listed,) = re.findall(r"const COLOURS = (\[.*?\]);", asset("player.js"))
    assert tuple(json.loads(listed)) == COLOURS


def test_notebook_shows_a_widget_and_a_page(demo):
    ids = demo.clips.to_arrow()["clip_id"].to_pylist()[:2]
    shown = play_clips(demo, *ids, layout="overlaid", aligned=True, trails=["left_wrist"])
    bundle = shown._repr_mimebundle_()
    assert bundle["text/plain"] == f"<Player of {ids[0]}, {ids[1]}>"
    assert "application/vnd.jupyter.widget-view+json" in bundle
    page = html.unescape(re.search(r'srcdoc="([^"]*)"', bundle["text/html"]).group(1))
    assert page == shown.page()
    assert "export function createPlayer" in page
    widget = shown.widget()
    assert widget is shown.widget()
    assert widget.scene == shown.scene
    assert (shown.scene["layout"], shown.scene["aligned"], shown.scene["trails"]) == (
        "overlaid",
        True,
        ["left_wrist"],
    )


def test_notebook_without_anywidget_shows_the_page(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    bundle = play(template("walk"))._repr_mimebundle_()
    assert set(bundle) == {"text/plain", "text/html"}


def test_title_of_a_hostile_motion_is_text():
    made = Player(scene([figure_of(template("walk"), name=NASTY)])).page()
    assert "<script>alert" not in made
