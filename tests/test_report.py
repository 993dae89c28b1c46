"""The report of a run: what it shows, what it leaves out, and that names in it are but text."""

import base64
import gzip
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import plotly.graph_objects as go
import pytest
from plotly.offline import get_plotlyjs

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.history import diff
from motionary.catalog.store import Store
from motionary.catalog.vacuum import vacuum
from motionary.catalog.views.figures import clip_figure
from motionary.catalog.views.report import cards as report_cards
from motionary.catalog.views.report import review as report_review
from motionary.catalog.views.report.cards import cluster_cards, takes_by_importance
from motionary.catalog.views.report.changes import (
    MOST_ROWS,
    changes_section,
    changes_since,
    changes_since_last,
)
from motionary.catalog.views.report.footage import footage_of
from motionary.catalog.views.report.packed import packed_chart, packed_plotly
from motionary.catalog.views.report.page import report_page
from motionary.catalog.views.sections import heading
from motionary.pipeline.config import FeatureConfig, PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from motionary.workflows.relabel import relabel
from tests.catalogs import copied

MOST_BYTES = 10_000_000
HOSTILE = [
    "<script>alert(1)<",  # a folder, so that the next part closes the element
    "script><img src=x onerror=alert(2)>.bvh",
    "\"quoted\" 'twice' & 100% ? # $HOME `id`.bvh",
    "\u202eהליכה مشي.bvh",
    "new\nline.bvh",
    "very " * 48 + "long.bvh",
]


class Page(HTMLParser):
    """What a browser would find in a page: elements, ids, addresses, headings, text to read, data."""

    def __init__(self, html):
        super().__init__()
        self.elements, self.ids, self.addresses, self.headings = [], [], [], []
        self.text, self.data, self.listeners = "", {}, []
        self._script = None
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.elements.append(tag)
        self.ids += [found["id"]] if "id" in found else []
        self.addresses += [found[one] for one in ("src", "href", "action", "data", "poster") if one in found]
        self.listeners += [one for one in found if one.startswith("on")]
        self.headings += [int(tag[1])] if re.fullmatch("h[1-6]", tag) else []
        self._script = found.get("id") if tag == "script" else None

    def handle_data(self, data):
        if self.cdata_elem is None:
            self.text += data
        elif self._script:
            self.data[self._script] = self.data.get(self._script, "") + data


@pytest.fixture(scope="module")
def made(demo_library, silent_progress, tmp_path_factory):
    """Return a way of making a catalog of some of the embedded clips, under other names perhaps."""

    def make(names, labelled=True, folder=None, **config):
        folder = folder or tmp_path_factory.mktemp("made")
        library = folder / "library"
        shutil.rmtree(library, ignore_errors=True)
        library.mkdir()
        (library / "broken.bvh").write_text("HIERARCHY\nnothing\n")
        for name, file in names.items():
            (library / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(demo_library / file, library / name)
        pattern = "(?P<action>walk|squat|<i>.*</i>)" if labelled else None
        job = Job(
            [str(library)],
            str(folder / "catalog"),
            PipelineConfig(**config),
            label_pattern=pattern,
            workers=1,
        )
        run(job, silent_progress)
        return Catalog.open(str(folder / "catalog"))

    return make


@pytest.fixture(scope="module")
def some(demo_library):
    """Return eight clips of two actions."""
    return [
        file.relative_to(demo_library).as_posix()
        for action in ("walk", "squat")
        for file in sorted((demo_library / action).glob("*.bvh"))[:4]
    ]


@pytest.fixture(scope="module")
def demo(demo_catalog):
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def demo_page(demo):
    return report_page(demo)


def check(html):
    """Check what must be so in every report, and return it as read."""
    page = Page(html)
    assert len(html.encode()) < MOST_BYTES
    assert len(page.ids) == len(set(page.ids))
    assert all(one.startswith("#") and one[1:] in page.ids for one in page.addresses)
    assert not page.listeners
    assert {"header", "nav", "main"} <= set(page.elements)
    assert page.headings[0] == 1
    assert page.headings.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(page.headings, page.headings[1:], strict=False))
    own = html.replace("http://www.w3.org/2000/svg", "")
    assert "http://" not in own
    assert "https://" not in own
    assert "url(" not in re.findall("<style>.*?</style>", html, re.DOTALL)[-1]
    return page


@pytest.mark.parametrize(
    ("clips", "labelled"), [(0, False), (1, False), (1, True), (2, False), (2, True), (8, False), (8, True)]
)
def test_page_of_any_size(made, some, clips, labelled):
    catalog = made({name: name for name in some[:clips]}, labelled)
    page = check(report_page(catalog))
    assert all(one in page.text for one in some[:clips])
    assert page.text.count("broken.bvh") == 1
    assert ("plotly" in page.data) == (clips > 1 or labelled)
    assert ("labels" in page.ids) == labelled


def test_every_cluster_plays_its_reference_tightest_and_loosest(demo, demo_page):
    page = check(demo_page)
    figures = json.loads(page.data["figures"])
    rows = demo.clusters.to_pandas().sort_values("distance_to_reference")
    for cluster_id, inside in rows.groupby("cluster_id"):
        reference = inside.loc[inside["is_reference"], "clip_id"].item()
        others = inside.loc[~inside["is_reference"], "clip_id"].tolist()
        shown = re.search(
            rf'<article class="card" id="cluster-{cluster_id}".*?</article>', demo_page, re.DOTALL
        )
        played = re.findall(r'data-stage="([^"]*)" data-figures="([^"]*)"', shown.group())
        wanted = [[reference], *([reference, one] for one in dict.fromkeys([others[0], others[-1]]))]
        assert [names.split() for _, names in played] == [[figures[one] for one in clips] for clips in wanted]
        assert {stage for stage, _ in played} == {f"cluster-{cluster_id}-stage"}
        assert all(one in page.text for one in inside["clip_id"])
    for clip_id, name in [*figures.items()][::7]:
        assert json.loads(page.data[name]) == clip_figure(demo, clip_id, slim=True).to_dict()


def test_the_same_page_again(demo, demo_page):
    assert report_page(demo) == demo_page


def test_what_does_not_fit_is_a_picture(demo):
    wanted = list(takes_by_importance(cluster_cards(demo)))
    sizes = {name: len(text) for name, text in zip(wanted, footage_of(demo, wanted).elements, strict=True)}
    room = sum([*sizes.values()][:5]) - 1  # the fifth does not fit, and a shorter one may
    footage = footage_of(demo, wanted, room)
    assert sum(map(len, footage.elements)) <= room
    assert [*footage.figures][:4] == wanted[:4]
    assert wanted[4] not in footage.figures
    assert footage.thumbnails.keys() == set(wanted)
    assert "<button" in footage.button("stage", "Play", "", wanted[0])
    assert "<button" not in footage.button("stage", "Play", "", wanted[0], wanted[4])
    assert "<svg" in footage.button("stage", "Play", "", wanted[0], wanted[4])


def test_pictures_without_a_button_are_counted(demo):
    cards = cluster_cards(demo)
    footage = footage_of(demo, takes_by_importance(cards))
    assert "no room" not in report_cards.cards_section(cards, footage)
    without = {clip: name for clip, name in footage.figures.items() if clip != cards[0].row["reference"]}
    text = report_cards.cards_section(cards, replace(footage, figures=without))
    assert text.count('class="still"') - text.count('class="take"') == 3  # what it is shown beside as well
    assert "Takes that have no room on this page and are pictures only: 3." in text


def test_a_large_catalog_says_what_is_left_out(demo, monkeypatch):
    monkeypatch.setattr(report_cards, "MOST_CARDS", 3)
    monkeypatch.setattr(report_cards, "_MOST_CLUSTERS", 7)
    monkeypatch.setattr(report_cards, "_MOST_MEMBERS", 4)
    monkeypatch.setattr(report_review, "MOST_CLIPS", 79)
    html = report_page(demo)
    page = check(html)
    assert page.elements.count("article") == 3
    shown = [clip["clip_id"] for card in cluster_cards(demo)[:3] for clip in card.takes.values()]
    assert json.loads(page.data["figures"]).keys() == set(shown)
    assert "Only the 3 largest of the 11 clusters" in page.text
    assert "4 clusters more" in page.text
    assert "The 4 nearest of 10 clips" in page.text
    assert "Left out: of 80 clips it takes minutes" in page.text


@pytest.fixture(scope="module")
def hostile(made, some):
    first, second, *names = HOSTILE
    named = [f"{first}/{second}", *names]
    files = {f"<i>walk</i>/{name}": file for name, file in zip(named, some, strict=False)}
    return made(files | {name: name for name in some[-2:]})


def test_hostile_names_are_text(hostile):
    html = report_page(hostile)
    page = check(html)
    clips = hostile.clips.to_arrow()["clip_id"].to_pylist()
    assert len(clips) == len(HOSTILE) + 1
    assert all(one in page.text for one in clips)
    assert "<i>walk</i>" in page.text
    assert not {"i", "img", "b"} & set(page.elements)
    scripts = len(page.data) + 1  # the module is the one without an id
    assert page.elements.count("script") == scripts
    assert {json.loads(page.data[name])["clip_id"] for name in json.loads(page.data["figures"]).values()} <= {
        *clips
    }


def test_changes_are_those_of_diff(made, some, tmp_path):
    one, two, three, *rest = some
    made({name: name for name in some}, folder=tmp_path)
    relabel(str(tmp_path / "catalog"), {rest[0]: "amble"}, "a test", lambda dead: None)
    again = {name: name for name in rest} | {
        "walk/renamed.bvh": one,
        two: three,
        "walk/another.bvh": some[-1],
    }
    catalog = made(again, folder=tmp_path)
    before = Catalog.open(str(tmp_path / "catalog"), 1)
    changes = diff(before, catalog)
    assert [len(one) for one in (changes.renamed, changes.changed, changes.relabelled)] == [1, 1, 1]
    html = report_page(catalog, changes_since(catalog, before))
    assert "Since snapshot 000001 of" in check(html).text
    told = html[html.index('<section id="changes">') : html.index('<section id="clusters">')]
    assert "amble" in told
    rows = {name: getattr(changes, name).to_pylist() for name in _SHOWN}
    assert sorted(_table_rows(told)) == sorted(
        [str(row[column] or "no name") for column in _SHOWN[name]] for name in rows for row in rows[name]
    )
    assert "Since snapshot 000002 of" in check(report_page(catalog, changes_since_last(catalog))).text


_SHOWN = {
    "added": ["clip_id"],
    "removed": ["clip_id"],
    "renamed": ["clip_id", "previous_clip_id"],
    "changed": ["clip_id"],
    "moved": ["clip_id", "previous_cluster_id", "cluster_id"],
    "relabelled": ["clip_id", "previous_label", "label", "label_source"],
    "references": ["cluster_id", "previous_clip_id", "clip_id"],
}


def _table_rows(html):
    """Return the cells of every row of every table, as text."""
    rows = re.findall("<tr><td.*?</tr>", html)
    return [[Page(cell).text for cell in re.findall("<td[^>]*>(.*?)</td>", row)] for row in rows]


def test_every_kind_of_change_is_shown(publish_rows, tmp_path):
    def published(clips, clusters, reference):
        return publish_rows(
            Store(str(tmp_path)),
            clips=[{"clip_id": clip, "digest": digest} for clip, digest in clips.items()],
            clusters=[
                {"clip_id": clip, "cluster_id": clusters.get(clip, 3), "label": label, "label_source": source}
                for clip in clips
                for label, source in [
                    ("run", "override") if clusters.get(clip) == 5 else (None, "unassigned")
                ]
            ],
            references=[{"cluster_id": 3, "clip_id": reference}],
            runs=[{"run_id": "a", "settings": "{}"}],
        )

    published(dict(a="1", b="2", c="3", d="4", f="6"), {"b": 4}, "a")
    published(dict(a="1", b="2", c2="3", e="5", f="7"), {"b": 5}, "f")
    after = Catalog.open(str(tmp_path))
    told = changes_section(after, changes_since_last(after))
    shown = dict(re.findall("<summary>(.*?)</summary>(.*?)</details>", told, re.DOTALL))
    assert {title: _table_rows(rows) for title, rows in shown.items()} == {
        "1 added": [["e"]],
        "1 removed or set aside": [["d"]],
        "1 renamed": [["c2", "c"]],
        "1 changed": [["f"]],
        "1 moved to another cluster": [["b", "4", "5"]],
        "1 with another name": [["b", "no name", "run", "override"]],
        "1 references replaced": [["3", "a", "f"]],
    }


def test_an_earlier_snapshot_that_cannot_be_read_is_said_to_be(publish_rows, motionary, tmp_path):
    """The part that is damaged is named by the earlier snapshot alone."""
    store = Store(str(tmp_path / "catalog"))
    run_row = {"run_id": "a", "settings": "{}"}
    first = publish_rows(store, clips=[{"clip_id": "one"}], runs=[run_row])
    publish_rows(store, clips=[], runs=[run_row])
    part = tmp_path / "catalog" / first.tables["clips"][0]
    whole = part.read_bytes()
    part.write_bytes(whole[:-20] + b"no magic")
    after = Catalog.open(store.url)
    told = Page(changes_section(after, changes_since_last(after))).text
    assert "What changed since snapshot 000001" in told
    assert "cannot be read" in told
    assert part.name in told
    with pytest.raises(CatalogError, match=part.name):
        changes_since(after, Catalog.open(store.url, 1))
    part.unlink()
    assert "cannot be read" in changes_section(after, changes_since_last(after))
    part.write_bytes(whole)
    assert "1 removed or set aside" in changes_section(after, changes_since_last(after))


def test_the_command_passes_over_damage_of_the_snapshot_before(made, some, motionary, tmp_path):
    made({name: name for name in some[:3]}, folder=tmp_path).close()
    catalog = made({name: name for name in some[:2]}, folder=tmp_path)
    before = Catalog.open(catalog.store.url, 1).snapshot
    for name in ("clips", "clusters"):
        for file in set(before.tables[name]) - set(catalog.snapshot.tables[name]):
            (tmp_path / "catalog" / file).write_bytes(b"spoiled")
    file = tmp_path / "out.html"
    code, out, _ = motionary("report", catalog.store.url, file, "--json")
    assert (code, json.loads(out)["against"]) == (0, None)
    assert "What changed since snapshot 000001" in check(file.read_text()).text
    code, _, err = motionary("report", catalog.store.url, file, "--overwrite", "--against", "1")
    assert code == 1
    assert "damaged" in err


def test_the_heading_tells_when_the_snapshot_was_made(demo_catalog, tmp_path):
    catalog = Catalog.open(copied(demo_catalog, tmp_path))
    clip = catalog.clips.to_arrow()["clip_id"][0].as_py()
    later = "2031-02-03T04:05:06+00:00"
    relabel(catalog.store.url, {clip: "amble"}, "a test", lambda dead: None)
    manifest = tmp_path / "catalog" / "snapshots" / "000002.json"
    made = json.loads(manifest.read_text())
    manifest.write_text(json.dumps(made | {"created_at": later}))
    text = Page(heading(Catalog.open(catalog.store.url))).text
    assert "Snapshot 000002 of 2031-02-03 04:05 UTC" in text


def test_an_unchanged_catalog_says_so(demo):
    text = changes_section(demo, changes_since(demo, demo))
    assert "Since snapshot 000001 of" in text
    assert ": nothing." in text


def test_a_vacuumed_snapshot_is_missed(made, some, tmp_path):
    first = made({name: name for name in some}, folder=tmp_path)
    assert "first run" in changes_section(first, changes_since_last(first))
    first.close()
    catalog = made({name: name for name in some[1:]}, folder=tmp_path)
    vacuum(Store(str(tmp_path / "catalog")), keep=1, grace_hours=0)
    assert changes_since_last(catalog) is None
    page = check(report_page(catalog))
    assert "The snapshot before is gone" in page.text
    assert [row["run_id"] in page.text for row in catalog.runs.to_arrow().to_pylist()] == [True, True]


def test_long_lists_of_changes_are_cut(publish_rows, tmp_path):
    store = Store(str(tmp_path))
    rows = [{"clip_id": f"clip {k:03}", "digest": str(k)} for k in range(MOST_ROWS + 50)]
    run_row = {"run_id": "a", "settings": "{}"}
    members = [{"clip_id": row["clip_id"], "cluster_id": 1} for row in rows]
    publish_rows(store, runs=[run_row])
    publish_rows(store, clips=rows, clusters=members, runs=[run_row])
    before, after = (Catalog.open(str(tmp_path), snapshot) for snapshot in (1, 2))
    text = Page(changes_section(after, changes_since(after, before))).text
    assert f"{MOST_ROWS + 50} added" in text
    assert "and 50 more" in text
    assert f"clip {MOST_ROWS - 1:03}" in text
    assert f"clip {MOST_ROWS:03}" not in text


def test_settings_that_are_not_the_default_are_named(made, some, demo_page):
    catalog = made({some[0]: some[0]}, features=FeatureConfig(epsilon=0.25))
    assert "Not as by default: features.epsilon = 0.25." in Page(report_page(catalog)).text
    assert "All as by default." in demo_page


def test_packed_data_is_what_was_packed():
    figure = go.Figure(go.Scatter(x=np.arange(3.0), text=["</script>", "é", "&"]))
    page = Page(packed_chart(figure, "one") + packed_plotly())
    unpacked = {name: gzip.decompress(base64.b64decode(text)).decode() for name, text in page.data.items()}
    assert unpacked.pop("plotly") == get_plotlyjs()
    assert json.loads(unpacked["one-data"])["figure"] == json.loads(figure.to_json())
    assert packed_chart(figure, "one") == packed_chart(figure, "one")


# The command


def test_the_command_writes_a_page(demo_catalog, motionary, tmp_path):
    file = tmp_path / "out.html"
    code, out, err = motionary("report", demo_catalog, file, "--json")
    assert (code, err) == (0, "")
    told = json.loads(out)
    assert told == {
        "file": str(file), "bytes": file.stat().st_size, "snapshot": "000001", "against": None,
        "clips": 80, "clusters": 11,
    }  # fmt: skip
    check(file.read_text())
    assert [one.name for one in tmp_path.iterdir()] == ["out.html"]


def test_the_command_replaces_nothing_unasked(made, some, motionary, tmp_path):
    catalog = made({one: one for one in some[:2]}).store.url
    file = tmp_path / "out.html"
    file.write_text("mine")
    code, out, err = motionary("report", catalog, file)
    assert (code, out, file.read_text()) == (1, "", "mine")
    assert f"{file} is there already" in err
    relabel(catalog, {some[0]: "amble"}, "a test", lambda dead: None)
    code, out, _ = motionary("report", catalog, file, "--overwrite", "--against", "1")
    assert code == 0
    assert "changes since snapshot 000001" in out
    assert "1 with another name" in file.read_text()


@pytest.mark.parametrize("shown", ["1", "2"])
def test_the_command_compares_with_an_older_snapshot_only(publish_rows, motionary, tmp_path, shown):
    store = Store(str(tmp_path / "catalog"))
    for _ in range(2):
        publish_rows(store, runs=[{"run_id": "a", "settings": "{}"}])
    options = ["--snapshot", shown, "--against", "2"]
    code, out, err = motionary("report", store.url, tmp_path / "out.html", *options)
    assert (code, out) == (1, "")
    assert "snapshot 000002 is not older" in " ".join(err.split())
    assert f"than snapshot 00000{shown}" in " ".join(err.split())


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["out.txt"], 2, "does not end in .html"),
        (["nowhere/out.html"], 1, "there is no folder"),
        (["folder.html"], 1, "is a folder"),
        (["out.html", "--against", "7"], 1, "7"),
        (["out.html", "--snapshot", "no-such-run"], 1, "no-such-run"),
    ],
)
def test_the_command_says_what_is_wrong(demo_catalog, motionary, tmp_path, arguments, code, message):
    (tmp_path / "folder.html").mkdir()
    name, *options = arguments
    found, out, err = motionary("report", demo_catalog, tmp_path / name, *options)
    assert (found, out) == (code, "")
    assert message in " ".join(err.replace("│", " ").split())
    assert [one.name for one in tmp_path.iterdir()] == ["folder.html"]
