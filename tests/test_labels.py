"""What people said clips are: nothing is lost, whatever becomes of files and clusters."""

import shutil
from datetime import UTC, datetime, timedelta

import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.labels import following, with_labels
from motionary.catalog.schema import SCHEMAS
from motionary.catalog.writer_lock import the_only_writer
from motionary.pipeline.config import ClusterConfig, PipelineConfig
from motionary.workflows.errors import UserError
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from motionary.workflows.relabel import relabel

NOON = datetime(2026, 5, 1, 12, tzinfo=UTC)
EMPTY = SCHEMAS["labels"].empty_table()

CLIPS = st.sampled_from(["a", "b", "c", "d", "e", "f"])
DIGESTS = st.sampled_from(["1", "2", ""])
LIBRARIES = st.dictionaries(CLIPS, DIGESTS, min_size=2)
CHANGES = st.dictionaries(CLIPS, st.sampled_from(["walk", "run", "jump"]), min_size=1)


def inputs(clips: dict[str, str]) -> pa.Table:
    return pa.table(
        {"clip_id": pa.array([*clips], pa.string()), "digest": pa.array([*clips.values()], pa.string())}
    )


def labelled(changes: dict, digests: dict, labels=EMPTY, at=NOON) -> pa.Table:
    return with_labels(labels, changes, dict.fromkeys(changes, "") | digests, at, "ada")


def by_clip(labels: pa.Table) -> dict[str, str]:
    return dict(zip(labels["clip_id"].to_pylist(), labels["label"].to_pylist(), strict=True))


def said(labels: pa.Table) -> list[tuple]:
    """What was said by whom and when, without of which clip."""
    return sorted((row["label"], row["set_at"], row["set_by"]) for row in labels.to_pylist())


def test_set_replace_and_remove():
    first = labelled({"b": "run", "a": "walk"}, {"a": "1", "b": "2"})
    later = labelled({"a": "jump", "b": "run"}, {"a": "1"}, first, NOON + timedelta(days=1))
    assert later.to_pylist() == [
        {"clip_id": "a", "digest": "1", "label": "jump", "set_at": NOON + timedelta(days=1), "set_by": "ada"},
        {"clip_id": "b", "digest": "2", "label": "run", "set_at": NOON, "set_by": "ada"},
    ]
    assert by_clip(with_labels(later, {"a": None}, {}, NOON, "ada")) == {"b": "run"}


@pytest.mark.parametrize("label", ["", " ", " walk", "walk\n", "wa\tlk", "\udc80"])
def test_what_cannot_be_a_label(label):
    with pytest.raises(ValueError, match="cannot be the label of 'a'"):
        labelled({"a": label}, {})


def test_nothing_to_remove():
    with pytest.raises(ValueError, match="nobody has labelled 'a'"):
        with_labels(EMPTY, {"a": None}, {}, NOON, "ada")


@given(CHANGES, st.dictionaries(CLIPS, st.none() | st.sampled_from(["walk", "fly"])))
def test_only_what_is_changed_changes(first, changes):
    before = labelled(first, {})
    changes = {clip: label for clip, label in changes.items() if label is not None or clip in first}
    after = labelled(changes, {}, before, NOON + timedelta(days=1))
    expected = {clip: label for clip, label in (first | changes).items() if label is not None}
    assert by_clip(after) == expected
    assert after["clip_id"].to_pylist() == sorted(expected)
    assert after.schema.equals(SCHEMAS["labels"])
    untouched = [row for row in before.to_pylist() if row["clip_id"] not in changes]
    assert [row for row in after.to_pylist() if row["clip_id"] not in changes] == untouched


@given(LIBRARIES, CHANGES, LIBRARIES)
def test_nothing_is_ever_lost(before, changes, now):
    labels = labelled(changes, before)
    after = following(labels, inputs(now))
    assert said(after) == said(labels)
    assert after["clip_id"].to_pylist() == sorted(set(after["clip_id"].to_pylist()))
    for row in labels.to_pylist():
        if row["digest"] == now.get(row["clip_id"]):
            assert row in after.to_pylist()
    for row in after.to_pylist():
        assert row["digest"] == now.get(row["clip_id"]) or now.get(row["clip_id"], "") == ""
    assert following(after, inputs(now)).equals(after)


@given(LIBRARIES, CHANGES, LIBRARIES, st.randoms(use_true_random=False))
def test_the_order_of_rows_does_not_matter(before, changes, now, random):
    labels, files = labelled(changes, before), [*now.items()]
    places = [*range(len(labels))]
    random.shuffle(places)
    random.shuffle(files)
    assert following(labels.take(places), inputs(dict(files))).equals(following(labels, inputs(now)))


@given(LIBRARIES, CHANGES, LIBRARIES)
def test_a_label_that_waits_can_go_nowhere_or_is_contested(before, changes, now):
    # So is what the review lists as moved.
    after = following(labelled(changes, before), inputs(now)).to_pylist()
    free = {digest for clip, digest in now.items() if clip not in {row["clip_id"] for row in after}}
    waiting = [row for row in after if row["clip_id"] not in now and row["digest"]]
    for row in waiting:
        said_of_it = {other["label"] for other in waiting if other["digest"] == row["digest"]}
        assert row["digest"] not in free or len(said_of_it) > 1


@given(st.dictionaries(CLIPS, CLIPS, min_size=1), st.permutations(["u", "v", "w", "x", "y", "z"]))
def test_labels_go_with_renamed_files(labels, names):
    # Every clip has bytes of its own; all are renamed, then named back.
    there = dict(zip("abcdef", "abcdef", strict=True))
    renamed = dict(zip(names, "abcdef", strict=True))
    before = labelled(labels, there)
    moved = following(before, inputs(renamed))
    assert by_clip(moved) == {name: labels[clip] for name, clip in renamed.items() if clip in labels}
    assert following(moved, inputs(there)).equals(before)


def test_a_file_edited_in_place_keeps_its_label_and_can_be_renamed_afterwards():
    edited = following(labelled({"a": "walk"}, {"a": "1"}), inputs({"a": "2"}))
    assert by_clip(following(edited, inputs({"b": "2", "c": "1"}))) == {"b": "walk"}


@pytest.mark.parametrize(
    ("said", "before", "now", "expected"),
    [
        pytest.param(
            {"b5": "five"}, {"b5": "1"}, {"b5": "2", "keep/b5": "1"}, {"keep/b5": "five"}, id="a new take"
        ),
        pytest.param(
            {"a": "walk", "b": "run"}, {"a": "1", "b": "2"}, {"a": "2", "b": "1"}, {"a": "run", "b": "walk"},
            id="swapped",
        ),
        pytest.param(
            {"a": "walk", "b": "run", "c": "jump"}, {"a": "1", "b": "2", "c": "3"},
            {"a": "3", "b": "1", "c": "2"}, {"a": "jump", "b": "walk", "c": "run"},
            id="in a circle",
        ),
        pytest.param(
            {"a": "walk", "b": "run"}, {"a": "1", "b": "2"}, {"a": "0", "b": "1", "c": "2"},
            {"b": "walk", "c": "run"},
            id="renumbered",
        ),
        pytest.param(
            {"a": "walk", "b": "run", "c": "jump"}, {"a": "1", "b": "2", "c": "3"},
            {"a": "0", "b": "1", "c": "2"}, {"a": "walk", "b": "run", "c": "jump"},
            id="renumbered, and the last has nowhere to go",
        ),
        pytest.param(
            {"a": "walk", "b": "run"}, {"a": "1", "b": "2"}, {"a": "0", "b": "1", "d": "1"},
            {"b": "run", "d": "walk"},
            id="past a place that does not free up",
        ),
        pytest.param(
            {"a": "walk"}, {"a": "1"}, {"a": "", "b": "1"}, {"a": "walk"}, id="perhaps still there"
        ),
    ],
)  # fmt: skip
def test_bytes_beat_the_name(said, before, now, expected):
    assert by_clip(following(labelled(said, before), inputs(now))) == expected


@pytest.mark.parametrize(
    ("now", "expected"),
    [
        (["x", "y"], {"x": "walk", "y": "walk"}),
        (["x"], {"copy": "walk", "x": "walk"}),
        (["x", "y", "z"], {"x": "walk", "y": "walk"}),
    ],
)
def test_copies_that_are_called_the_same_are_renamed_together(now, expected):
    labels = labelled({"a": "walk", "copy": "walk"}, {"a": "1", "copy": "1"})
    assert by_clip(following(labels, inputs(dict.fromkeys(now, "1")))) == expected


def test_an_edited_file_does_not_contest_the_bytes_that_it_had():
    labels = labelled({"a": "walk", "c": "run"}, {"a": "1", "c": "1"})
    assert by_clip(following(labels, inputs({"a": "2", "b": "1"}))) == {"a": "walk", "b": "run"}


def test_of_several_copies_the_first_has_the_label():
    labels = following(labelled({"a": "walk"}, {"a": "1"}), inputs({"c": "1", "b": "1"}))
    assert by_clip(labels) == {"b": "walk"}


def test_a_copy_that_has_a_label_of_its_own_keeps_it():
    labels = labelled({"a": "walk", "b": "run"}, {"a": "1", "b": "1"})
    assert by_clip(following(labels, inputs({"b": "1"}))) == {"a": "walk", "b": "run"}


def test_of_two_labels_for_one_copy_neither_is_chosen():
    labels = labelled({"a": "walk", "b": "run"}, {"a": "1", "b": "1"})
    assert by_clip(following(labels, inputs({"c": "1"}))) == {"a": "walk", "b": "run"}
    assert by_clip(following(labels, inputs({"c": "1", "d": "1"}))) == {"a": "walk", "b": "run"}


def test_a_file_that_is_gone_finds_its_label_when_it_comes_back():
    labels = labelled({"a": "walk"}, {"a": "1"})
    away = following(labels, inputs({"b": "2"}))
    assert following(away, inputs({"a": "1", "b": "2"})).equals(labels)


def test_bytes_that_cannot_be_read_are_like_no_others():
    labels = following(labelled({"a": "walk"}, {"a": ""}), inputs({"b": ""}))
    assert by_clip(labels) == {"a": "walk"}
    unreadable = following(labelled({"a": "walk"}, {"a": "1"}), inputs({"a": ""}))
    assert by_clip(following(unreadable, inputs({"b": "1"}))) == {"b": "walk"}


@pytest.fixture
def few(demo_library, tmp_path):
    """Six walks and six squats, of which four each have a supplied label."""
    library = tmp_path / "few"
    rows = ["path,action"]
    for action in ("walk", "squat"):
        files = sorted((demo_library / action).glob("*.bvh"))[:6]
        (library / action).mkdir(parents=True)
        for file in files:
            shutil.copy(file, library / action)
        rows += [f"{action}/{file.name},{action}" for file in files[:4]]
    (library / "labels.csv").write_text("\n".join(rows))
    return library


@pytest.fixture
def catalog_of(tmp_path, silent_progress):
    """Run a library into one catalog, again and again."""

    def made(library, **clusters):
        config = PipelineConfig(clusters=ClusterConfig(**clusters))
        return run(
            Job([str(library)], str(tmp_path / "out"), config, library / "labels.csv"), silent_progress
        )

    return made


def names(catalog: Catalog) -> dict[str, tuple[str | None, str]]:
    return {
        row["clip_id"]: (row["label"], row["label_source"]) for row in catalog.clusters.to_arrow().to_pylist()
    }


def test_a_persons_label_wins_at_once_and_after_every_run(few, catalog_of, tmp_path):
    catalog = catalog_of(few, n_clusters=2).catalog
    supplied, silent = (catalog.clips.to_arrow()["clip_id"].to_pylist()[place] for place in (0, 5))
    after = relabel(catalog.store.url, {supplied: "crouch", silent: "kneel"}, "ada")
    assert (names(after)[supplied], names(after)[silent]) == (("crouch", "override"), ("kneel", "override"))
    assert after.snapshot.snapshot_id == "000002"
    assert names(catalog)[supplied] == ("squat", "supplied")  # an opened catalog keeps its snapshot

    for clusters in (2, 3, 1):
        later = catalog_of(few, n_clusters=clusters).catalog
        assert names(later)[supplied] == ("crouch", "override")
        assert names(later)[silent] == ("kneel", "override")
    back = relabel(catalog.store.url, {supplied: None, silent: None}, "ada")
    assert names(back)[supplied] == ("squat", "supplied")
    assert names(back)[silent][1] == "propagated"
    assert len(back.labels) == 0


def test_the_published_names_are_those_of_the_next_run(few, catalog_of):
    first = catalog_of(few, n_clusters=2).catalog
    clips = first.clips.to_arrow()["clip_id"].to_pylist()
    after = relabel(first.store.url, dict.fromkeys(clips[:5], "crouch"), "ada")
    references = after.references.to_arrow()
    assert "crouch" in references["label"].to_pylist()
    again = catalog_of(few, n_clusters=2).catalog
    assert again.clusters.to_arrow().equals(after.clusters.to_arrow())
    assert again.references.to_arrow().equals(references)
    assert again.labels.to_arrow().equals(after.labels.to_arrow())
    assert after.snapshot.tables["labels"] == again.snapshot.tables["labels"]
    assert len(after.runs) == 1  # saying what a clip is is no run


def test_labels_follow_files_through_runs(few, catalog_of):
    url = catalog_of(few, n_clusters=2).catalog.store.url
    relabel(url, {f"walk/{file.name}": "stroll" for file in (few / "walk").iterdir()}, "ada")
    (few / "walk").rename(few / "takes")
    edited = sorted((few / "takes").iterdir())[0]
    later = catalog_of(few, n_clusters=2).catalog
    assert {label for clip, (label, _) in names(later).items() if clip.startswith("takes/")} == {"stroll"}

    edited.write_text(edited.read_text() + "\n")
    last = catalog_of(few, n_clusters=2).catalog
    assert names(last)[f"takes/{edited.name}"] == ("stroll", "override")
    assert {row["set_by"] for row in last.labels.to_arrow().to_pylist()} == {"ada"}


def test_a_new_take_under_an_old_name_has_no_label(few, catalog_of):
    url = catalog_of(few, n_clusters=2).catalog.store.url
    old, other = sorted((few / "squat").iterdir())[-2:]
    relabel(url, {f"squat/{old.name}": "kneel"}, "ada")
    (few / "keep").mkdir()
    old.rename(few / "keep" / old.name)
    old.write_bytes(other.read_bytes() + b"\n")
    later = names(catalog_of(few, n_clusters=2).catalog)
    assert later[f"keep/{old.name}"] == ("kneel", "override")
    assert later[f"squat/{old.name}"][1] != "override"


def test_a_label_of_a_file_that_is_gone_waits(few, catalog_of):
    url = catalog_of(few, n_clusters=2).catalog.store.url
    file = sorted((few / "squat").iterdir())[-1]
    relabel(url, {f"squat/{file.name}": "kneel"}, "ada")
    content = file.read_bytes()
    file.unlink()
    gone = catalog_of(few, n_clusters=2).catalog
    assert (len(gone.clips), len(gone.labels)) == (11, 1)
    file.write_bytes(content)
    assert names(catalog_of(few, n_clusters=2).catalog)[f"squat/{file.name}"] == ("kneel", "override")


def test_what_is_refused_changes_nothing(few, catalog_of):
    catalog = catalog_of(few).catalog
    url, (known, *_) = catalog.store.url, catalog.clips.to_arrow()["clip_id"].to_pylist()
    with pytest.raises(UserError, match=r"nothing was changed: .* has no clip 'squat/nobody.bvh'"):
        relabel(url, {known: "walk", "squat/nobody.bvh": "run"}, "ada")
    with pytest.raises(UserError, match="cannot be the label"):
        relabel(url, {known: " "}, "ada")
    with pytest.raises(UserError, match=f"nothing was changed: nobody has labelled '{known}'"):
        relabel(url, {known: None}, "ada")
    with the_only_writer(catalog.store, print), pytest.raises(CatalogError, match="is being written by"):
        relabel(url, {known: "walk"}, "ada")
    assert Catalog.open(url).snapshot == catalog.snapshot


def test_saying_it_again_publishes_nothing(few, catalog_of):
    catalog = catalog_of(few).catalog
    known = catalog.clips.to_arrow()["clip_id"][0].as_py()
    first = relabel(catalog.store.url, {known: "walk"}, "ada")
    assert relabel(catalog.store.url, {known: "walk"}, "bea").snapshot == first.snapshot


def test_a_folder_that_is_no_catalog(tmp_path):
    with pytest.raises(CatalogError, match="is not a catalog"):
        relabel(str(tmp_path), {"a": "walk"}, "ada")
    assert not [*tmp_path.iterdir()]
