"""The pages of a catalog as answered: what they hold, what they refuse, and when they are made anew."""

import base64
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest

from motionary.catalog import Catalog
from motionary.catalog.store import Store
from motionary.catalog.views.charts import CONFIG
from motionary.catalog.web import opened as opened_module
from motionary.catalog.web import static_files
from motionary.catalog.web.opened import CatalogGone, Opened
from motionary.catalog.web.search import PAGE, page_of
from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.config import ClusterConfig, DistanceConfig, PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from motionary.workflows.relabel import relabel
from tests.catalogs import copied
from tests.web.hostile import LABELS, NAMES, hostile_catalog
from tests.web.serving import editor_of, served

UNSHOWN = ("customdata", "ids", "legendgroup")  # of a trace of Plotly
WALK, RUN = "walk/walk_tired_alex_01.bvh", "run/run_tired_bea_01.bvh"


@pytest.fixture(scope="module")
def client(demo_catalog):
    with served(demo_catalog) as client:
        yield client


@pytest.fixture(scope="module")
def catalog(demo_catalog):
    with Catalog.open(demo_catalog) as catalog:
        yield catalog


@pytest.fixture(scope="module")
def hostile(demo_library, tmp_path_factory, silent_progress):
    folder = tmp_path_factory.mktemp("hostile")
    with served(hostile_catalog(demo_library, folder, silent_progress)) as client:
        yield client


@pytest.fixture(scope="module")
def by_landmarks(demo_library, tmp_path_factory, silent_progress):
    config = PipelineConfig(clusters=ClusterConfig(landmarks=12), distances=DistanceConfig(pairs="landmarks"))
    url = str(tmp_path_factory.mktemp("landmarks") / "catalog")
    run(Job([str(demo_library)], url, config, demo_library / "labels.csv"), silent_progress)
    with served(url) as client:
        yield client


class Read(HTMLParser):
    """Which elements a page has, their attributes, and its text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.text += data

    def values(self, name: str) -> list[str]:
        return [found[name] for _, found in self.elements if name in found]


def read(client, path: str, status: int = 200, **query) -> Read:
    answer = client.get(path, params=query or None)
    assert answer.status_code == status, answer.text
    return Read(answer.text)


@pytest.mark.parametrize("path", ["/", "/clusters"])
def test_clusters_by_landmarks_are_told_to_be_approximate(by_landmarks, client, path):
    assert "Approximate: clusters from 12 landmarks of 80 clips" in read(by_landmarks, path).text
    assert "Approximate" not in read(client, path).text


def test_without_all_pairs_the_map_says_why_there_is_none(by_landmarks, client):
    page = read(by_landmarks, "/map")
    assert "A map needs all pairs: this run compared those of its landmarks" in page.text
    assert "lie together" not in page.text
    assert not any("name=map" in url for url in page.values("data-chart"))
    assert any("name=map" in url for url in read(client, "/map").values("data-chart"))


def test_the_review_says_what_landmarks_leave_open(by_landmarks, client):
    told = "looked for among the 12 landmarks alone"
    assert told in read(by_landmarks, "/review").text
    assert told not in read(client, "/review").text


def clips_on(page: Read) -> list[str]:
    return [found["data-clip"] for tag, found in page.elements if tag == "li" and "data-clip" in found]


# what the pages hold


def test_start_shows_figures_names_and_the_largest_clusters(client, catalog):
    page = read(client, "/")
    about = catalog.describe()
    for told in (about.clips, about.clusters, *about.names):
        assert str(told) in page.text
    references = {row["clip_id"] for row in catalog.references.to_arrow().to_pylist()}
    assert set(page.values("data-play")) == references


def test_words_all_have_to_be_in_the_path_the_name_or_a_label(client, catalog):
    found = clips_on(read(client, "/search", q="TIRED walk"))
    expected = catalog.sql(
        "select clip_id from takes where style = 'tired' and 'walk' in (label, action) order by clip_id"
    )
    assert found == expected["clip_id"].to_pylist()
    assert found
    assert clips_on(read(client, "/search", q="walk nonsense")) == []


def test_wildcards_of_sql_are_letters_in_words(client):
    assert clips_on(read(client, "/search", q="walk%tired")) == []
    assert clips_on(read(client, "/search", q="' or 1=1 --")) == []


def test_a_condition_chooses_as_the_catalog_does(client, catalog):
    condition = "seconds > 2.5 and (label like 'w%k' or cluster_id in (1, 2))"
    expected = [one for one in catalog.where(condition).clip_ids if "alex" in one]
    assert clips_on(read(client, "/search", q="alex", where=condition)) == expected
    assert expected


@pytest.mark.parametrize(
    ("condition", "told"),
    [
        ("secs > 3", "seconds"),
        ("seconds >", "syntax error"),
        ("cast(label as int) > 3", "Conversion"),
        ("seconds > $least", "parameter"),
        ("true); drop table clips; --", "syntax error"),
        ("clip_id in (select clip_a from pairs)", "no subquery"),
        ("len(range(4000000000)) > 0", "no function range"),
    ],
)
def test_a_wrong_condition_is_told_beside_the_box(client, condition, told):
    page = read(client, "/search", q="walk", where=condition)
    assert told in page.text
    assert condition in page.values("value")
    assert "true" in page.values("aria-invalid")
    assert clips_on(page) == []


def test_more_words_than_anybody_means_are_told(client):
    words = " ".join(f"w{number}" for number in range(2000))
    assert "2,000 words are asked for at once" in read(client, "/search", q=words).text
    assert client.get("/data/search", params={"q": words}).json() == {"clips": [], "total": 0}


def test_what_looks_like_a_condition_is_offered_as_one(client):
    page = read(client, "/search", q="label = 'walk'")
    assert "/search?where=label+%3D+%27walk%27" in page.values("href")


def test_every_clip_is_on_one_page_of_the_list(client, catalog):
    first, second = (clips_on(read(client, "/search", page=number)) for number in (1, 2))
    assert len(first) == PAGE
    assert first + second == sorted(catalog.clips.to_arrow()["clip_id"].to_pylist())
    assert clips_on(read(client, "/search", page=99)) == second


def test_a_page_is_cut_out_of_rows():
    assert page_of([], 1).pages == 1
    assert page_of(range(PAGE), 2).number == 1
    assert list(page_of(range(PAGE + 1), 2).rows) == [PAGE]


def test_a_cluster_lists_its_clips_nearest_first(client, catalog):
    row = catalog.references.to_arrow().to_pylist()[0]
    page = read(client, "/cluster", id=row["cluster_id"])
    members = catalog.filter(cluster_id=row["cluster_id"]).to_arrow().to_pylist()
    members.sort(key=lambda one: (not one["is_reference"], one["distance_to_reference"], one["clip_id"]))
    assert clips_on(page) == [one["clip_id"] for one in members]
    assert clips_on(page)[0] == row["clip_id"]


def test_a_clip_comes_with_its_neighbours_and_its_reference(client, catalog):
    page = read(client, "/clip", id=WALK)
    similar = catalog.similar(WALK, 12).table
    assert clips_on(page) == similar["clip_id"].to_pylist()
    for distance in similar["distance"].to_pylist():
        assert f"{distance:.3f}" in page.text
    alignment = catalog.sql("from alignments where clip_id = ?", [WALK]).to_pylist()[0]
    assert (
        urlencode({"clip": [alignment["reference_id"], WALK]}, doseq=True) in page.values("data-scene-url")[0]
    )
    assert f"{alignment['correlation']:.3f}" in page.text


def test_a_label_says_where_it_comes_from(demo_catalog, tmp_path):
    url = copied(demo_catalog, tmp_path)
    with served(url, editor=editor_of(url, "ada")) as client:
        assert "the label that came with the library" in read(client, "/clip", id=WALK).text
        client.post("/edit/relabel", json={"clip": WALK, "label": "trudge"}).raise_for_status()
        page = read(client, "/clip", id=WALK)
        assert "trudge" in page.text
        assert "ada said so on" in page.text


def test_a_comparison_is_the_explanation(client, catalog):
    page = read(client, "/compare", a=WALK, b=RUN)
    why = catalog.explain(WALK, RUN)
    assert f"{why.distances['weighted']:.4f}" in page.text
    name, most = max(why.contributions["weighted"].items(), key=lambda one: one[1])
    assert name.replace("_", " ") in page.text
    assert f"{most:.4f}" in page.text
    assert f"{100 * most / why.distances['weighted']:.1f} %" in page.text


@pytest.mark.parametrize("query", [{}, {"a": WALK}, {"a": WALK, "b": WALK}])
def test_a_comparison_of_fewer_clips_asks_for_the_others(client, query):
    page = read(client, "/compare", **query)
    assert len([one for one in page.elements if one[1].get("data-suggest") == "clips"]) == 2


# data


def test_a_scene_is_of_the_clips_asked_for(client):
    made = client.get("/data/scene", params={"clip": [WALK, RUN], "layout": "overlaid"}).json()
    assert [one["clip_id"] for one in made["figures"]] == [WALK, RUN]
    assert made["layout"] == "overlaid"
    assert client.get("/data/figure", params={"clip": WALK}).json() == made["figures"][0]


def test_a_pair_is_warped_to_its_first(client, catalog):
    made = client.get("/data/pair", params={"a": WALK, "b": RUN}).json()["figures"]
    times = [np.frombuffer(base64.b64decode(one["warp"]["times"]), "<f4") for one in made]
    why = catalog.explain(WALK, RUN)
    np.testing.assert_allclose(times[0], np.arange(len(times[0])) / 30, atol=1e-6)
    np.testing.assert_allclose(
        times[1], np.interp(times[0], why.warp.seconds_a, why.warp.seconds_b), atol=1e-5
    )
    assert {one["warp"]["reference"] for one in made} == {WALK}


@pytest.mark.parametrize(
    "query",
    [
        {"name": "map"},
        {"name": "style", "cluster": 1},
        {"name": "warp", "clip": WALK},
        {"name": "trajectory", "clip": WALK, "joint": "head"},
        {"name": "curve", "a": WALK, "b": RUN},
        {"name": "costs", "a": WALK, "b": RUN, "threshold": "0.55"},
    ],
)
def test_charts_are_sent_with_how_they_are_shown(client, query):
    made = client.get("/data/chart", params=query).json()
    assert made["data"]
    assert made["config"].items() >= CONFIG.items()


def test_the_map_knows_the_clip_of_every_point(client, catalog):
    made = client.get("/data/chart", params={"name": "map"}).json()
    points = [one for trace in made["data"] for one in trace.get("customdata") or ()]
    assert sorted(points) == sorted(catalog.clips.to_arrow()["clip_id"].to_pylist())


def test_suggestions_are_the_first_found(client):
    made = client.get("/data/search", params={"q": "walk tired"}).json()
    assert made["clips"] == clips_on(read(client, "/search", q="walk tired"))[:10]
    assert made["total"] >= len(made["clips"])


@pytest.mark.parametrize(
    ("path", "query", "status"),
    [
        ("/clip", {"id": "walk/walk_tired_alex_1.bvh"}, 404),
        ("/clip", {}, 400),
        ("/cluster", {"id": "99"}, 404),
        ("/cluster", {"id": "1; drop"}, 404),
        ("/cluster", {"id": "0000000019999"}, 404),
        ("/cluster", {"id": "9" * 5000}, 404),
        ("/compare", {"a": WALK, "b": "no such"}, 404),
        ("/search", {"page": "x"}, 400),
        ("/data/thumbnail", {"clip": "../../CURRENT"}, 404),
        ("/data/scene", {"clip": [WALK] * 9}, 400),
        ("/data/scene", {}, 400),
        ("/data/chart", {"name": "nonsense"}, 404),
        ("/data/chart", {"name": "trajectory", "clip": WALK, "joint": "tail"}, 400),
        ("/data/chart", {"name": "costs", "a": WALK, "b": RUN, "threshold": "2"}, 400),
        ("/static/nothing.js", {}, 404),
        ("/static/../app.py", {}, 404),
        ("/static/%2e%2e%2fapp.py", {}, 404),
        ("/nonsense", {}, 404),
    ],
)
def test_what_is_not_there_is_told_with_the_mend(client, path, query, status):
    answer = client.get(path, params=query)
    assert answer.status_code == status
    told = answer.json()["error"] if path.startswith("/data/") else Read(answer.text).text
    assert len(told.split()) > 3
    assert "Traceback" not in told


def test_a_number_with_zeros_before_it_is_that_number(client):
    assert read(client, "/cluster", id="0000000000001").text == read(client, "/cluster", id="1").text


def test_what_is_no_static_file_is_not_remembered():
    before = static_files._read.cache_info().currsize
    assert static_files.static_file("style.css") is not None
    assert [static_files.static_file(f"no-{number}") for number in range(20)] == [None] * 20
    assert static_files._read.cache_info().currsize <= before + 1


def test_a_damaged_file_is_not_a_clip_that_is_not_there(demo_catalog, tmp_path):
    url = copied(demo_catalog, tmp_path)
    with served(url) as client:
        for file in Path(url, "tables", "clips").glob("*.parquet"):
            file.write_bytes(b"no parquet")
        for path in ("/clip", "/data/figure"):
            answer = client.get(path, params={"id": WALK, "clip": WALK})
            assert answer.status_code == 500
            assert "verify" in answer.text or "damaged" in answer.text


def test_a_misspelt_clip_is_answered_with_the_nearest(client):
    assert WALK in read(client, "/clip", 404, id="walk/walk_tired_alex_1.bvh").text


# hostile names


def every_page() -> list[tuple[str, dict]]:
    ones = [
        [("/clip", {"id": name}), ("/compare", {"a": name}), ("/review", {"clip": name})] for name in NAMES
    ]
    searched = [("/search", {"q": name, "where": f"label = {name!r}", "with": NAMES[0]}) for name in NAMES]
    pairs = [("/compare", {"a": a, "b": b}) for a, b in zip(NAMES, NAMES[1:], strict=False)]
    fixed = ["/", "/clusters", "/search", "/map", "/review", "/drop", "/compare"]
    clusters = [("/cluster", {"id": 1}), ("/cluster", {"id": 2})]
    wrong = [("/clip", {"id": f"no {name}"}) for name in NAMES]
    return [(path, {}) for path in fixed] + clusters + sum(ones, []) + searched + pairs + wrong


def test_hostile_names_are_text_on_every_page(hostile):
    seen = ""
    for path, query in every_page():
        answer = hostile.get(path, params=query or None)
        assert answer.status_code < 500, (path, query, answer.text)
        page = Read(answer.text)
        sources = [found for tag, found in page.elements if tag == "script"]
        assert all(
            found.get("src", "").startswith("/static/") or "json" in found["type"] for found in sources
        )
        assert "b" not in {tag for tag, _ in page.elements}, path
        assert not [name for _, found in page.elements for name in found if name.startswith("on")], path
        assert all(value.startswith(("/", "#")) for name in ("href", "src") for value in page.values(name)), (
            path
        )
        seen += page.text
    for name in (*NAMES, *LABELS):
        assert name in seen


def test_links_of_hostile_names_lead_to_them(hostile):
    for name in NAMES:
        page = read(hostile, "/clip", id=name)
        assert [found["data-clip"] for tag, found in page.elements if tag == "h1"] == [name]
        for path in [*page.values("data-scene-url"), *page.values("data-chart"), *page.values("src")]:
            assert hostile.get(path).status_code == 200, path
        neighbours = [path for path in page.values("href") if path.startswith("/clip?")]
        assert neighbours
        assert all(hostile.get(path).status_code == 200 for path in neighbours)


def test_text_in_charts_of_hostile_names_is_escaped(hostile):
    for query in (
        {"name": "map"},
        {"name": "warp", "clip": NAMES[0]},
        {"name": "curve", "a": NAMES[0], "b": NAMES[1]},
        {"name": "costs", "a": NAMES[1], "b": NAMES[0]},
        {"name": "style", "cluster": 1},
        *({"name": "trajectory", "clip": NAMES[1], "joint": joint} for joint in CANONICAL_JOINTS[:1]),
    ):
        made = hostile.get("/data/chart", params=query).json()
        for trace in made["data"]:
            shown = {name: value for name, value in trace.items() if name not in UNSHOWN}
            assert not re.search(r"<(script|img|b onclick)", str(shown)), query
        assert not re.search(r"<(script|img|b onclick)", str(made["layout"])), query


# snapshots, caches


def test_a_thumbnail_is_kept_by_the_browser_until_the_motions_change(client):
    url = [one for one in read(client, "/clip", id=WALK).values("src") if "thumbnail" in one][0]
    answer = client.get(url)
    assert answer.headers["cache-control"] == "private, max-age=31536000, immutable"
    assert answer.text.startswith("<svg")
    again = client.get(url, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert client.get("/data/thumbnail", params={"clip": WALK, "of": "old"}).headers["cache-control"] == (
        "private, no-cache"
    )


@pytest.fixture
def looked_up_always(monkeypatch):
    """Have every request look which snapshot is published."""
    monkeypatch.setattr(opened_module, "LOOK_EVERY", 0.0)


def test_a_published_snapshot_is_shown_when_it_is_looked_up(demo_catalog, tmp_path, looked_up_always):
    url = copied(demo_catalog, tmp_path)
    with served(url) as client:
        before = read(client, "/clip", id=WALK)
        relabel(url, {WALK: "trudge"}, "ada")
        after = read(client, "/clip", id=WALK)
        assert "trudge" not in before.text
        assert "trudge" in after.text
        assert clips_on(read(client, "/search", q="trudge")) == [WALK]
        thumbnails = [[one for one in page.values("src") if "thumbnail" in one] for page in (before, after)]
        assert thumbnails[0] == thumbnails[1]  # a label moves nobody
        assert before.values("data-scene-url") != after.values("data-scene-url")


def test_a_catalog_that_goes_is_an_error_page_and_comes_again(demo_catalog, tmp_path, looked_up_always):
    url = copied(demo_catalog, tmp_path)
    with served(url) as client:
        read(client, "/clip", id=WALK)
        shutil.move(url, tmp_path / "elsewhere")
        for path in ("/", f"/clip?id={WALK}", "/search?q=walk", "/map", "/clusters"):
            assert "motionary run LIBRARY" in read(client, path, 503).text
        assert "error" in client.get("/data/figure", params={"clip": WALK}).json()
        shutil.move(tmp_path / "elsewhere", url)
        read(client, "/clip", id=WALK)


def test_files_that_go_under_it_are_an_error_page(demo_catalog, tmp_path):
    url = copied(demo_catalog, tmp_path)
    with served(url) as client:
        shutil.rmtree(f"{url}/tables/frames")
        read(client, "/")
        assert client.get("/data/figure", params={"clip": WALK}).status_code == 500
        shutil.rmtree(f"{url}/tables/pairs")
        assert "damaged or gone" in read(client, "/clip", 500, id=WALK).text


def test_what_was_never_a_catalog_is_not_opened(tmp_path):
    with pytest.raises(CatalogGone, match="motionary run LIBRARY"):
        Opened(str(tmp_path)).shown()


def test_a_request_ends_on_the_snapshot_it_began_with(demo_catalog, tmp_path, looked_up_always):
    url = copied(demo_catalog, tmp_path)
    opened = Opened(url)
    before = opened.shown()
    relabel(url, {WALK: "trudge"}, "ada")
    after = opened.shown()
    assert opened.shown() is after
    query = "select label from clusters where clip_id = ?"
    assert [one.catalog.sql(query, [WALK])["label"][0].as_py() for one in (before, after)] == [
        "walk",
        "trudge",
    ]


def test_an_empty_catalog_is_shown(tmp_path, publish_rows):
    url = str(tmp_path / "catalog")
    publish_rows(Store(url), runs=[{"run_id": "one", "settings": "{}"}])
    with served(url) as client:
        assert "nothing to look at" in read(client, "/").text
        for path in ("/clusters", "/search", "/map", "/compare"):
            read(client, path)


def test_pages_use_nothing_from_elsewhere_and_no_script_within(client):
    for path in (
        "/",
        "/search?q=walk",
        "/cluster?id=1",
        f"/clip?id={WALK}",
        f"/compare?a={WALK}&b={RUN}",
        "/map",
    ):
        page = read(client, path)
        for name in ("src", "href", "action", "data-scene-url", "data-chart"):
            assert all(value.startswith(("/", "#")) for value in page.values(name))
        assert all(found.get("src") for tag, found in page.elements if tag == "script")
