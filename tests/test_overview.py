"""The overview page and its charts, on catalogs of no clip, one, two and many, with and without labels."""

import re
from html.parser import HTMLParser

import numpy as np
import plotly.graph_objects as go
import pyarrow as pa
import pyarrow.compute as pc
import pytest
from plotly.offline import get_plotlyjs
from scipy.cluster.hierarchy import dendrogram, linkage

from motionary.catalog import Catalog
from motionary.catalog.schema import PUBLISHED, SCHEMAS
from motionary.catalog.snapshot import Snapshot, publish
from motionary.catalog.store import Store
from motionary.catalog.views.cluster_table import cluster_table
from motionary.catalog.views.dendrogram import MOST_LEAF_NAMES, dendrogram_figure, lay_out
from motionary.catalog.views.linkages import linkages_by_distance, primary_linkage
from motionary.catalog.views.mu_kappa import mu_kappa_figure, steps
from motionary.catalog.views.overview import overview_page
from motionary.pipeline.clustering import cut_tree
from motionary.pipeline.config import AlignmentConfig, ClusterConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.align import align
from motionary.pipeline.stages.cluster import cluster
from motionary.pipeline.stages.identify import identify
from motionary.pipeline.stages.name import name as name_them
from motionary.pipeline.stages.represent import represent
from motionary.pipeline.stages.style import style

NASTY = '<script>alert("x")</script>&<b>'
NO_LABELS = pa.table({"clip_id": pa.array([], pa.string())})


PLOTLY = get_plotlyjs()


class Page(HTMLParser):
    """What a browser would find in a page: addresses it would fetch, elements, and text to read."""

    def __init__(self, html):
        super().__init__()
        self.fetched, self.elements, self.text = [], [], ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.elements.append(tag)
        names = ("src", "href", "data", "poster", "srcset", "action")
        self.fetched += [value for name, value in attributes if name in names]

    def handle_data(self, data):
        if self.cdata_elem is None:  # not in a script or style
            self.text += data


def make_catalog(folder, demo, clip_ids, labels=NO_LABELS, config=None, quarantine=(), renamed=None):
    """Publish a catalog of some of the demo's clips, clustered anew."""
    config = config or ClusterConfig()
    ids = pa.array(clip_ids, pa.string())

    def own(name, *columns):
        table = getattr(demo, name).to_arrow()
        for column in columns:
            table = table.filter(pc.is_in(table[column], ids))
            for old, new in (renamed or {}).items():
                names = pc.if_else(pc.equal(table[column], old), new, table[column])
                table = table.set_column(table.column_names.index(column), column, names)
        return table

    ingested = own("clips", "clip_id").select(SCHEMAS["ingested"].names).sort_by("clip_id")
    frames, features = own("frames", "clip_id"), own("features", "clip_id")
    pairs = own("pairs", "clip_a", "clip_b")
    none = {name: schema.empty_table() for name, schema in SCHEMAS.items()}
    made = none | cluster(ingested, Parts.of(pairs), labels, none["labels"], config)
    made |= identify(made["groups"], none["members"], none["lineage"], {}, "")
    made |= represent(
        made["members"], ingested, none["centres"], none["reference_features"], Parts.of(pairs),
        Parts.of(features), {}, config, AlignmentConfig(), 2**30,
    )  # fmt: skip
    made |= align(
        ingested, frames, features, made["represented"], made["reference_features"], AlignmentConfig(), 30.0
    )
    clips, aligned = Parts.of(ingested), Parts.of(made["aligned"])
    made |= style(made["represented"], none["styles"], clips, aligned, {}, (), 30.0, 2**30)
    made |= name_them(made["clips"], made["represented"], made["centres"], none["labels"], config)
    made |= {"frames": frames, "features": features, "pairs": pairs, "resampled": own("resampled", "clip_id")}
    made["quarantine"] = pa.Table.from_pylist(list(quarantine), schema=SCHEMAS["quarantine"])
    inputs = own("inputs", "clip_id").drop_columns("batch")
    made["inputs"] = inputs.append_column("batch", pa.array([0] * len(inputs), pa.int32()))
    run = demo.runs.to_arrow().to_pylist()[-1]
    run |= {"clips": len(ingested), "clusters": len(made["references"]), "quarantined": len(quarantine)}
    made["runs"] = pa.Table.from_pylist([run], schema=SCHEMAS["runs"])
    store = Store(str(folder))
    facts = store.save("made", {name: made[name] for name in PUBLISHED})
    files = {name: [store.part_name(name, "made")] for name in PUBLISHED}
    parts = {files[name][0]: facts[name] for name in PUBLISHED}
    publish(store, Snapshot("000001", "2020-01-01T00:00:00+00:00", files, parts), after=None)
    return Catalog.open(str(folder))


@pytest.fixture(scope="module")
def demo(demo_catalog):
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def some_ids(demo):
    """Return twelve of the demo's clips, of three actions."""
    ids = demo.clips.to_arrow()["clip_id"].to_pylist()
    return [one for action in ("jump/", "punch/", "walk/") for one in ids if one.startswith(action)][::3][:12]


@pytest.mark.parametrize("clips", [0, 1, 2, 3, 12])
@pytest.mark.parametrize("labelled", ["none", "all", "some"])
def test_page_of_any_size_fetches_nothing(tmp_path, demo, some_ids, clips, labelled):
    ids = some_ids[:clips]
    named = {"none": [], "all": ids, "some": ids[::2]}[labelled]
    actions = [one.split("/")[0] for one in named]
    labels = pa.table({"clip_id": pa.array(named, pa.string()), "action": pa.array(actions, pa.string())})
    catalog = make_catalog(tmp_path, demo, ids, labels)
    html = overview_page(catalog)
    page = Page(html)
    assert page.fetched == []
    assert "link" not in page.elements
    style = re.search(r"<style>.*?</style>", html, re.DOTALL).group()
    assert "url(" not in style
    assert "@import" not in style
    assert all(one in page.text for one in ids)
    charts = 2 if clips > 1 else 0
    assert html.count(PLOTLY) == bool(charts)
    own = html.replace(PLOTLY, "")
    assert own.count("Plotly.newPlot(") == charts
    assert "http://" not in own
    assert "https://" not in own


def test_page_escapes_every_name(tmp_path, demo, some_ids):
    nasty = {some_ids[0]: NASTY + "1", some_ids[1]: NASTY + "2"}
    labels = pa.table({"clip_id": [NASTY + "1", NASTY + "2"], "action": ["<i>one</i>"] * 2})
    spoiled = [{"path": "<u>a</u>", "line": 3, "reason": "<u>b</u>", "mend": "<u>c</u>"}]
    spoiled[0] |= {"digest": "", "retry": False}
    folder = tmp_path / "<s>takes&"
    catalog = make_catalog(folder, demo, some_ids, labels, quarantine=spoiled, renamed=nasty)
    html = overview_page(catalog)
    page = Page(html)
    assert not {"i", "u", "b", "s"} & set(page.elements)
    assert page.elements.count("script") == Page(overview_page(demo)).elements.count("script")
    assert all(text in page.text for text in (NASTY + "1", "<i>one</i>", "<u>a</u>", "<u>c</u>", "<s>takes&"))
    figure = dendrogram_figure(catalog)
    assert "<script>" not in str(figure.to_dict())
    assert "<i>" not in str(figure.to_dict())


def test_page_is_the_same_again(demo):
    assert overview_page(demo) == overview_page(demo)


def test_cluster_table_agrees_with_a_count_by_hand(demo):
    clusters = demo.clusters.to_pandas().merge(demo.clips.to_pandas()[["clip_id", "action"]])
    rows = cluster_table(demo).to_pylist()
    assert [one["cluster_id"] for one in rows] == sorted(clusters["cluster_id"].unique())
    for one in rows:
        inside = clusters[clusters["cluster_id"] == one["cluster_id"]]
        assert one["size"] == len(inside)
        assert one["labelled"] == inside["label_source"].isin(["supplied", "override"]).sum()
        assert one["purity"] == pytest.approx(inside["action"].value_counts().iloc[0] / len(inside))
        assert inside.loc[inside["is_reference"], "clip_id"].tolist() == [one["reference"]]


@pytest.mark.parametrize("primary", ["ward", "complete", "average", "fuzzy"])
def test_kept_linkages_are_those_of_the_distances(tmp_path, demo, some_ids, primary):
    catalog = make_catalog(tmp_path, demo, some_ids, config=ClusterConfig(primary=primary))
    curves = linkages_by_distance(catalog)
    assert [one.cut["metric"] for one in curves] == ["dtw", "b_dtw", "weighted", "fuzzy"]
    kept = primary_linkage(catalog)
    assert kept.cut["method"] == primary
    published = np.array(catalog.clusters.to_arrow()["cluster_id"].to_pylist())
    again = cut_tree(kept.Z, n_clusters=published.max())
    np.testing.assert_array_equal(published, again + 1)
    assert mu_kappa_figure(catalog) is not None


@pytest.mark.parametrize("seed", range(5))
def test_tree_is_laid_out_as_scipy_does(seed):
    points = np.random.default_rng(seed).normal(size=(20, 2))
    Z = linkage(points, "complete")
    clusters = cut_tree(Z, n_clusters=4) + 1
    tree = lay_out(Z, clusters)
    theirs = dendrogram(Z, no_plot=True)
    assert np.argsort(tree.place[:20]).tolist() == theirs["leaves"]
    # SciPy's leaves stand 10 apart, from 5; its brackets come in another order
    brackets = sorted((left, right) for left, *_, right in theirs["icoord"])
    ours = sorted((10 * tree.place[left] + 5, 10 * tree.place[right] + 5) for left, right in tree.children)
    np.testing.assert_allclose(ours, brackets)
    np.testing.assert_array_equal(tree.height[20:], Z[:, 2])
    for node in range(20, 39):
        below = _leaves_below(Z, node)
        shared = {int(clusters[leaf]) for leaf in below}
        assert tree.cluster_id[node] == (shared.pop() if len(shared) == 1 else 0)


def _leaves_below(Z, node):
    clips = len(Z) + 1
    if node < clips:
        return [node]
    return [leaf for child in Z[node - clips, :2] for leaf in _leaves_below(Z, int(child))]


def test_tree_of_a_long_chain_is_laid_out():
    clips = 3000
    merge = np.arange(clips - 1)
    chain = np.where(merge == 0, 0, clips + merge - 1)
    Z = np.stack([chain, merge + 1, merge + 1, merge + 2], axis=1).astype(float)
    tree = lay_out(Z, np.ones(clips, np.int64))
    assert sorted(tree.place[:clips]) == list(range(clips))


def test_cut_line_parts_the_published_clusters(demo):
    figure = dendrogram_figure(demo)
    mu = figure.layout.shapes[0].x0
    published = demo.clusters.to_arrow()["cluster_id"].to_numpy()
    np.testing.assert_array_equal(cut_tree(primary_linkage(demo).Z, threshold=mu) + 1, published)
    assert len(published) <= MOST_LEAF_NAMES
    assert len(figure.layout.yaxis.ticktext) == len(published)


def test_steps_say_how_many_clusters_a_threshold_leaves():
    Z = linkage(np.random.default_rng(1).normal(size=(15, 2)), "ward")
    mu, kappa = steps(Z)
    for one in np.linspace(0, 1, 50):
        shown = kappa[np.searchsorted(mu, one, side="right") - 1]
        assert shown == cut_tree(Z, threshold=one * Z[-1, 2] * (1 + 1e-12)).max() + 1


def test_equal_clips_have_a_chart():
    mu, kappa = steps(np.array([[0.0, 1.0, 0.0, 2.0], [2.0, 3.0, 0.0, 3.0]]))
    assert mu.tolist() == [0.0, 1.05]
    assert kappa.tolist() == [1.0, 1.0]


def test_charts_show_in_a_notebook(demo):
    assert isinstance(dendrogram_figure(demo), go.Figure)
    assert isinstance(mu_kappa_figure(demo), go.Figure)
