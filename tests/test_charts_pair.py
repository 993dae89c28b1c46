"""Charts of pairs and of alignments: what is drawn is what the explanation and the tables say."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.cluster.hierarchy import linkage
from scipy.spatial.distance import pdist

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.views import cost_matrix, mu_kappa
from motionary.catalog.views.chart_text import full_text, short_text
from motionary.catalog.views.cost_matrix import cost_matrix_figure, mean_of_blocks
from motionary.catalog.views.curve_chart import curve_figure
from motionary.catalog.views.dendrogram import dendrogram_figure
from motionary.catalog.views.line_styles import line_style
from motionary.catalog.views.linkages import linkages_by_distance, primary_linkage
from motionary.catalog.views.mu_kappa import mu_kappa_figure
from motionary.catalog.views.threshold_band import strip_bars
from motionary.catalog.views.trajectory_chart import correlation, trajectory_figure
from motionary.catalog.views.warp_chart import warp_figure
from motionary.pipeline.canonical import CANONICAL_JOINTS, canonical_indices, find_convention
from motionary.pipeline.clustering import cut_tree, threshold_strips, widest_strip
from motionary.pipeline.config import AlignmentConfig, PipelineConfig
from motionary.pipeline.synthetic import template
from motionary.pipeline.writers import write_bvh
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

WALK, RUN, JUMP = "walk/walk_tired_alex_01.bvh", "run/run_tired_bea_01.bvh", "jump/jump_proud_emil_01.bvh"
HOSTILE = ('<script>alert(1)</script>&"q"\'s %{x} $a$ #?.bvh', f"{'x' * 150}/{'<b>' * 50}הליכה.bvh")


@pytest.fixture(scope="module")
def demo(demo_catalog):
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def hostile(tmp_path_factory, silent_progress):
    """Return a catalog of two clips of hostile names, aligned with open ends."""
    folder = tmp_path_factory.mktemp("hostile")
    for name, action in zip(HOSTILE, ("walk", "run"), strict=True):
        file = folder / "library" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bvh(template(action), file)
    config = PipelineConfig(alignment=AlignmentConfig(open_ends=True))
    run(Job([str(folder / "library")], str(folder / "catalog"), config), silent_progress)
    return Catalog.open(str(folder / "catalog"))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return files of one frame, and of one pose held."""
    folder = tmp_path_factory.mktemp("files")
    motion = template("walk")
    for name, frames in (("one", [10]), ("still", [10] * 40)):
        shown = replace(
            motion, root_position=motion.root_position[frames], rotations=motion.rotations[frames]
        )
        write_bvh(shown, folder / f"{name}.bvh")
    return {name: str(folder / f"{name}.bvh") for name in ("one", "still")}


def named(figure, name):
    return [trace for trace in figure.data if trace.name == name]


def polylines(trace):
    """Part a line at its gaps."""
    points = np.stack([trace.x, trace.y], axis=1).astype(float)
    gap = np.isnan(points).any(axis=1)
    parts = np.split(points, np.flatnonzero(gap) + 1)
    return [part[~np.isnan(part).any(axis=1)] for part in parts if not np.isnan(part).any(axis=1).all()]


def every_text(value):
    """List all text of a figure, and where it stands."""
    stack = [("", value)]
    while stack:
        path, one = stack.pop()
        if isinstance(one, dict):
            stack += [(f"{path}.{key}", inner) for key, inner in one.items()]
        elif isinstance(one, list | tuple):
            stack += [(path, inner) for inner in one]
        elif isinstance(one, str):
            yield path, one


# DTW-Curves


def test_curves_are_those_of_table_pairs(demo):
    others = (RUN, JUMP)
    figure = curve_figure([demo.explain(WALK, other) for other in others])
    for number, other in enumerate(others, start=1):
        first, second = sorted((WALK, other))
        kept = demo.sql("select * from pairs where clip_a = ? and clip_b = ?", [first, second]).to_pylist()[0]
        curve, band, mark = [trace for trace in figure.data if trace.legendgroup == str(number)]
        assert curve.x == (0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.0)
        np.testing.assert_allclose(curve.y, kept["curve"], rtol=1e-6)
        np.testing.assert_allclose(band.y, [kept["fuzzy_low"], kept["fuzzy_high"]], rtol=1e-6)
        np.testing.assert_allclose(mark.y, [kept["weighted"]], rtol=1e-6)
        assert (band.x, mark.x) == ((str(number),) * 2, (str(number),))
    top = figure.layout.yaxis.range[1]
    assert all(max(trace.y) <= top for trace in figure.data)


def test_curve_of_a_clip_against_itself_is_zero(demo):
    figure = curve_figure([demo.explain(WALK, WALK)])
    assert {value for trace in figure.data for value in trace.y} == {0.0}
    assert figure.layout.yaxis.range == (0, 1)


def test_curves_need_a_pair():
    with pytest.raises(ValueError, match="no pair is given"):
        curve_figure([])


def test_lines_differ_in_more_than_colour():
    styles = [line_style(number) for number in range(1, 211)]
    assert len({(one.colour, one.dash, one.symbol) for one in styles}) == 210
    assert len({(one.dash, one.symbol) for one in styles[:6]}) == 6


# Cost matrix


@pytest.mark.parametrize("threshold", [0.35, 0.65, 1.0])
@pytest.mark.parametrize("other", [RUN, JUMP, WALK])
def test_cost_matrix_shows_what_the_explanation_says(demo, other, threshold):
    explanation = demo.explain(WALK, other)
    figure = cost_matrix_figure(demo, explanation, threshold)
    point = next(one for one in explanation.curve if one.threshold == threshold)
    heat, rate = figure.data[0], explanation.frame_rate

    merged = {}
    for clip in (WALK, other):
        query = "select * from resampled where clip_id = ? order by frame"
        merged[clip] = demo.sql(query, [clip]).to_pylist()
    costs = [
        [np.linalg.norm(np.subtract(a["feature"], b["feature"])) for b in merged[other]] for a in merged[WALK]
    ]
    np.testing.assert_allclose(heat.z, costs, atol=2e-4)
    for edges, clip in ((heat.y, WALK), (heat.x, other)):
        rows = merged[clip]
        assert len(edges) == len(rows) + 1
        for k, row in enumerate(rows):
            assert edges[k] * rate == pytest.approx(row["first_frame"] - 0.5)
            assert edges[k + 1] * rate == pytest.approx(row["last_frame"] + 0.5)

    drawn = {}
    for kind in ("similar zone, not needed", "zone of the cover", "zone of the cover, b played backward"):
        lines = [one for one in figure.data if one.legendgroup == kind and one.mode == "lines"]
        assert len({len(polylines(one)) for one in lines}) <= 1
        drawn[kind] = (
            {tuple(np.round(box * rate, 2).ravel()) for box in polylines(lines[-1])} if lines else set()
        )
    expected = {kind: set() for kind in drawn}
    for zone in point.zones:
        kind = "zone of the cover" if zone.chosen else "similar zone, not needed"
        kind += ", b played backward" if zone.chosen and zone.backward else ""
        x0, x1 = zone.b.first_frame - 0.5, zone.b.last_frame + 0.5
        y0, y1 = zone.a.first_frame - 0.5, zone.a.last_frame + 0.5
        expected[kind].add((x0, y0, x1, y0, x1, y1, x0, y1, x0, y0))
    assert drawn == expected

    for backward, name in ((False, "path"), (True, "path, b played backward")):
        ways = [zone for zone in point.zones if zone.chosen and zone.backward == backward]
        lines = [line for trace in named(figure, name) for line in polylines(trace)]
        assert len(lines) == len(ways)
        for line, zone in zip(lines, ways, strict=True):
            middle = [
                [
                    (row["first_frame"] + row["last_frame"]) / 2 / rate
                    for row in (merged[other][j], merged[WALK][i])
                ]
                for i, j in zip(zone.path_a, zone.path_b, strict=True)
            ]
            np.testing.assert_allclose(line, middle, atol=1e-5)

    for segments, axis in ((point.segments_a, "x2"), (point.segments_b, None)):
        bars = [
            one for one in figure.data if one.legendgroup == "segments" and (one.xaxis == "x2") == bool(axis)
        ]
        ends = sorted(
            tuple(np.round(box[:, 1 if axis else 0] * rate, 3)) for one in bars for box in polylines(one)
        )
        assert ends == [(one.first_frame - 0.5, one.last_frame + 0.5) for one in segments]


def test_colours_break_where_a_region_ends(demo):
    explanation = demo.explain(WALK, RUN)
    point = explanation.curve[3]
    heat = cost_matrix_figure(demo, explanation, point.threshold).data[0]
    places = [place for place, _ in heat.colorscale]
    assert places == [0, point.threshold, point.threshold, 1]
    assert heat.zmin + point.threshold * (heat.zmax - heat.zmin) == pytest.approx(point.limit, rel=1e-6)
    lightness = [sum(int(colour[k : k + 2], 16) for k in (1, 3, 5)) for _, colour in heat.colorscale]
    assert lightness == sorted(set(lightness))
    assert lightness[2] - lightness[1] > 150


def test_without_a_threshold_the_warp_is_drawn(demo):
    explanation = demo.explain(WALK, RUN, "dtw")
    figure = cost_matrix_figure(demo, explanation, None)
    assert {trace.name for trace in figure.data} == {None, "path"}
    (line,) = polylines(named(figure, "path")[0])
    assert len(line) == len(explanation.warp.path_a)
    assert (np.diff(line, axis=0) >= 0).all()


def test_threshold_must_be_one_of_the_curve(demo):
    with pytest.raises(ValueError, match=r"threshold is 0\.5; the curve was taken at 0\.35, 0\.45"):
        cost_matrix_figure(demo, demo.explain(WALK, RUN), 0.5)


def test_a_file_that_changed_is_not_drawn_as_the_old_one(demo, files, tmp_path):
    file = tmp_path / "take.bvh"
    write_bvh(template("walk"), file)
    explanation = demo.explain(str(file), WALK)
    figure = cost_matrix_figure(demo, explanation)
    assert figure.data[0].z.shape == (len(explanation.a.first_frame), len(explanation.b.first_frame))
    write_bvh(template("jump"), file)
    with pytest.raises(CatalogError, match="has changed since it was explained"):
        cost_matrix_figure(demo, explanation)


@pytest.mark.parametrize(("a", "b"), [("one", "one"), ("one", "still"), ("one", None), (None, "still")])
def test_shortest_clips_have_charts(demo, files, a, b):
    explanation = demo.explain(*(files.get(name, WALK) for name in (a, b)))
    assert len(curve_figure([explanation]).data) == 3
    for threshold in (None, 0.35, 1.0):
        figure = cost_matrix_figure(demo, explanation, threshold)
        heat = figure.data[0]
        assert heat.z.shape == (len(heat.y) - 1, len(heat.x) - 1)
        assert (np.diff(heat.x) > 0).all()
        assert (np.diff(heat.y) > 0).all()
        paths = named(figure, "path") + named(figure, "path, b played backward")
        if heat.z.size == 1:
            assert [trace.mode for trace in paths] == ["lines+markers"]


@settings(deadline=None)
@given(
    values=hnp.arrays(
        np.float32, hnp.array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.floats(0, 8, width=32)
    ),
    rows=st.integers(1, 4),
    columns=st.integers(1, 4),
)
def test_blocks_have_the_mean_of_their_costs(values, rows, columns):
    found = mean_of_blocks(values, rows, columns)
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            block = values[i * rows : (i + 1) * rows, j * columns : (j + 1) * columns]
            assert found[i, j] == pytest.approx(block.mean(dtype=float), abs=1e-5)
    assert found.shape == (-(-values.shape[0] // rows), -(-values.shape[1] // columns))


def test_long_clips_are_drawn_in_blocks_that_are_told_of(demo, monkeypatch):
    explanation = demo.explain(WALK, RUN)
    whole = cost_matrix_figure(demo, explanation, 0.35)
    assert "blocks" not in whole.layout.title.text
    monkeypatch.setattr(cost_matrix, "MOST_FRAMES", 6)
    reduced = cost_matrix_figure(demo, explanation, 0.35)
    rows, columns = (-(-side // 6) for side in whole.data[0].z.shape)
    assert max(reduced.data[0].z.shape) <= 6
    assert f"blocks of {rows} × {columns} compared frames" in reduced.layout.title.text
    np.testing.assert_array_equal(reduced.data[0].z, mean_of_blocks(whole.data[0].z, rows, columns))
    ends = [0, -1]
    np.testing.assert_array_equal(np.array(reduced.data[0].x)[ends], np.array(whole.data[0].x)[ends])
    assert (reduced.data[0].zmin, reduced.data[0].zmax) == (whole.data[0].zmin, whole.data[0].zmax)
    for ours, theirs in zip(reduced.data[1:], whole.data[1:], strict=True):
        np.testing.assert_array_equal(ours.x, theirs.x)


# Warping paths


def members(catalog, clip_id):
    query = (
        "select clip_id, clip_id = reference_id as is_reference from alignments "
        "where reference_id = (select reference_id from alignments where clip_id = ?) order by clip_id"
    )
    return catalog.sql(query, [clip_id]).to_pylist()


def test_warps_are_the_kept_source_times(demo):
    clips = members(demo, JUMP)
    figure = warp_figure(demo, [one["clip_id"] for one in clips])
    for one in clips:
        row = demo.sql("select * from alignments where clip_id = ?", [one["clip_id"]]).to_pylist()[0]
        frames = len(demo.sql("select frame from features where clip_id = ?", [one["clip_id"]]))
        path, nodes, lead, node_lead = [trace for trace in figure.data if trace.legendgroup == one["clip_id"]]
        np.testing.assert_allclose(np.array(path.y) * 30, row["source_time"], atol=1e-4)
        np.testing.assert_allclose(np.array(path.x) * 30, np.arange(len(row["source_time"])), atol=1e-4)
        stretched = np.linspace(0, frames - 1, len(row["source_time"]))
        np.testing.assert_allclose(np.array(lead.y) * 30, row["source_time"] - stretched, atol=1e-4)
        assert len(nodes.x) == len(row["nodes"])
        np.testing.assert_allclose(np.interp(nodes.x, path.x, path.y), nodes.y, atol=1e-5)
        np.testing.assert_allclose(np.interp(node_lead.x, lead.x, lead.y), node_lead.y, atol=1e-5)
        if one["is_reference"]:
            np.testing.assert_allclose(path.x, path.y, atol=1e-5)
            np.testing.assert_allclose(lead.y, 0, atol=1e-5)
    above, below = named(figure, "only stretched to the reference's length")
    assert len(polylines(above)) == len(clips)
    assert set(below.y) == {0}


def test_nodes_outside_the_reference_are_left_out(hostile):
    rows = hostile.sql("select * from alignments where first_frame <> 0").to_pylist()
    assert rows, "with open ends the first node of one of them moves"
    figure = warp_figure(hostile, [row["clip_id"] for row in rows])
    for row in rows:
        path, nodes, *_ = [trace for trace in figure.data if trace.legendgroup == row["clip_id"]]
        np.testing.assert_allclose(np.array(path.y) * row["frame_rate"], row["source_time"], atol=1e-4)
        assert 0 < len(nodes.x) < len(row["nodes"])
        np.testing.assert_allclose(np.interp(nodes.x, path.x, path.y), nodes.y, atol=1e-5)


def test_warps_of_several_clusters_keep_their_own_time(demo):
    assert "own reference" in warp_figure(demo, [WALK, JUMP]).layout.xaxis.title.text
    assert "walk" in warp_figure(demo, [WALK, WALK]).layout.xaxis.title.text


def test_warps_need_clips_that_are_there(demo):
    with pytest.raises(CatalogError, match="no clip 'walk/wal'"):
        warp_figure(demo, ["walk/wal"])
    with pytest.raises(CatalogError, match="is given; name one or more"):
        warp_figure(demo, [])


# Trajectories


def places(catalog, clip_id, joint):
    """Find a joint in the heading frame by hand, from table `aligned`: left, up, forward in leg lengths."""
    clip = catalog.sql("select * from clips where clip_id = ?", [clip_id]).to_pylist()[0]
    skeleton = catalog.motion(clip_id).skeleton
    rows = catalog.sql("select * from aligned where clip_id = ? order by frame", [clip_id])
    rotations = np.array(rows["rotations"].to_pylist()).reshape(len(rows), -1, 4)
    motion = replace(
        catalog.motion(clip_id),
        root_position=np.array(rows["root_position"].to_pylist()),
        rotations=rotations,
    )
    index = dict(
        zip(CANONICAL_JOINTS, canonical_indices(skeleton, find_convention(skeleton.names)), strict=True)
    )
    joints = motion.positions()
    floor = np.percentile(np.minimum(*(joints[:, index[f"{side}_toe"], 1] for side in ("left", "right"))), 2)
    found = []
    for frame in joints:
        at = {name: frame[index[name]] for name in CANONICAL_JOINTS}
        across = at["left_hip"] - at["right_hip"] + at["left_shoulder"] - at["right_shoulder"]
        across[1] = 0
        left = across / np.linalg.norm(across)
        forward = np.cross(left, [0, 1, 0])
        apart = at[joint] - at["pelvis"]
        found.append([apart @ left, at[joint][1] - floor, apart @ forward])
    return np.array(found) / clip["leg_length"]


@pytest.mark.parametrize("joint", ["left_wrist", "right_toe", "left_elbow"])
def test_trajectories_after_are_those_of_table_aligned(demo, joint):
    figure = trajectory_figure(demo, JUMP, joint)
    row = demo.sql("select * from alignments where clip_id = ?", [JUMP]).to_pylist()[0]
    columns = slice(3 * CANONICAL_JOINTS.index(joint), 3 * CANONICAL_JOINTS.index(joint) + 3)
    own, reference = (
        np.array(demo.sql(query, [clip])["feature"].to_pylist())[:, columns] * np.sqrt(19)
        for query in ["select feature from features where clip_id = ? order by frame"]
        for clip in (JUMP, row["reference_id"])
    )
    by_hand = places(demo, JUMP, joint)
    matched = np.linspace(0, len(own) - 1, len(reference))
    for panel in range(3):
        shown = [trace for trace in figure.data if trace.yaxis == ("y", "y2", "y3")[panel]]
        theirs, before, after = [np.array(trace.y) for trace in shown]
        np.testing.assert_allclose(theirs, reference[:, panel], rtol=1e-6)
        np.testing.assert_allclose(before, np.interp(matched, np.arange(len(own)), own[:, panel]), atol=1e-6)
        np.testing.assert_allclose(after, by_hand[:, panel], atol=1e-3)
        warped = np.interp(row["source_time"], np.arange(len(own)), own[:, panel])
        np.testing.assert_allclose(after, warped, atol=0.03)  # rotations are warped, not places
        rho = re.search(r"correlation (\S+) before, (\S+) after", figure.layout.annotations[panel].text)
        assert float(rho[1]) == pytest.approx(np.corrcoef(before, theirs)[0, 1], abs=0.006)
        assert float(rho[2]) == pytest.approx(np.corrcoef(after, theirs)[0, 1], abs=0.006)
        np.testing.assert_allclose(np.array(shown[0].x) * 30, np.arange(len(reference)), atol=1e-4)


def test_the_reference_agrees_with_itself(demo):
    reference = next(one["clip_id"] for one in members(demo, WALK) if one["is_reference"])
    figure = trajectory_figure(demo, reference, "left_ankle")
    for axis in ("y", "y2", "y3"):
        theirs, before, after = (trace.y for trace in figure.data if trace.yaxis == axis)
        np.testing.assert_array_equal(theirs, before)
        np.testing.assert_allclose(theirs, after, atol=1e-4)


def test_a_still_direction_has_no_correlation(demo):
    texts = [one.text for one in trajectory_figure(demo, WALK, "pelvis").layout.annotations]
    assert texts[0] == "left: still, no correlation"
    assert texts[1].startswith("up: correlation")
    assert texts[2] == "forward: still, no correlation"
    assert correlation(np.ones(5), np.arange(5.0)) is None
    assert correlation(np.arange(5.0), -np.arange(5.0)) == pytest.approx(-1)


def test_a_joint_must_be_canonical(demo):
    with pytest.raises(ValueError, match="there is no joint 'LeftHand'; it must be one of pelvis, spine"):
        trajectory_figure(demo, WALK, "LeftHand")
    with pytest.raises(CatalogError, match="no clip 'nobody'"):
        trajectory_figure(demo, "nobody", "head")


# Threshold strips


@settings(deadline=None)
@given(
    points=hnp.arrays(
        np.float64, st.tuples(st.integers(2, 60), st.just(2)), elements=st.integers(0, 40).map(float)
    ),
    method=st.sampled_from(["ward", "complete", "average"]),
)
def test_bars_are_the_strips(points, method):
    Z = linkage(pdist(points), method)
    last = 1.05 * Z[-1, 2] or 1.0
    bars = strip_bars(Z, last)
    assert (bars[0].low, bars[-1].high) == (0, last)
    assert all(one.high == other.low for one, other in zip(bars, bars[1:], strict=False))
    strips = {row["kappa"]: row for row in threshold_strips(Z).to_pylist()}
    for bar in bars:
        assert bar.low == strips[bar.most]["mu_low"]
        assert bar.high == min(strips[bar.fewest]["mu_high"], last)
        assert cut_tree(Z, threshold=bar.low).max() + 1 == bar.most
    for kappa, row in strips.items():
        (own,) = [bar for bar in bars if bar.most >= kappa >= bar.fewest]
        if min(row["mu_high"], last) - row["mu_low"] > last / 200:
            assert own.most == own.fewest == kappa
    best = widest_strip(Z)
    assert [bar.most for bar in bars if bar.widest] == ([] if best is None else [best.kappa])


def drawn_bars(trace):
    return [
        (low, low + width)
        for low, width in zip(np.array(trace.base, float), np.array(trace.x, float), strict=True)
    ]


def test_dendrogram_has_a_band_of_strips(demo):
    figure, kept = dendrogram_figure(demo), primary_linkage(demo)
    (band,) = [trace for trace in figure.data if trace.type == "bar"]
    last = figure.layout.xaxis.range[1]
    bars = strip_bars(kept.Z, last)
    np.testing.assert_allclose(drawn_bars(band), [(one.low, one.high) for one in bars])
    star = [place for place, text in enumerate(band.text) if "★" in text]
    assert [bars[place].most for place in star] == [kept.cut["strip_clusters"]]
    np.testing.assert_allclose(drawn_bars(band)[star[0]], [kept.cut["strip_low"], kept.cut["strip_high"]])
    published = len(demo.references)
    (inside,) = [one for one in bars if one.low <= figure.layout.shapes[0].x0 < one.high]
    assert inside.most >= published >= inside.fewest
    assert figure.layout.shapes[0].yref == "paper"  # through band and tree


def test_mu_kappa_has_a_row_of_strips_for_every_distance(demo):
    figure = mu_kappa_figure(demo)
    bands = [trace for trace in figure.data if trace.type == "bar"]
    curves = linkages_by_distance(demo)
    assert [set(band.y) for band in bands] == [{one.cut["metric"]} for one in curves]
    for band, one in zip(bands, curves, strict=True):
        greatest = one.Z[-1, 2]
        ends = np.array(drawn_bars(band)) * greatest
        assert ends[0, 0] == 0
        (star,) = [place for place, text in enumerate(band.text) if "★" in text]
        np.testing.assert_allclose(ends[star], [one.cut["strip_low"], one.cut["strip_high"]])
        assert band.text[star] == f"{one.cut['strip_clusters']} ★"


def test_every_distance_has_a_curve_of_its_own_style(demo, monkeypatch):
    curves = [
        replace(one, cut=one.cut | {"metric": f"{one.cut['metric']} {time}"})
        for time in range(2)
        for one in linkages_by_distance(demo)
    ]
    monkeypatch.setattr(mu_kappa, "linkages_by_distance", lambda catalog: curves)
    lines = [trace.line for trace in mu_kappa_figure(demo).data if trace.type == "scatter"]
    assert [(line.color, line.dash) for line in lines if line.shape == "hv"] == [
        (line_style(number).colour, line_style(number).dash) for number in range(1, len(curves) + 1)
    ]


# Names


def test_names_are_shortened_in_the_middle_and_escaped():
    assert short_text("walk") == "\u2068walk\u2069"
    long = short_text("a" * 100 + "<b>" + "z" * 100)
    assert len(long) == 46
    assert long.startswith("\u2068aaa")
    assert long.endswith("zzz\u2069")
    assert short_text("<b>&") == "\u2068&lt;b&gt;&amp;\u2069"
    assert re.sub("[\u2068\u2069]|<br>", "", full_text("<" * 130)) == "&lt;" * 130


def test_hostile_names_are_text_in_every_chart(hostile):
    ids = hostile.clips.to_arrow()["clip_id"].to_pylist()
    assert sorted(ids) == sorted(HOSTILE)
    explanation = hostile.explain(*ids)
    figures = [
        curve_figure([explanation, hostile.explain(ids[0], ids[0])]),
        *(cost_matrix_figure(hostile, explanation, one) for one in (None, 0.35, 1.0)),
        warp_figure(hostile, ids),
        *(trajectory_figure(hostile, one, "head") for one in ids),
        dendrogram_figure(hostile),
        mu_kappa_figure(hostile),
    ]
    for figure in figures:
        for place, text in every_text(figure.to_dict()):
            if "legendgroup" in place:  # a key, never shown
                continue
            assert not re.search(r"<(?!br>|extra>|/extra>)", text), (place, text)
            assert not ("template" in place and ("alert" in text or "xxx" in text)), (place, text)


def test_charts_of_two_clips_are_small(hostile):
    explanation = hostile.explain(*HOSTILE)
    for figure in (cost_matrix_figure(hostile, explanation), warp_figure(hostile, HOSTILE)):
        assert len(figure.to_json()) < 100_000
