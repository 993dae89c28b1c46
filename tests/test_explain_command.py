"""`motionary explain` and what it prints; the answer's times, and the pieces of a warp."""

import json
import re
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.explain import explain
from motionary.catalog.warp_pieces import MOST_PIECES, TOLERANCE, WarpPiece, make_warp
from motionary.pipeline.config import ClusterConfig, DistanceConfig, FeatureConfig, PipelineConfig
from motionary.pipeline.distances.explain import WarpingPath
from motionary.workflows.explain_text import pace
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

DISTANCES = ("dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high")


@pytest.fixture
def catalog(demo_catalog):
    with Catalog.open(demo_catalog) as opened:
        yield opened


@pytest.fixture(scope="module")
def walks(demo_catalog) -> tuple[str, str]:
    """Find the two walks that are furthest apart."""
    return pair(demo_catalog, "a.action = 'walk' and b.action = 'walk'")


@pytest.fixture(scope="module")
def walk_and_other(demo_catalog) -> tuple[str, str]:
    """Find a walk, and what is furthest from it."""
    return pair(demo_catalog, "a.action = 'walk' and b.action <> 'walk' or a.action <> 'walk'")


def pair(url, condition):
    with Catalog.open(url) as opened:
        (row,) = opened.sql(
            f"""select clip_a, clip_b from pairs join clips a on a.clip_id = clip_a
                join clips b on b.clip_id = clip_b where {condition}
                order by weighted desc, clip_a, clip_b limit 1"""
        ).to_pylist()
    return row["clip_a"], row["clip_b"]


def assert_adds_up(explanation):
    for name in DISTANCES:
        assert sum(explanation.contributions[name].values()) == pytest.approx(
            explanation.distances[name], abs=1e-5
        )
    for point in explanation.curve:
        chosen = [zone for zone in point.zones if zone.chosen]
        assert sum(zone.distance for zone in chosen) == pytest.approx(point.distance, abs=1e-5)
        for part, value in point.contributions.items():
            assert sum(zone.contributions[part] for zone in chosen) == pytest.approx(value, abs=1e-9)
    weighted = sum(point.weight * point.distance for point in explanation.curve)
    assert weighted == pytest.approx(explanation.distances["weighted"], abs=1e-9)


def test_distances_are_those_of_table_pairs_and_add_up(catalog, walks, walk_and_other):
    for one, other in (walks, walk_and_other, walks[::-1]):
        explanation = explain(catalog, one, other)
        (row,) = catalog.sql(
            "select * from pairs where clip_a = ? and clip_b = ?", sorted([one, other])
        ).to_pylist()
        assert {name: np.float32(value) for name, value in explanation.distances.items()} == {
            name: np.float32(row[name]) for name in DISTANCES
        }
        assert [np.float32(point.distance) for point in explanation.curve] == list(
            map(np.float32, row["curve"])
        )
        assert_adds_up(explanation)
        assert (explanation.a.clip_id, explanation.b.clip_id) == (one, other)
        assert explanation.metric == "weighted"


def test_times_are_those_of_the_frames_that_were_merged(catalog, walks):
    explanation = explain(catalog, *walks)
    for clip in (explanation.a, explanation.b):
        rows = catalog.sql(
            "select first_frame, last_frame from resampled where clip_id = ? order by frame", [clip.name]
        ).to_pydict()
        assert (clip.first_frame, clip.last_frame) == (rows["first_frame"], rows["last_frame"])
    seen = set()
    for point in explanation.curve:
        spans = [*point.segments_a, *(zone.a for zone in point.zones)]
        for span in spans:
            assert span.first_frame == explanation.a.first_frame[span.first]
            assert span.last_frame == explanation.a.last_frame[span.last]
            assert (span.start_seconds, span.end_seconds) == (span.first_frame / 30, span.last_frame / 30)
        for zone in point.zones:
            seen.add(zone.backward)
            ends = (zone.b.last, zone.b.first) if zone.backward else (zone.b.first, zone.b.last)
            assert (zone.path_a[0], zone.path_a[-1]) == (zone.a.first, zone.a.last)
            assert (zone.path_b[0], zone.path_b[-1]) == ends
            assert point.segments_a[zone.segment_a].first <= zone.a.first
            assert zone.b.last <= point.segments_b[zone.segment_b].last
    assert seen


def test_the_warp_is_of_the_metric_and_runs_through_both_clips(catalog, walks):
    by_dtw, by_curve = (explain(catalog, *walks, metric=metric) for metric in ("dtw", "weighted"))
    assert by_dtw.warp.distance == by_dtw.distances["dtw"]
    assert by_curve.warp.distance == by_curve.distances["b_dtw"]
    for explanation in (by_dtw, by_curve):
        warp, ends = explanation.warp, [clip.last_frame[-1] / 30 for clip in (explanation.a, explanation.b)]
        b = warp.seconds_b[::-1] if warp.backward else warp.seconds_b
        assert (warp.seconds_a[0], warp.seconds_a[-1]) == (0, ends[0])
        assert (b[0], b[-1]) == (0, ends[1])
        assert (np.diff(warp.seconds_a) >= 0).all()
        assert (np.diff(b) >= 0).all()
        assert len(warp.path_a) == len(warp.path_b) == len(b) - 1
    assert not by_dtw.warp.backward


def test_a_file_is_explained_as_the_clip_it_is(catalog, demo_library, walks):
    of_clip, of_file = explain(catalog, *walks), explain(catalog, demo_library / walks[0], walks[1])
    assert of_file.a.name == str(demo_library / walks[0])
    assert (of_file.a.clip_id, of_file.a.cluster_id, of_file.a.label) == (None, None, None)
    assert of_file.distances == of_clip.distances
    assert of_file.curve == of_clip.curve
    assert of_clip.a.cluster_id is not None


def test_random_thresholds_and_the_papers_features(demo_library, tmp_path_factory, silent_progress, walks):
    folder = tmp_path_factory.mktemp("paper")
    (folder / "library").mkdir()
    for number, clip in enumerate(walks):
        source = demo_library / clip
        (folder / "library" / f"{number}{source.suffix}").write_bytes(source.read_bytes())
    config = PipelineConfig(
        features=FeatureConfig(kind="paper"),
        distances=DistanceConfig(thresholds="random", seed=3),
        clusters=ClusterConfig(primary="fuzzy"),
    )
    run(Job([str(folder / "library")], str(folder / "catalog"), config), silent_progress)
    with Catalog.open(str(folder / "catalog")) as opened:
        one, other = opened.clips.to_arrow()["clip_id"].to_pylist()
        explanation = explain(opened, one, other)
        (row,) = opened.pairs.to_arrow().to_pylist()
    assert_adds_up(explanation)
    assert {name: np.float32(value) for name, value in explanation.distances.items()} == {
        name: np.float32(row[name]) for name in DISTANCES
    }
    assert explanation.metric == "fuzzy"
    assert len(explanation.contributions["weighted"]) == 18
    assert not {"pelvis", "travel"} & set(explanation.contributions["weighted"])


def test_json_is_complete(motionary, demo_catalog, catalog, walk_and_other):
    code, printed, log = motionary("explain", demo_catalog, *walk_and_other, "--json", "--metric", "fuzzy")
    assert (code, log) == (0, "")
    answer = json.loads(printed)
    assert answer == json.loads(json.dumps(asdict(explain(catalog, *walk_and_other, metric="fuzzy"))))
    assert (answer["metric"], answer["features"], answer["frame_rate"]) == ("fuzzy", "pose+travel", 30)
    assert [point["threshold"] for point in answer["curve"]] == [
        0.35,
        0.45,
        0.55,
        0.65,
        0.75,
        0.85,
        0.95,
        1.0,
    ]
    assert len(answer["contributions"]["weighted"]) == 20


def test_text_tells_who_how_far_and_by_which_joints(motionary, demo_catalog, catalog, walk_and_other):
    code, printed, log = motionary("explain", demo_catalog, *walk_and_other)
    assert (code, log) == (0, "")
    explanation = explain(catalog, *walk_and_other)
    clip_a, clip_b = explanation.a, explanation.b
    for letter, clip in (("a", clip_a), ("b", clip_b)):
        told = rf"^{letter} +{re.escape(clip.name)} +{clip.seconds:.2f} +{len(clip.first_frame)} "
        assert re.search(told + rf"+{clip.cluster_id} \({clip.label}\)", printed, flags=re.MULTILINE)
    for name in DISTANCES:
        assert f"{explanation.distances[name]:.4f}" in printed
    bars = re.findall(r"^([a-z ]+?) +(\d\.\d{4}) +([\d.]+) +(█+) *$", printed, flags=re.MULTILINE)
    parts = sorted(explanation.contributions["weighted"].items(), key=lambda part: -part[1])[: len(bars)]
    assert [(name.replace(" ", "_"), adds) for name, adds, _, _ in bars] == [
        (name, f"{value:.4f}") for name, value in parts
    ]
    lengths = [len(bar) for _, _, _, bar in bars]
    assert lengths == sorted(lengths, reverse=True)
    shares = re.findall(r"^[a-z0-9 ]+? +\d\.\d{4} +(\d+\.\d)(?: |$)", printed, flags=re.MULTILINE)
    assert sum(map(float, shares)) == pytest.approx(100, abs=0.6)
    assert "Similar zones" in printed
    assert f"mean cost {explanation.warp.distance:.4f}" in printed


def test_text_of_a_fuzzy_distance_tells_both_ends(motionary, demo_catalog, walks):
    _, printed, _ = motionary("explain", demo_catalog, *walks, "--metric", "fuzzy")
    assert re.findall(r"^What makes the distance: (\w+)", printed, flags=re.MULTILINE) == [
        "fuzzy_low",
        "fuzzy_high",
    ]


def test_a_clip_with_itself(motionary, demo_catalog, walks):
    code, printed, _ = motionary("explain", demo_catalog, walks[0], walks[0])
    assert code == 0
    assert "nothing sets them apart" in printed
    assert "What makes" not in printed
    assert "at one pace" in printed


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("{catalog}", "gone.bvh", "{clip}"), 1, "gone.bvh"),
        (("{catalog}", "{clip}", "{library}"), 1, "is a folder"),
        (("{catalog}", "{clip}", "{library}/labels.csv"), 1, "labels.csv: files of type .csv are not read"),
        (("nowhere", "{clip}", "{clip}"), 1, "nowhere is not a catalog"),
        (("{catalog}", "{clip}", "{clip}", "--metric", "cosine"), 2, "cosine"),
        (("{catalog}", "{clip}"), 2, "Missing argument"),
    ],
)
def test_a_mistake_is_told(motionary, demo_catalog, demo_library, walks, arguments, code, message):
    places = {"catalog": demo_catalog, "library": demo_library, "clip": walks[0]}
    found, printed, log = motionary("explain", *(one.format(**places) for one in arguments))
    assert (found, printed) == (code, "")
    assert message in log
    assert code == 2 or log.count("\n") == 1


def test_an_unknown_metric_is_told(catalog, walks):
    with pytest.raises(CatalogError, match="no metric 'cosine'; there are dtw"):
        explain(catalog, *walks, metric="cosine")


def warp_of(cells, frames, seconds):
    """The warp along cells of two clips whose frames last equally long."""
    edges = (np.linspace(0, length, count + 1) for count, length in zip(frames, seconds, strict=True))
    backward = cells[0][1] > cells[-1][1]
    return make_warp(WarpingPath(np.array(cells), backward, 0.0, np.zeros(1)), *edges)


def test_pieces_of_a_warp():
    same = warp_of([(k, k) for k in range(30)], (30, 30), (1, 1))
    assert same.pieces == [WarpPiece(0, 1, 0, 1)]
    backward = warp_of([(k, 29 - k) for k in range(30)], (30, 30), (1, 1))
    assert backward.pieces == [WarpPiece(0, 1, 1, 0)]
    waits = warp_of([(k, 0) for k in range(30)] + [(30 + k, k) for k in range(1, 30)], (60, 30), (2, 1))
    assert [pace(piece) for piece in waits.pieces] == [
        "a waits: it takes 1.03 s where b takes 0.03 s",
        "at one pace",
    ]
    assert waits.seconds_b[:31] == pytest.approx(np.linspace(0, 1 / 30, 31))


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from([(1, 1), (1, 0), (0, 1)]), min_size=0, max_size=60), st.booleans())
def test_pieces_are_few_and_keep_close_to_the_warp(steps, backward):
    cells = np.cumsum([(0, 0), *steps], axis=0)
    frames = cells[-1] + 1
    shown = [(i, frames[1] - 1 - j) if backward else (i, j) for i, j in cells.tolist()]
    edges = [np.arange(count + 1) / 10 for count in frames]
    warp = make_warp(WarpingPath(np.array(shown), backward, 0.0, np.zeros(1)), *edges)
    assert 1 <= len(warp.pieces) <= MOST_PIECES
    corners = [(piece.start_a, piece.start_b) for piece in warp.pieces]
    corners.append((warp.pieces[-1].end_a, warp.pieces[-1].end_b))
    line = list(zip(warp.seconds_a, warp.seconds_b, strict=True))
    assert [corners[0], corners[-1]] == [line[0], line[-1]]
    assert set(corners) <= set(line)
    if len(warp.pieces) < MOST_PIECES:
        assert (
            max(
                min(apart(point, *ends) for ends in zip(corners, corners[1:], strict=False)) for point in line
            )
            <= TOLERANCE + 1e-4
        )  # what the points that `apart` looks at leave out


def apart(point, start, end):
    """Distance of a point from a straight piece, by looking at many of its points."""
    shares = np.linspace(0, 1, 2001)[:, None]
    return np.hypot(*(np.array(start) + shares * np.subtract(end, start) - point).T).min()


@pytest.mark.parametrize(
    ("piece", "told"),
    [
        (WarpPiece(0, 1, 0, 1.05), "at one pace"),
        (WarpPiece(0, 1, 3, 1), "a is 2.0 times as fast"),
        (WarpPiece(0, 3, 0, 1), "b is 3.0 times as fast"),
        (WarpPiece(1, 1, 0, 2), "b waits: it takes 2.00 s where a takes 0.00 s"),
        (WarpPiece(0, 0, 0, 0), "at one pace"),
    ],
)
def test_paces(piece, told):
    assert pace(piece) == told
