"""The map of a library, the style space, labels against clusters, and thumbnails."""

import json
import re
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import pdist, squareform
from sklearn.manifold import MDS, Isomap, SpectralEmbedding, trustworthiness

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.store import Store
from motionary.catalog.views import embedding, label_confusion, library_map
from motionary.catalog.views.cluster_map import cluster_map_figure
from motionary.catalog.views.embedding import laid_out, placed_among
from motionary.catalog.views.label_confusion import confusion_figure, label_counts
from motionary.catalog.views.label_marks import MOST_LABELS, label_marks, source_shapes
from motionary.catalog.views.style_chart import style_figure
from motionary.catalog.views.thumbnail import thumbnail_of, thumbnail_svg
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import template
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

HOSTILE = "<script>alert(1)</script>\"'&%{x}\n\u202e\u05e9\u05dc\u05d5\u05dd" + 260 * "a"


@pytest.fixture(scope="module")
def demo(demo_catalog):
    return Catalog.open(demo_catalog)


@pytest.fixture
def library(tmp_path, publish_rows):
    """Return a way of publishing clips that lie in the plane: their distances are those of their places."""

    def publish(places, labels=None, clusters=None, ids=None, roots=None, scores=None):
        ids = ids or [f"clip {k:05}" for k in range(len(places))]
        labels, clusters = labels or [None] * len(ids), clusters or [1] * len(ids)
        first = {one: ids[clusters.index(one)] for one in sorted(set(clusters))}
        places = dict(zip(ids, np.asarray(places, float).reshape(-1, 2), strict=True))
        rows = {
            "clips": [{"clip_id": one, "convention": "mixamo"} for one in ids],
            "clusters": [
                {"clip_id": one, "cluster_id": c, "label": label, "is_reference": first[c] == one}
                | {"label_source": "unassigned" if label is None else "supplied"}
                for one, c, label in zip(ids, clusters, labels, strict=True)
            ],
            "references": [
                {"cluster_id": c, "clip_id": one, "size": clusters.count(c)}
                | {"label": labels[ids.index(one)]}
                for c, one in first.items()
            ],
            "pairs": [
                {
                    "clip_a": a,
                    "clip_b": b,
                    "weighted": np.linalg.norm(places[a] - places[b]),
                    "curve": [0.0] * 8,
                }
                for a, b in combinations(sorted(ids), 2)
            ],
            "inputs": [{"clip_id": one, "root": root} for one, root in zip(ids, roots or ids, strict=True)],
            "styles": [
                {"clip_id": one, "cluster_id": c, "reference_id": first[c], "kind": "pose"}
                | {"joints": ["hips", "<b>head</b>"], "joint_energy": [0.0, 1.0]}
                | {"scores": own, "explained": [0.6, 0.3][: len(own)]}
                for one, c, own in zip(ids, clusters, scores or [[]] * len(ids), strict=True)
            ],
            "runs": [{"settings": json.dumps(asdict(PipelineConfig()))}],
        }
        for row in rows["inputs"]:
            row["root"] = row["root"] if roots else "library"
        publish_rows(Store(str(tmp_path)), **rows)
        return Catalog.open(str(tmp_path))

    return publish


def texts(figure):
    """List every text of a figure that Plotly reads as markup."""

    def found(value, name):
        if isinstance(value, dict):
            return [one for key, inner in value.items() for one in found(inner, key)]
        if isinstance(value, list | tuple):
            return [one for inner in value for one in found(inner, name)]
        shown = ("text", "hovertext", "name", "ticktext", "title", "hovertemplate")
        return [value] if isinstance(value, str) and name in shown else []

    return found(json.loads(figure.to_json()), "")


# --- the plane -----------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=40)
@given(
    st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), max_size=14),
    st.floats(1e-3, 1e3),
)
def test_places_keep_to_their_conventions(points, scale):
    points = np.array(points, float).reshape(-1, 2)
    distances = scale * np.linalg.norm(points[:, None] - points, axis=2)
    places = laid_out(distances)
    assert places.shape == (len(points), 2)
    assert np.isfinite(places).all()
    if not distances.any():
        assert not places.any()
        return
    np.testing.assert_allclose(places.mean(axis=0), 0, atol=1e-6)
    assert np.linalg.norm(places, axis=1).max() == pytest.approx(1)
    assert places[:, 0].std() >= places[:, 1].std() - 1e-6
    assert abs(np.mean(places[:, 0] * places[:, 1])) < 1e-6
    for axis in places.T:
        assert axis.max() >= -axis.min() - 1e-6
    np.testing.assert_array_equal(places, laid_out(distances))


def test_few_clips_keep_their_distances():
    points = np.random.default_rng(2).normal(size=(6, 2))
    distances = squareform(pdist(points))
    again = squareform(pdist(laid_out(distances)))
    np.testing.assert_allclose(again / again.max(), distances / distances.max(), atol=1e-9)


def test_a_clip_is_placed_among_the_landmarks_nearest_to_it():
    random = np.random.default_rng(3)
    landmarks = random.normal(size=(9, 2))
    nearest = np.array([random.choice(9, 3, replace=False) for _ in range(20)])
    distances = random.uniform(0.1, 1, size=(20, 3))
    distances[4, 1] = 0.0
    distances[5] = 0.0
    places = placed_among(landmarks, nearest, distances)
    for row in range(20):
        weights = [1 / max(one, 1e-12) ** 2 for one in distances[row]]
        slow = sum(weight * landmarks[k] for weight, k in zip(weights, nearest[row], strict=True))
        np.testing.assert_allclose(places[row], slow / sum(weights), atol=1e-9)
    np.testing.assert_array_equal(places[4], landmarks[nearest[4, 1]])


def test_the_layout_runs_on_one_thread():
    """A library that is loaded after the limit is set is not limited, and its sums differ by chance."""
    script = """
import sys, numpy, threadpoolctl
class Watched(threadpoolctl.threadpool_limits):
    def __init__(self, **limits):
        assert limits == {"limits": 1}
        assert "sklearn.manifold._t_sne" in sys.modules
        super().__init__(**limits)
        print({one["num_threads"] for one in threadpoolctl.threadpool_info()})
threadpoolctl.threadpool_limits = Watched
from motionary.catalog.views.embedding import laid_out
laid_out(numpy.abs(numpy.subtract.outer(numpy.arange(20), numpy.arange(20))))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.stdout.strip(), done.stderr) == ("{1}", "")


def test_two_layouts_leave_the_threads_as_they_were(monkeypatch):
    """The limit is the process's: of two that overlap, the second would find one thread and put that back."""
    inside, most, scaled = [], [], embedding._scaled

    def watched(distances):
        inside.append(distances)
        most.append(len(inside))
        time.sleep(0.1)
        places = scaled(distances)
        inside.pop()
        return places

    monkeypatch.setattr(embedding, "_scaled", watched)
    distances = np.abs(np.subtract.outer(np.arange(5.0), np.arange(5.0)))
    with ThreadPoolExecutor(3) as threads:
        list(threads.map(laid_out, [distances] * 3))
    assert most == [1, 1, 1]


# --- the map -------------------------------------------------------------------------------------------


def all_distances(catalog, ids):
    at = {one: k for k, one in enumerate(ids)}
    distances = np.zeros((len(ids), len(ids)))
    for pair in catalog.pairs.to_arrow().select(["clip_a", "clip_b", "weighted"]).to_pylist():
        a, b = at[pair["clip_a"]], at[pair["clip_b"]]
        distances[a, b] = distances[b, a] = pair["weighted"]
    return distances


def test_map_keeps_neighbours_together(demo):
    table = library_map.library_map(demo)
    ids = table["clip_id"].to_pylist()
    assert ids == sorted(demo.clips.to_arrow()["clip_id"].to_pylist())
    assert set(table["source"].to_pylist()) == {"mixamo", "cmu-bvh"}
    places = np.stack([table["x"].to_numpy(), table["y"].to_numpy()], axis=1)
    distances = all_distances(demo, ids)
    assert trustworthiness(distances, places, n_neighbors=10, metric="precomputed") > 0.93
    np.fill_diagonal(distances, np.inf)
    labels = np.array(table["label"].to_pylist())
    on_map = squareform(pdist(places)) + np.diag(np.full(len(ids), np.inf))
    assert np.mean(labels[on_map.argmin(axis=0)] == labels) > 0.95
    assert library_map.library_map(demo).equals(table)


def continuity(distances, on_map, k):
    """How few of the k nearest by distance are far on the map [Venna, Kaski 2001]."""
    clips, missed = len(distances), 0
    for row in range(clips):
        others = [one for one in range(clips) if one != row]
        nearest = sorted(others, key=lambda one: distances[row, one])[:k]
        rank = {one: place for place, one in enumerate(sorted(others, key=lambda one: on_map[row, one]), 1)}
        missed += sum(max(rank[one] - k, 0) for one in nearest)
    return 1 - 2 * missed / (clips * k * (2 * clips - 3 * k - 1))


@pytest.fixture(scope="module")
def real(shared_data, tmp_path_factory, silent_progress):
    """The catalog of all real clips."""
    url = str(tmp_path_factory.mktemp("real") / "catalog")
    run(Job([str(shared_data)], url, PipelineConfig(), shared_data / "labels.csv"), silent_progress)
    with Catalog.open(url) as catalog:
        yield catalog


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("library", ["demo", pytest.param("real", marks=pytest.mark.slow)])
def test_rivals_part_more_neighbours(library, request, monkeypatch):
    """With -s it prints what `embedding` says."""
    catalog = request.getfixturevalue(library)
    table = library_map.library_map(catalog)
    labels = np.array(table["label"].to_pylist())
    distances = all_distances(catalog, table["clip_id"].to_pylist())
    near = np.sort(distances)[:, 10]
    affinity = np.exp(-(distances**2) / np.outer(near, near))
    layouts = {
        "t-SNE": laid_out(distances),
        "isomap": Isomap(n_neighbors=10, metric="precomputed").fit_transform(distances),
        "eigenmaps": SpectralEmbedding(affinity="precomputed", random_state=0).fit_transform(affinity),
        "classical scaling": embedding._scaled(distances),
        "of square roots": embedding._scaled(np.sqrt(distances)),
        "stress": MDS(metric="precomputed", n_init=1, init="classical_mds").fit_transform(distances),
    }
    monkeypatch.setattr(library_map, "LANDMARKS", len(labels) // 2)
    half = library_map.library_map(catalog)
    half_places = np.stack([half["x"].to_numpy(), half["y"].to_numpy()], axis=1)
    print(f"\n{library}: same in the distances themselves {same_nearest(distances, labels):.3f}")
    kept = {}
    for name, places in {**layouts, "half as landmarks": half_places}.items():
        on_map = squareform(pdist(places))
        trust = trustworthiness(distances, places, n_neighbors=10, metric="precomputed")
        goes_on = continuity(distances, on_map, 10)
        kept[name] = (trust, goes_on, same_nearest(on_map, labels))
        print(f"{name:18} {trust:.3f} {goes_on:.3f} {kept[name][2]:.3f}")
    rivals = [kept[name] for name in layouts]
    assert all(kept["t-SNE"][0] >= one[0] and kept["t-SNE"][2] >= one[2] for one in rivals)


def same_nearest(distances, labels) -> float:
    """The share of clips whose nearest has their label."""
    apart = distances + np.diag(np.full(len(distances), np.inf))
    return np.mean(labels[apart.argmin(axis=0)] == labels)


def test_map_of_many_clips_is_laid_out_by_landmarks(demo, monkeypatch):
    monkeypatch.setattr(library_map, "LANDMARKS", 40)
    table = library_map.library_map(demo)
    ids = table["clip_id"].to_pylist()
    chosen = library_map._landmarks(demo, ids)
    assert len(chosen.clips) == 40
    assert {one["clip_id"] for one in demo.references.to_arrow().to_pylist()} <= {
        ids[k] for k in chosen.clips
    }
    distances = all_distances(demo, ids)
    landmarks = laid_out(distances[np.ix_(chosen.clips, chosen.clips)])
    places = np.stack([table["x"].to_numpy(), table["y"].to_numpy()], axis=1)
    np.testing.assert_array_equal(places[chosen.clips], landmarks)
    for row in set(range(len(ids))) - set(chosen.clips.tolist()):
        near = sorted(range(40), key=lambda k: distances[row, chosen.clips[k]])[:3]
        weights = [distances[row, chosen.clips[k]] ** -2 for k in near]
        slow = sum(weight * landmarks[k] for weight, k in zip(weights, near, strict=True)) / sum(weights)
        np.testing.assert_allclose(places[row], slow, atol=1e-6)
    assert trustworthiness(distances, places, n_neighbors=10, metric="precomputed") > 0.9


@pytest.mark.parametrize("clips", [0, 1, 2, 3, 9])
@pytest.mark.parametrize("apart", [0.0, 1.0])
def test_map_of_any_size(library, clips, apart):
    catalog = library([[apart * k, 0] for k in range(clips)])
    table = library_map.library_map(catalog)
    assert table.num_rows == clips
    x = table["x"].to_numpy()
    assert len(np.unique(x)) == (clips if apart else min(clips, 1))
    figure = cluster_map_figure(catalog)
    shown = [one for trace in figure.data for one in trace.customdata or ()]
    assert shown == table["clip_id"].to_pylist()
    assert ("no clips" in texts(figure)) == (clips == 0)


def test_every_clip_of_the_map_can_be_clicked(demo):
    figure = cluster_map_figure(demo)
    table = {row["clip_id"]: row for row in library_map.library_map(demo).to_pylist()}
    traces = [trace for trace in figure.data if trace.customdata is not None]
    assert Counter(one for trace in traces for one in trace.customdata) == Counter([*table])
    looks = {}
    for trace in traces:
        for one, x, symbol in zip(trace.customdata, trace.x, trace.marker.symbol, strict=True):
            assert x == np.float32(table[one]["x"])
            shape, _, filling = symbol.partition("-")
            looks.setdefault(table[one]["label"], set()).add((trace.marker.color, filling))
            assert shape == source_shapes(row["source"] for row in table.values())[table[one]["source"]]
    assert all(len(one) == 1 for one in looks.values())
    assert len({one for look in looks.values() for one in look}) == len(looks) == 8
    keys = [trace.name for trace in figure.data if trace.showlegend is not False]
    assert [re.sub("[\u2068\u2069]", "", one) for one in keys] == [
        *(f"{one} (10)" for one in sorted(looks)),
        "\u2068cmu-bvh\u2069".strip("\u2068\u2069"),
        "mixamo",
    ]


def test_map_without_labels_and_of_several_roots(library):
    figure = cluster_map_figure(library([[0, 0], [1, 0], [3, 1]], roots=["/a", "/a", "/b"]))
    names = [trace.name for trace in figure.data if trace.showlegend is not False]
    assert names == ["no label (3)", "\u2068/a\u2069", "\u2068/b\u2069"]


def test_map_of_more_labels_than_marks(library):
    """Thousands of labels share a mark, and the legend stays short."""
    many = 1200
    places = np.random.default_rng(0).normal(size=(60, 2))
    catalog = library(places, labels=[f"label {k % 50}" for k in range(60)])
    figure = cluster_map_figure(catalog)
    keys = [trace for trace in figure.data if trace.showlegend is not False]
    assert len(keys) == MOST_LABELS + 1
    assert keys[-1].name == f"{50 - MOST_LABELS} other labels ({60 - MOST_LABELS - 10})"
    marks = label_marks(f"label {k}" for k in range(many))
    assert len(marks) == len(set(marks.values())) == MOST_LABELS


def test_hostile_names_are_text_in_every_chart(library):
    ids = [f"{HOSTILE}{k}" for k in range(3)]
    catalog = library(
        [[0, 0], [1, 0], [3, 1]], labels=[HOSTILE, HOSTILE, None], ids=ids, roots=[HOSTILE, "/a", "/b"],
        scores=[[1.0, 2.0], [0.0, 1.0], [2.0, 0.0]],
    )  # fmt: skip
    for figure in (cluster_map_figure(catalog), style_figure(catalog, 1), confusion_figure(catalog)):
        shown = texts(figure)
        assert any("&lt;script&gt;" in one for one in shown)
        assert not any("<script" in one or "<b>" in one for one in shown)
        assert not any(trace.hovertemplate for trace in figure.data)
        assert (
            "</script>"
            not in figure.to_html(full_html=False, include_plotlyjs=False)
            .split("newPlot")[1]
            .rpartition("</script>")[0]
        )
    clicked = [one for trace in cluster_map_figure(catalog).data for one in trace.customdata or ()]
    assert sorted(clicked) == sorted(ids)


# --- the style space -----------------------------------------------------------------------------------


def test_style_space_shows_the_scores_of_a_cluster(demo):
    styles = [row for row in demo.styles.to_arrow().to_pylist() if row["cluster_id"] == 1]
    figure = style_figure(demo, 1)
    shown = {
        clip: (x, y)
        for trace in figure.data
        if trace.customdata is not None
        for clip, x, y in zip(trace.customdata, trace.x, trace.y, strict=True)
    }
    assert shown == {row["clip_id"]: pytest.approx(tuple(row["scores"][:2])) for row in styles}
    ring = figure.data[-1]
    assert (ring.x[0], ring.y[0]) == pytest.approx(shown[styles[0]["reference_id"]])
    assert f"{styles[0]['explained'][0]:.0%}" in figure.layout.xaxis.title.text
    for axis in (figure.layout.xaxis, figure.layout.yaxis):
        assert "(" not in axis.title.text  # radians and lengths are weighed together: there is no one unit
    assert {trace.legendgrouptitle.text for trace in figure.data[:-1]} == {"style"}
    assert style_figure(demo, 1) == figure


@pytest.mark.parametrize("scores", [[[]], [[], [], []], [[2.0], [-2.0]], [[1.0, 0.5], [0.0, -1], [-1, 0.5]]])
def test_style_space_of_few_axes(library, scores):
    catalog = library(np.zeros((len(scores), 2)), scores=scores)
    figure = style_figure(catalog, 1)
    places = [(x, y) for trace in figure.data[:-1] for x, y in zip(trace.x, trace.y, strict=True)]
    assert places == [pytest.approx((*one, 0.0, 0.0)[:2]) for one in scores]
    titles = (figure.layout.xaxis.title.text, figure.layout.yaxis.title.text)
    assert sum("nothing varies" in one for one in titles) == 2 - len(scores[0])


def test_style_space_of_a_cluster_that_is_not_there(demo, library):
    with pytest.raises(CatalogError, match="no cluster 99 in .*it has 1 to 11"):
        style_figure(demo, 99)
    with pytest.raises(CatalogError, match="it has none"):
        style_figure(library([]), 1)


# --- labels against clusters ---------------------------------------------------------------------------


def test_confusion_agrees_with_a_count_by_hand(demo):
    table = label_counts(demo)
    rows = [one.strip("\u2068\u2069") for one in table.labels]
    columns = [int(one.split()[0]) for one in table.clusters]
    for row in demo.clusters.to_arrow().to_pylist():
        table.counts[rows.index(row["label"]), columns.index(row["cluster_id"])] -= 1
    assert not table.counts.any()
    figure = confusion_figure(demo)
    assert sum(int(cell.split("<br>")[0]) for row in figure.data[0].text for cell in row if cell) == 80
    np.testing.assert_allclose(np.array(figure.data[0].z).sum(axis=1), 1)


def test_confusion_counts_own_labels_only(library):
    assert confusion_figure(library([[0, 0], [1, 0]])) is None
    assert confusion_figure(library([])) is None
    catalog = library([[k, 0] for k in range(4)], labels=["a", "a", None, "b"], clusters=[1, 2, 2, 1])
    assert label_counts(catalog).counts.tolist() == [[1, 1], [1, 0]]


def test_confusion_of_thousands_of_labels_stays_a_picture(library, monkeypatch):
    monkeypatch.setattr(label_confusion, "MOST_ROWS", 5)
    monkeypatch.setattr(label_confusion, "MOST_COLUMNS", 4)
    clips = [(label, 1 + label % 9) for label in range(40) for _ in range(1 + (label < 4))]
    catalog = library(
        np.zeros((len(clips), 2)), [f"label {one:02}" for one, _ in clips], [one for _, one in clips]
    )
    table = label_counts(catalog)
    assert table.counts.shape == (5, 4)
    assert table.counts.sum() == len(clips)
    assert table.labels[:4] == [f"\u2068label {k:02}\u2069" for k in range(4)]
    assert (table.labels[4], table.clusters[3]) == ("36 other labels", "6 other clusters")
    assert table.counts[:4].sum() == 8


# --- thumbnails ----------------------------------------------------------------------------------------

SVG = "{http://www.w3.org/2000/svg}"


def drawn(svg):
    """Read a thumbnail: its title, and each line's colour with its points."""
    root = ElementTree.fromstring(svg)
    assert (root.get("viewBox"), root.get("role")) == ("0 0 160 90", "img")
    lines = [
        (path.get("stroke"), np.array(re.findall(r"-?[\d.]+", path.get("d")), float).reshape(-1, 2))
        for path in root.findall(f"{SVG}path")[1:]
    ]
    heads = [(float(one.get("cx")), float(one.get("cy"))) for one in root.findall(f"{SVG}circle")]
    return root.find(f"{SVG}title").text, lines, heads


@pytest.mark.parametrize("action", ["walk", "jump", "squat", "wave"])
def test_thumbnail_is_a_strip_of_poses(action):
    motion = template(action)
    svg = thumbnail_of(motion)
    title, lines, heads = drawn(svg)
    assert len(svg.encode()) < 6000
    assert motion.name in title
    assert len(heads) == 5
    assert [x for x, _ in heads] == sorted(x for x, _ in heads)
    assert len(lines) == 25
    points = np.concatenate([line for _, line in lines])
    assert (points >= [0, 0]).all()
    assert (points <= [160, 90]).all()
    assert Counter(colour for colour, _ in lines) == {"#0072B2": 10, "#D55E00": 10, "#888888": 5}
    assert len(drawn(thumbnail_of(motion, poses=3))[2]) == 3
    assert thumbnail_of(motion) == svg


def test_thumbnail_does_not_ask_where_a_figure_stands_and_faces():
    motion = template("kick")
    half = np.sqrt(0.5)
    turned = motion.rotations.copy()
    x, y, z, w = np.moveaxis(turned[:, 0], -1, 0)
    turned[:, 0] = np.stack([half * (x + z), half * (y + w), half * (z - x), half * (w - y)], axis=-1)
    root = motion.root_position
    moved = np.stack([root[:, 2] + 70, root[:, 1], -root[:, 0] - 9], axis=1)
    again = replace(motion, rotations=turned, root_position=moved)
    for (_, one), (_, other) in zip(
        drawn(thumbnail_of(motion))[1], drawn(thumbnail_of(again))[1], strict=True
    ):
        np.testing.assert_allclose(one, other, atol=0.11)


def test_thumbnail_sees_three_quarters_from_the_figures_right():
    """The right arm, nearer, is drawn after the left and thicker; a figure that steps forward steps right."""
    svg = thumbnail_of(template("walk"), poses=1)
    paths = re.findall(r'stroke="(#\w+)" stroke-width="([\d.]+)"', svg)
    order = [colour for colour, _ in paths]
    assert order.index("#0072B2") < len(order) - 1 - order[::-1].index("#D55E00")
    assert dict(paths)["#888888"] == "3"
    toes = {colour: line[-1] - line[-2] for colour, line in drawn(svg)[1] if len(line) == 5}
    assert all(foot[0] > 0 for colour, foot in toes.items() if colour != "#888888")


def test_thumbnail_does_not_fall_in_step_with_a_walk():
    """Ten cycles of a swing: of five parts two cycles each, all would show the same moment."""
    names, offsets = ("base", "end"), np.array([[0, 0, 0], [0, 1, 0]], float)
    angle = 0.8 * np.sin(2 * np.pi * np.arange(200) / 20)
    turn = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    rotations = np.stack([turn, np.tile([0.0, 0, 0, 1], (200, 1))], axis=1)
    motion = Motion("swing", Skeleton(names, (-1, 0), offsets), 30, np.zeros((200, 3)), rotations)
    _, lines, _ = drawn(thumbnail_of(motion))
    assert np.ptp([line[1, 0] - line[0, 0] for _, line in lines]) > 10


def test_thumbnail_shows_what_happens_and_not_the_waiting():
    motion = template("squat")
    waiting = np.concatenate(
        [np.zeros(600), np.linspace(0, motion.frames - 1, 60), np.full(600, motion.frames - 1)]
    )
    short = motion.sampled(np.linspace(0, motion.frames - 1, 60))
    heights = [
        np.array([y for _, y in drawn(thumbnail_of(one))[2]]) for one in (short, motion.sampled(waiting))
    ]
    np.testing.assert_allclose(heights[0], heights[1], atol=8)
    assert np.ptp(heights[1]) > 10


@pytest.mark.parametrize("name", [HOSTILE, "\x01\x0b\ufffe]]>", "\ud800 lone", ""])
def test_thumbnail_of_a_hostile_name_is_xml(name):
    svg = thumbnail_of(replace(template("walk"), name=name))
    title, *_ = drawn(svg.encode("utf-8", "strict").decode())
    plain = re.sub("[\x01\x0b\ufffe\ud800]", "\ufffd", name)
    assert title == f"\u2068{plain}\u2069: 5 poses in {template('walk').seconds:.1f} s"
    assert len(svg.encode()) < 6000


def test_thumbnail_of_markers():
    motion = template("walk")
    places = motion.positions() - motion.root_position[:, None]
    markers = replace(motion, rotations=np.empty((motion.frames, 0, 4)), places=places)
    assert thumbnail_of(markers) == thumbnail_of(motion)


def test_thumbnail_of_an_unknown_skeleton_draws_its_bones():
    names = ("base", "tail", "tip", "wing", "hair")
    offsets = np.array([[0, 0, 0], [0, 2, 0], [0, 2, 0], [1, 0, 0], [0, 0.01, 0]], float)
    skeleton = Skeleton(names, (-1, 0, 1, 0, 2), offsets)
    still = np.tile([0.0, 0, 0, 1], (7, 5, 1))
    motion = Motion("dragon", skeleton, 30, np.zeros((7, 3)), still)
    _, lines, heads = drawn(thumbnail_of(motion, poses=2))
    assert heads == []
    assert sorted(len(line) for _, line in lines) == [2, 2, 3, 3]


@pytest.mark.parametrize("frames", [1, 2])
def test_thumbnail_of_a_moment(frames):
    motion = template("jump").sampled(np.arange(frames))
    assert len(drawn(thumbnail_of(motion))[2]) == 5


def test_thumbnail_of_nothing_is_refused():
    with pytest.raises(ValueError, match="poses is 0"):
        thumbnail_of(template("walk"), poses=0)


def test_thumbnail_of_a_clip(demo):
    clip = demo.clips.to_arrow()["clip_id"][0].as_py()
    assert thumbnail_svg(demo, clip) == thumbnail_of(demo.motion(clip))
    assert clip in drawn(thumbnail_svg(demo, clip, poses=2))[0]
    with pytest.raises(CatalogError, match="no clip 'x'"):
        thumbnail_svg(demo, "x")


def test_thumbnails_of_real_clips_are_small(shared_data):
    for path in sorted(shared_data.glob("*/*.bvh"))[::30] + sorted(shared_data.glob("*/*.amc"))[::40]:
        svg = thumbnail_of(read_motion(path))
        _, lines, heads = drawn(svg)
        assert len(svg.encode()) < 6000
        assert len(heads) == 5
