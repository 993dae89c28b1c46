"""`motionary align`: scores of any two motions by any method, and the page that shows them."""

import json
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from motionary.catalog import Catalog
from motionary.catalog.views import alignment_chart
from motionary.catalog.views.aligned_pair import STRETCHED, AlignedPair, Take
from motionary.catalog.views.alignment_chart import warps_figure
from motionary.catalog.views.alignment_page import alignment_page
from motionary.catalog.views.alignment_ways import liveliest_ways, ways_figure
from motionary.pipeline.alignment import adaptive_dtw, cotw_search, dtw, roughness, uniform
from motionary.pipeline.alignment.postures import linearised_postures, posture_weights
from motionary.pipeline.alignment.registry import ALIGNERS, Aligner
from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.distances import cost_matrix
from motionary.pipeline.motion import Motion
from motionary.pipeline.synthetic import template
from motionary.pipeline.writers import write_bvh
from motionary.workflows import align_pair
from motionary.workflows.align_pair import SCORES, read_pair
from motionary.workflows.commands.align import METHODS

# One skeleton convention, and the other.
WALK, TIRED, OTHER = (
    "walk/walk_neutral_alex_01.bvh",
    "walk/walk_tired_alex_01.bvh",
    "walk/walk_sneaky_emil_01.bvh",
)


@pytest.fixture
def pair(demo_catalog) -> AlignedPair:
    with Catalog.open(demo_catalog) as catalog:
        read = read_pair(WALK, TIRED, catalog)
    moving, reference = read.moving.pose, read.reference.pose
    return replace(read, warps={"DTW": dtw(moving, reference), "CoTW": cotw_search(moving, reference)})


@pytest.fixture
def scores(motionary):
    """Return a way of asking for scores, by method."""

    def ask(*arguments: object) -> dict[str, dict]:
        code, printed, _ = motionary("align", *arguments, "--format", "json")
        assert code == 0
        return {row["method"]: row for row in json.loads(printed)}

    return ask


def test_the_names_that_help_lists_are_those_of_the_registry():
    assert {name: one.title for name, one in ALIGNERS.items()} == METHODS
    assert list(METHODS) == list(ALIGNERS)


def test_a_method_may_be_called_as_its_paper_or_its_function_calls_it(scores, demo_catalog):
    asked = ("--method", "DDTW", "--method", "canonical_time_warping", "--method", "Online A")
    found = scores(demo_catalog, TIRED, WALK, *asked)
    assert list(found) == ["uniform", "derivative-dtw", "canonical-time-warping", "online-a"]


def test_scores_are_those_of_the_warps(scores, pair, demo_catalog):
    found = scores(demo_catalog, WALK, TIRED, "--method", "cotw", "--method", "dtw")
    assert list(found) == ["uniform", "cotw", "dtw"]
    moving, reference = pair.moving.pose, pair.reference.pose
    plain = dtw(moving, reference).source_time
    for name, warp in {
        "uniform": pair.stretched,
        "dtw": pair.warps["DTW"],
        "cotw": pair.warps["CoTW"],
    }.items():
        warped = warp.apply(moving)
        row = found[name]
        distances = [np.sqrt(((warped[k] - reference[k]) ** 2).sum()) for k in range(len(reference))]
        assert row["distance"] == pytest.approx(np.mean(distances), rel=1e-5)
        assert row["from_dtw"] == pytest.approx(np.abs(warp.source_time - plain).mean() / 30)
        moves = [k for k in range(57) if np.ptp(moving[:, k]) or np.ptp(reference[:, k])]
        with np.errstate(invalid="ignore"):
            each = [np.corrcoef(warped[:, k], reference[:, k])[0, 1] for k in moves]
        assert row["correlation"] == pytest.approx(np.nan_to_num(each).mean(), abs=1e-5)
        assert row["roughness"] == pytest.approx(roughness(warped))
        held = [0]
        for earlier, later in pairwise(warp.source_time.round(6)):
            held.append(held[-1] + 1 if earlier == later else 0)
        assert row["longest_still"] == pytest.approx(max(held) / 30)
        leaps = [later - earlier for earlier, later in pairwise(warp.source_time)]
        assert row["longest_leap"] == pytest.approx(max(leaps) / 30)
    assert found["cotw"]["correlation"] >= found["uniform"]["correlation"]
    assert found["dtw"]["from_dtw"] == 0


def test_what_reads_postures_is_given_them_weighted_by_limb(pair):
    made = align_pair.align_pair(replace(pair, warps={}), ["adaptive-dtw"])
    motions = pair.moving.motion, pair.reference.motion
    postures = linearised_postures(*motions, 30.0)
    expected = adaptive_dtw(*postures, posture_weights(motions[1].skeleton))
    found = made.pair.warps[ALIGNERS["adaptive-dtw"].title]
    np.testing.assert_array_equal(found.path, expected.path)
    assert not np.array_equal(adaptive_dtw(*postures).path, expected.path)


def test_the_seconds_are_those_of_the_method_alone(pair, monkeypatch):
    clock = [100.0]

    def slow(moving, reference):
        clock[0] += 3.0
        return uniform(moving, reference)

    monkeypatch.setattr(align_pair, "perf_counter", lambda: clock[0])
    register(monkeypatch, Aligner("slow", "Slow", "none", "features", slow))
    rows = align_pair.align_pair(pair, ["slow"]).scores.to_pylist()
    assert [(row["method"], row["seconds"]) for row in rows] == [("uniform", 0.0), ("slow", 3.0)]


def test_a_clip_is_itself_in_its_own_time(scores, demo_catalog):
    for row in scores(demo_catalog, WALK, WALK, "--method", "dtw").values():
        assert row["correlation"] == pytest.approx(1)
        assert (row["distance"], row["from_dtw"], row["longest_still"]) == (0, 0, 0)


def test_files_and_clips_score_alike(scores, demo_catalog, demo_library):
    asked = [scores(demo_library / WALK, demo_library / OTHER), scores(demo_catalog, WALK, OTHER)]
    asked.append(scores(demo_catalog, demo_library / WALK, OTHER))
    for name in ("uniform", "cotw"):
        for column in ("correlation", "distance", "from_dtw", "roughness"):
            of_files, *others = (one[name][column] for one in asked)
            assert others == pytest.approx([of_files] * 2, rel=1e-5)


def test_a_still_figure_is_told(tmp_path, scores):
    walk = template("walk")
    frames = [*range(20), *[20] * 15, *range(20, 40)]
    write_bvh(shown(walk, list(range(40))), tmp_path / "plain.bvh")
    write_bvh(shown(walk, frames), tmp_path / "halting.bvh")
    found = scores(tmp_path / "plain.bvh", tmp_path / "halting.bvh", "--method", "dtw")
    assert found["dtw"]["longest_still"] == pytest.approx(15 / walk.fps, abs=0.04)
    assert found["uniform"]["longest_still"] == 0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("frames", [1, 2])
def test_one_and_two_frames_are_scored_or_refused(tmp_path, demo_library, method, frames):
    write_bvh(shown(template("walk"), list(range(0, 4 * frames, 4))), tmp_path / "short.bvh")
    both = str(tmp_path / "short.bvh"), str(demo_library / WALK)
    for names in (both, both[::-1]):
        made = align_pair.align_pair(read_pair(*names), [method], lenient=True)
        assert all(made.refused.values())
        scored = [row["method"] for row in made.scores.to_pylist()]
        assert sorted([*scored, *made.refused]) == sorted({"uniform", method})
        assert np.isfinite(made.scores["distance"]).all()


def test_a_single_frame_that_a_method_refuses_ends_the_command(motionary, tmp_path, demo_library):
    write_bvh(shown(template("walk"), [0]), tmp_path / "short.bvh")
    given = tmp_path / "short.bvh", demo_library / WALK
    code, printed, told = motionary("align", *given, "--method", "dtw-itakura")
    assert (code, printed) == (1, "")
    assert "dtw-itakura cannot align" in told


def test_markers_are_aligned_by_features_alone(markers, pair, monkeypatch):
    mixed = replace(pair, moving=markers(pair.moving), warps={})
    assert [row["method"] for row in align_pair.align_pair(mixed, ["dtw"]).scores.to_pylist()] == [
        "uniform",
        "dtw",
    ]
    register(monkeypatch, Aligner("turned", "Turned", "none", "rotations", uniform, other_dofs=True))
    with pytest.raises(
        align_pair.UserError, match="turned cannot align.*markers.*these read features: uniform, dtw"
    ):
        align_pair.align_pair(mixed, ["turned"])
    made = align_pair.align_pair(mixed, ["turned", "dtw"], lenient=True)
    assert [*made.refused] == ["turned"]
    assert [*made.pair.warps] == ["DTW"]
    shown = alignment_page(made.pair, made.scores, made.refused)
    assert "Left out: 1" in shown
    assert "markers" in shown


def test_of_many_methods_those_that_bring_the_two_nearest_come_first(pair):
    made = align_pair.align_pair(pair, ["online-a", "dtw", "cotw", "derivative-dtw"])
    correlation = dict(
        zip(made.scores["title"].to_pylist(), made.scores["correlation"].to_pylist(), strict=True)
    )
    found = [correlation[title] for title in made.pair.warps]
    assert found == sorted(found, reverse=True)
    assert len(found) == 4


def test_skeletons_that_differ_are_refused_by_what_reads_postures(monkeypatch, motionary, demo_library):
    register(monkeypatch, Aligner("limbs", "Limbs", "none", "postures", uniform))
    monkeypatch.setattr("motionary.workflows.commands.align.METHODS", METHODS | {"limbs": "limbs"})
    given = (demo_library / WALK, other_rig(demo_library))
    code, printed, told = motionary("align", *given, "--method", "limbs")
    assert (code, printed) == (1, "")
    assert "limbs cannot align" in told
    code, printed, refused = motionary("align", *given, "--method", "online-c")
    assert (code, printed) == (1, "")
    assert "online-c cannot align" in refused
    assert "other joints" in refused
    assert f"these read features: {ALIGNERS['uniform'].name}, dtw" in told
    code, printed, told = motionary("align", *given, "--method", "all")
    assert code == 0
    assert "limbs is left out: " in told
    assert "cotw" in printed


def test_postures_and_rotations_have_as_many_frames_as_poses(monkeypatch, pair):
    seen = {}

    def note(reads):
        def align(moving, reference):
            seen[reads] = (moving.shape, reference.shape)
            return uniform(moving.reshape(len(moving), -1), reference.reshape(len(reference), -1))

        return align

    kinds = ("features", "postures", "rotations")
    register(monkeypatch, *(Aligner(one, one, "none", one, note(one)) for one in kinds))
    align_pair.align_pair(pair, kinds)
    lengths = len(pair.moving.pose), len(pair.reference.pose)
    joints = len(pair.moving.motion.skeleton.names)
    assert {reads: tuple(shape[0] for shape in shapes) for reads, shapes in seen.items()} == dict.fromkeys(
        kinds, lengths
    )
    assert [seen[one][0][1:] for one in kinds] == [(57,), (3 * joints,), (8, 4)]


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["a.bvh"], 2, "two files, or a catalog"),
        (["a", "b", "c", "d"], 2, "two files, or a catalog"),
        (["a.bvh", "b.bvh", "--method", "swerve"], 2, "uniform, dtw"),
        (["a.bvh", "b.bvh", "--plot", "out.pdf"], 2, "out.pdf"),
        (["a.bvh", "b.bvh", "--plot", "nowhere/out.html"], 1, "there is no folder"),
        (["a.bvh", "b.bvh", "--joint", "head"], 2, "--plot"),
        (["a.bvh", "b.bvh", "--joint", "haed", "--plot", "o.html"], 2, "'haed' is none of"),
        (["a.bvh", "b.bvh", "--snapshot", "1"], 2, "CATALOG A B"),
        (["a.bvh", "b.bvh"], 1, "a.bvh: there is no such file"),
        (["CATALOG", WALK], 1, "is a folder; give two files, or a catalog"),
        (["CATALOG", "walk/nobody.bvh", WALK], 1, "neither a clip"),
        (["CATALOG/clips", WALK, TIRED], 1, "CATALOG/clips"),
    ],
)
def test_what_is_wrong_is_told(motionary, demo_catalog, monkeypatch, tmp_path, arguments, code, told):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TERMINAL_WIDTH", "1000")
    given = [one.replace("CATALOG", demo_catalog) for one in arguments]
    ended, printed, said = motionary("align", *given)
    assert (ended, printed) == (code, "")
    assert told.replace("CATALOG/", f"{demo_catalog}/") in " ".join(said.replace("│", " ").split())
    assert not list(tmp_path.iterdir())


def test_a_page_is_replaced_whole_or_not_at_all(motionary, demo_catalog, tmp_path, monkeypatch):
    file = tmp_path / "out.html"
    file.write_text("what was there")
    given = ("align", demo_catalog, WALK, TIRED, "--plot", file)
    code, printed, told = motionary(*given, "--joint", "left_wrist")
    assert code == 0
    assert printed.startswith("method")
    assert f"wrote {file}" in told
    made = file.read_text()
    assert made.endswith("</html>\n")
    assert "left wrist, up" in made
    assert "right toe" not in made
    monkeypatch.setattr("os.fsync", full)
    code, _, told = motionary(*given)
    assert (code, file.read_text()) == (1, made)
    assert [one.name for one in tmp_path.iterdir()] == ["out.html"]


def test_the_warps_stand_over_the_costs(pair):
    figure = warps_figure(pair)
    heat, lines = (
        figure.data[0],
        [one for one in figure.data if one.type == "scatter" and one.x[0] is not None],
    )
    np.testing.assert_array_equal(heat.z, cost_matrix(pair.moving.pose, pair.reference.pose))
    assert len(heat.x) == len(pair.reference.pose) + 1
    drawn = {one.name: np.stack([one.y, one.x], axis=1) * 30 for one in lines if one.name}
    assert [*drawn] == [STRETCHED, "DTW", "CoTW"]
    np.testing.assert_allclose(drawn["DTW"], pair.warps["DTW"].path, atol=1e-4)
    for name, warp in ((STRETCHED, pair.stretched), ("CoTW", pair.warps["CoTW"])):
        np.testing.assert_allclose(drawn[name][:, 0], warp.source_time, atol=1e-4)
        np.testing.assert_allclose(drawn[name][:, 1], np.arange(len(pair.reference.pose)), atol=1e-4)
    np.testing.assert_allclose(
        drawn[STRETCHED][-1], [len(pair.moving.pose) - 1, len(pair.reference.pose) - 1]
    )


def test_long_motions_are_drawn_in_blocks(pair, monkeypatch):
    monkeypatch.setattr(alignment_chart, "MOST_FRAMES", 20)
    whole, small = cost_matrix(pair.moving.pose, pair.reference.pose), warps_figure(pair).data[0]
    rows, columns = (-(-length // 20) for length in whole.shape)
    assert small.z.shape[0] <= 20 >= small.z.shape[1]
    assert small.z[0, 0] == pytest.approx(whole[:rows, :columns].mean())
    assert (small.zmin, small.zmax) == (pytest.approx(whole.min()), pytest.approx(whole.max()))
    assert f"{rows} × {columns}" in small.colorbar.title.text
    assert small.y[-1] * 30 == pytest.approx(len(pair.moving.pose) - 0.5)


def test_ways_are_those_of_the_joints(pair):
    figure = ways_figure(pair, [("left_toe", 1), ("head", 2)])
    assert len(figure.data) == 2 * 4
    column = 3 * CANONICAL_JOINTS.index("head") + 2
    expected = {
        "the reference": pair.reference.pose[:, column],
        STRETCHED: pair.stretched.apply(pair.moving.pose[:, column]),
        **{name: warp.apply(pair.moving.pose[:, column]) for name, warp in pair.warps.items()},
    }
    for trace in figure.data[4:]:
        assert trace.yaxis == "y2"
        np.testing.assert_allclose(trace.y, expected[trace.name] * np.sqrt(19), rtol=1e-5)
    told = figure.layout.annotations[1].text
    best = np.corrcoef(expected["CoTW"], expected["the reference"])[0, 1]
    assert "head, forward" in told
    assert f"CoTW {best:.2f}" in told


def test_more_methods_than_fit_wait_in_the_legend(pair):
    many = replace(pair, warps={f"M{k}": pair.stretched for k in range(12)})
    shown = [one.visible for one in ways_figure(many, [("head", 0)]).data]
    assert shown == [True] * 5 + ["legendonly"] * 9
    looks = [(one.line.color, one.line.dash) for one in ways_figure(many, [("head", 0)]).data]
    assert len(set(looks)) == len(looks)
    held = alignment_page(many, SCORES.empty_table(), {})
    assert "Only the 3 of greatest correlation play here" in held


def test_the_liveliest_is_drawn_in_the_direction_in_which_it_moves(pair):
    still = np.zeros((30, 57))
    still[:, 3 * CANONICAL_JOINTS.index("right_wrist") + 1] = np.sin(np.arange(30))
    still[:, 3 * CANONICAL_JOINTS.index("left_knee") + 2] = 9 * np.sin(np.arange(30))
    assert liveliest_ways(replace(pair.reference, pose=still))[0] == ("right_wrist", 1)


def test_a_single_frame_makes_a_page(pair):
    one = Take("one", shown(pair.moving.motion, [3]), pair.moving.pose[3:4])
    for short in (replace(pair, moving=one, warps={}), replace(pair, reference=one, warps={})):
        assert "still, no correlation" in alignment_page(short, SCORES.empty_table(), {})


def test_names_lose_their_folders_where_that_tells_them_apart(pair):
    def named(one: str, other: str) -> tuple[str, str]:
        both = replace(pair.moving, name=one), replace(pair.reference, name=other)
        return replace(pair, moving=both[0], reference=both[1]).short_names

    assert named("a/x.bvh", "b/y.bvh") == ("x.bvh", "y.bvh")
    assert named("a/x.bvh", "b/x.bvh") == ("a/x.bvh", "b/x.bvh")


@pytest.fixture
def markers():
    """Return a way of making a take one of markers."""

    def make(take: Take) -> Take:
        motion = take.motion
        places = motion.positions()
        bare = replace(
            motion,
            root_position=places[:, 0],
            rotations=np.empty((motion.frames, 0, 4)),
            places=places - places[:, :1],
        )
        return replace(take, motion=bare)

    return make


def shown(motion: Motion, frames: list[int]) -> Motion:
    return replace(motion, root_position=motion.root_position[frames], rotations=motion.rotations[frames])


def other_rig(library: Path) -> Path:
    """Return a walk whose joints have other names than WALK's."""

    def joints(file: Path) -> set[str]:
        return set(re.findall(r"(?:ROOT|JOINT) +(\S+)", file.read_text()))

    walks = sorted((library / "walk").glob("*.bvh"))
    return next(file for file in walks if joints(file) != joints(library / WALK))


def register(monkeypatch, *aligners: Aligner) -> None:
    more = MappingProxyType(dict(ALIGNERS) | {one.name: one for one in aligners})
    monkeypatch.setattr(align_pair, "ALIGNERS", more)


def full(descriptor: int) -> None:
    raise OSError(28, "No space left on device")
