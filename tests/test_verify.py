"""Verification: a sound catalog passes every check, and each kind of damage fails the check meant for it."""

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

import fsspec
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from motionary.catalog.checks.found import wrong_rows
from motionary.catalog.query import Catalog
from motionary.catalog.schema import SCHEMAS, VERSION
from motionary.catalog.store import Store
from motionary.catalog.verify import _RULES, verify
from tests.catalogs import copied

AS_WRITTEN = "files are as they were written"
READS = "plain pyarrow reads every file"
SCHEMA = "files have their tables' schemas"
SORTED = "clips are unique and sorted"
ACCOUNTED = "inputs are clips or quarantined"
MERGED = "merged frames cover every frame"
COUNTED = "the run counted what is there"
PAIRS = "every pair is there once"
DISTANCES = "distances are distances"
LINKAGES = "linkages are dendrograms"
PARTITIONS = "partitions hold every clip once"
CLUSTERS = "clusters hold every clip once"
REFERENCES = "clusters have one reference"
TO_REFERENCES = "distances to references are the pairs'"
LABELS = "labels are consistent"
ALIGNED_ONCE = "clips are aligned once"
ALIGNED = "aligned clips have their reference's frames"
STYLES = "clips have one style"
STRANGER = "no/such clip.bvh"


class Damaged:
    """A copy of a catalog that can be rewritten such that its manifest agrees with what is there."""

    def __init__(self, url: str, folder: Path) -> None:
        self.folder = folder = Path(copied(url, folder))
        self.store = Store(str(folder))
        current = (folder / "CURRENT").read_text().strip()
        self.manifest_file = folder / "snapshots" / f"{current}.json"
        self.manifest = json.loads(self.manifest_file.read_text())

    def files(self, table: str) -> list[Path]:
        return [self.folder / name for name in self.manifest["tables"][table]]

    def change(self, table: str, change: Callable[[pa.Table], pa.Table]) -> None:
        """Write a table anew as one part, and its facts with it."""
        listed = self.manifest["tables"].get(table, ())
        rows = self.store.read(listed) if listed else SCHEMAS[table].empty_table()
        changed = change(rows)
        name = self.store.part_name(table, "changed")
        (self.folder / name).parent.mkdir(exist_ok=True)
        pq.write_table(changed, self.folder / name, compression="zstd")
        for file in listed:
            del self.manifest["parts"][file]
        self.manifest["tables"][table] = [name]
        self.manifest["parts"][name] = asdict(self.store.facts(name))
        self.publish()

    def publish(self) -> None:
        self.manifest_file.write_text(json.dumps(self.manifest))

    def told(self) -> dict[str, str]:
        """Say of each check that fails what it tells."""
        return {check.name: check.detail for check in verify(str(self.folder)) if not check.passed}

    def failed(self) -> set[str]:
        return set(self.told())

    def told_by(self, name: str) -> str:
        """Say what a check tells that fails; those after it are not done."""
        check = next(check for check in verify(str(self.folder)) if check.name == name)
        assert not check.passed
        return check.detail


@pytest.fixture
def damaged(demo_catalog, tmp_path) -> Damaged:
    return Damaged(demo_catalog, tmp_path)


def put(table: pa.Table, column: str, values: object) -> pa.Table:
    """Replace a column."""
    field = table.schema.field(column)
    return table.set_column(table.schema.get_field_index(column), field, pa.array(values, field.type))


def edit(column: str, row: int, value: object) -> Callable[[pa.Table], pa.Table]:
    """Put another value into one row of a column."""

    def change(table: pa.Table) -> pa.Table:
        values = table[column].to_pylist()
        values[row] = value
        field = table.schema.field(column)
        changed = pa.array(values, field.type)
        return table.set_column(table.schema.get_field_index(column), field, changed)

    return change


def edit_where(column: str, where: tuple[str, object], value: object) -> Callable[[pa.Table], pa.Table]:
    """Put another value into the first row that has a value in a column."""
    return lambda table: edit(column, table[where[0]].to_pylist().index(where[1]), value)(table)


def without(row: int) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.filter(np.arange(len(table)) != row % len(table))


def doubled(row: int) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.take([*range(row + 1), row, *range(row + 1, len(table))])


def moved_to_end(row: int) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.take([*(one for one in range(len(table)) if one != row), row])


def swapped(*columns: str) -> Callable[[pa.Table], pa.Table]:
    """Exchange two columns of the first row."""

    def change(table: pa.Table) -> pa.Table:
        one, other = (table[column][0].as_py() for column in columns)
        return edit(columns[1], 0, one)(edit(columns[0], 0, other)(table))

    return change


def both(*changes: Callable[[pa.Table], pa.Table]) -> Callable[[pa.Table], pa.Table]:
    def change(table: pa.Table) -> pa.Table:
        for one in changes:
            table = one(table)
        return table

    return change


def stranger(column: str, row: int = 0) -> Callable[[pa.Table], pa.Table]:
    return edit(column, row, STRANGER)


def another(table: pa.Table) -> pa.Table:
    """Append the first row once more, of a stranger."""
    return pa.concat_tables([table, stranger("clip_id")(table.slice(0, 1))])


def test_a_sound_catalog_passes_every_check(demo_catalog):
    checks = list(verify(demo_catalog))
    assert [check for check in checks if not check.passed] == []
    assert len({check.name for check in checks}) == len(checks)
    details = {check.name: check.detail for check in checks}
    assert details[PAIRS] == "3160 pairs of 80 clips"
    assert details[CLUSTERS] == "80 clips"
    assert details[LABELS] == "80 supplied"


def test_rewriting_a_table_as_it_was_fails_nothing(damaged):
    for table in damaged.manifest["tables"]:
        damaged.change(table, lambda rows: rows)
    assert damaged.failed() == set()


def not_a_number(table: pa.Table) -> pa.Table:
    return edit("weighted", 5, float("nan"))(table)


def negative_curve(table: pa.Table) -> pa.Table:
    curve = table["curve"][0].as_py()
    low = edit("fuzzy_low", 0, -1.0)(table)
    return edit("curve", 0, [-1.0, *curve[1:]])(low)


def other_reference(table: pa.Table) -> pa.Table:
    """Give the first clip's alignment the reference of another cluster."""
    names, first = table["reference_id"].to_pylist(), table["reference_id"][0].as_py()
    return edit("reference_id", 0, next(name for name in names if name != first))(table)


def backwards(table: pa.Table) -> pa.Table:
    times = table["source_time"][0].as_py()
    return edit("source_time", 0, [times[1], times[0] - 1, *times[2:]])(table)


def stretched(table: pa.Table) -> pa.Table:
    eta = table["eta"][0].as_py()
    return edit("eta", 0, [eta[0] + 1, *eta[1:]])(table)


def falling(table: pa.Table) -> pa.Table:
    """Let the second merge of the first linkage lie just under the first one."""
    return edit("height", 1, float(np.nextafter(table["height"][0].as_py(), -1)))(table)


def merged_twice(table: pa.Table) -> pa.Table:
    return edit("left", 1, table["left"][0].as_py())(table)


def later_cluster(table: pa.Table) -> pa.Table:
    """Let the first merge take what the last one takes, and the other way round."""
    clips = 1 + table["step"].to_pylist().index(0, 1)
    one, last = table["left"][0].as_py(), table["left"][clips - 2].as_py()
    return edit("left", clips - 2, one)(edit("left", 0, last)(table))


def second_reference(table: pa.Table) -> pa.Table:
    row = table["is_reference"].to_pylist().index(False)
    return edit("distance_to_reference", row, 0.0)(edit("is_reference", row, True)(table))


def emptied(table: pa.Table) -> pa.Table:
    """Leave no frame to the second merged frame, between two that adjoin."""
    second = table["first_frame"][1].as_py()
    return both(edit("last_frame", 1, second - 1), edit("first_frame", 2, second))(table)


def propagated(table: pa.Table) -> pa.Table:
    """Say that a label that was supplied came from the cluster."""
    return both(edit("label_source", 0, "propagated"), edit("confidence", 0, 0.5))(table)


def half_as_wide(table: pa.Table) -> pa.Table:
    place = table.schema.get_field_index("confidence")
    return table.set_column(place, "confidence", table["confidence"].cast(pa.float32()))


def nullable(table: pa.Table) -> pa.Table:
    place = table.schema.get_field_index("cluster_id")
    return table.set_column(place, table.schema.field(place).with_nullable(True), table["cluster_id"])


def no_text(table: pa.Table) -> pa.Table:
    """Put bytes that are no UTF-8 where no check but that of the files looks."""
    text = pa.array([b"\xff"] * len(table)).view(pa.string())
    return table.set_column(table.schema.get_field_index("action"), table.schema.field("action"), text)


def label_column_of_numbers(table: pa.Table) -> pa.Table:
    return table.append_column("mood", pa.array(range(len(table))))


def spoilt(column: str, value: float, row: int = 0) -> Callable[[pa.Table], pa.Table]:
    """Put a value into the middle of a row's vector."""

    def change(table: pa.Table) -> pa.Table:
        vector = table[column][row].as_py()
        vector[len(vector) // 2] = value
        return edit(column, row, vector)(table)

    return change


def farther(table: pa.Table) -> pa.Table:
    """Move a clip away from its reference, by the least that float32 can tell."""
    row = table["is_reference"].to_pylist().index(False)
    there = np.float32(table["distance_to_reference"][row].as_py())
    return edit("distance_to_reference", row, float(np.nextafter(there, np.float32(np.inf))))(table)


def without_units(table: pa.Table) -> pa.Table:
    return pa.table(table.to_pydict(), schema=pa.schema([field.remove_metadata() for field in table.schema]))


DAMAGE = [
    ("clusters", half_as_wide, SCHEMA, "float, nullable, not double"),
    ("clips", moved_to_end(0), SORTED, "stands after wave/wave_tired_bea_02.bvh"),
    ("frames", without(0), "clips have their frames", "has 50 frames, clips says 51"),
    ("features", edit("frame", 0, 1), "clips have their features", "are not numbered 0 to 50"),
    ("resampled", lambda rows: rows.filter(pc.not_equal(rows["clip_id"], rows["clip_id"][0])),
     "clips have their resampled", "has no frames"),
    ("pairs", without(9), PAIRS, "1 of 3160 pairs are missing"),
    ("pairs", not_a_number, DISTANCES, "weighted is no distance"),
    ("linkage", without(0), LINKAGES, "78 merges, 80 clips take 79"),
    ("partitions", without(0), PARTITIONS, "lacks jump/jump_energetic_alex_01.bvh"),
    ("clusters", edit_where("distance_to_reference", ("is_reference", True), 0.25), REFERENCES,
     "lies 0.25 from itself"),
    ("clusters", edit("label", 0, "yawn"), LABELS, "yawn (supplied, 1.0) which was not supplied"),
    ("alignments", doubled(0), ALIGNED_ONCE, "has 2 rows"),
    ("aligned", without(-1), ALIGNED, "102 aligned frames, its reference 103"),
    ("styles", doubled(0), STYLES, "has 2 rows"),
    ("inputs", without(0), ACCOUNTED, "is not among the inputs"),
    ("resampled", edit("last_frame", 0, -1), MERGED, "runs from 0 to -1 after -1"),
    ("runs", edit("clips", -1, 79), COUNTED, "counted 79 clips, there are 80"),
    ("clusters", farther, TO_REFERENCES, "as a pair"),
]  # fmt: skip

MORE_DAMAGE = [
    ("linkage", lambda rows: rows.select(rows.column_names[::-1]), SCHEMA, "columns size, height, right"),
    ("styles", lambda rows: rows.append_column("colour", pa.array(["red"] * len(rows))), SCHEMA,
     "explained, colour; styles has"),
    ("clips", label_column_of_numbers, SCHEMA, "label column mood is no text"),
    ("references", without_units, SCHEMA, "column cluster_id lacks its unit or meaning"),
    ("clips", doubled(3), SORTED, "has 2 rows"),
    ("frames", without(-1), "clips have their frames", "has 204 frames, clips says 205"),
    ("frames", doubled(7), "clips have their frames", "are not numbered 0 to 51"),
    ("frames", moved_to_end(0), "clips have their frames", "stands in two places"),
    ("frames", edit("frame", 3, 4), "clips have their frames", "are not numbered 0 to 50"),
    ("features", stranger("clip_id"), "clips have their features",
     f"{STRANGER} has frames and is no clip"),
    ("pairs", doubled(9), PAIRS, "are compared again"),
    ("pairs", swapped("clip_a", "clip_b"), PAIRS, "do not stand in order"),
    ("pairs", stranger("clip_b"), PAIRS, f"{STRANGER} is compared in"),
    ("pairs", edit("dtw", 3, float("inf")), DISTANCES, "dtw is no distance"),
    ("pairs", edit("b_dtw", 3, -0.5), DISTANCES, "b_dtw is no distance"),
    ("pairs", edit("b_dtw", 3, 1e6), DISTANCES, "b_dtw exceeds dtw"),
    ("pairs", negative_curve, DISTANCES, "the curve holds what is no distance"),
    ("pairs", edit("fuzzy_high", 0, 1e6), DISTANCES, "fuzzy_high is not the greatest of the curve"),
    ("linkage", falling, LINKAGES, "the height falls at step 1"),
    ("linkage", merged_twice, LINKAGES, "is merged twice or never"),
    ("linkage", later_cluster, LINKAGES, "step 0 merges a cluster that a later step makes"),
    ("linkage", edit("size", 0, 3), LINKAGES, "step 0 makes a cluster of 3 clips"),
    ("linkage", edit("height", 0, float("nan")), LINKAGES, "a height is no distance"),
    ("linkage", lambda rows: rows.filter(pc.not_equal(rows["method"], "fuzzy")), LINKAGES,
     "linkage fuzzy fuzzy is missing"),
    ("partitions", doubled(0), PARTITIONS, "01.bvh 2 times"),
    ("partitions", stranger("clip_id"), PARTITIONS, f"{STRANGER} which is no clip of a cut"),
    ("partitions", edit("cluster", 0, 99), PARTITIONS, "clusters 0 to 99 in all 12"),
    ("clusters", edit_where("is_reference", ("is_reference", True), False), REFERENCES,
     "cluster 1 has 0 references"),
    ("clusters", second_reference, REFERENCES, "cluster 1 has 2 references"),
    ("references", edit("size", 0, 1), REFERENCES, "cluster 1 of 1 clips by references and 10"),
    ("references", doubled(0), REFERENCES, "cluster 1 has 2 rows of references"),
    ("clusters", edit("label", 0, None), LABELS, "nothing (supplied, 1.0) which was not supplied"),
    ("clusters", edit("label_source", 0, "guessed"), LABELS, "of an unknown source"),
    ("clusters", edit("label_source", 0, "override"), LABELS, "which no person said"),
    ("clusters", edit("confidence", 0, 0.5), LABELS, "a confidence that does not go with it"),
    ("clusters", propagated, LABELS, "(propagated, 0.5) while one was supplied"),
    ("clips", edit("action", 0, "yawn"), LABELS, "jump (supplied, 1.0) which was not supplied"),
    ("alignments", without(0), ALIGNED_ONCE, "has no row"),
    ("alignments", stranger("clip_id"), ALIGNED_ONCE, f"{STRANGER} has a row and is no clip"),
    ("alignments", other_reference, ALIGNED_ONCE, "and reference kick/kick_energetic_bea_01.bvh but"),
    ("alignments", edit("cluster_id", 0, 99), ALIGNED_ONCE, "has cluster 99 and reference"),
    ("alignments", edit("source_time", 0, [0.0, 1.0]), ALIGNED_ONCE,
     "has 2 times, its reference"),
    ("alignments", backwards, ALIGNED_ONCE, "runs backwards"),
    ("alignments", stretched, ALIGNED_ONCE, "is stretched by 1 frames"),
    ("alignments", edit("nodes", 0, [0]), ALIGNED_ONCE, "stretches between 1 nodes"),
    ("aligned", without(0), ALIGNED, "are not numbered 0 to 61"),
    ("aligned", stranger("clip_id"), ALIGNED, f"{STRANGER} has 1 aligned frames, its reference none"),
    ("styles", without(0), STYLES, "has no row"),
    ("styles", edit("cluster_id", 0, 99), STYLES, "has cluster 99 and reference"),
    ("styles", edit("energy", 0, float("nan")), STYLES, "01.bvh is nan"),
    ("inputs", doubled(0), ACCOUNTED, "is 2 inputs"),
    ("inputs", edit("digest", 0, "other bytes"), ACCOUNTED, "was made from other bytes than its input"),
    ("inputs", stranger("clip_id"), ACCOUNTED, f"{STRANGER} was seen and is in neither"),
    ("frames", spoilt("rotations", float("nan")), "clips have their frames", "rotations of clip"),
    ("frames", spoilt("root_position", float("-inf")), "clips have their frames", "root_position of clip"),
    ("features", spoilt("feature", float("inf")), "clips have their features", "feature of clip"),
    ("features", edit("heading", 5, float("nan")), "clips have their features", "heading of clip"),
    ("resampled", spoilt("feature", float("nan")), "clips have their resampled", "feature of clip"),
    ("aligned", spoilt("rotations", float("nan")), ALIGNED, "rotations of clip"),
    ("resampled", edit("first_frame", 1, 0), MERGED, "runs from 0 to 9 after 6"),
    ("resampled", edit("last_frame", -1, 9999), MERGED, "end at 9999 its frames at 102"),
    ("runs", edit("quarantined", -1, 1), COUNTED, "counted 1 quarantined, there are 0"),
    ("runs", edit("clusters", -1, 1), COUNTED, "counted 1 clusters, there are 11"),
    ("references", edit("digest", 0, "other bytes"), REFERENCES, "was made from other bytes than its clip"),
    ("cuts", lambda rows: put(rows, "primary", [False] * len(rows)), PARTITIONS,
     "0 cuts are the primary one"),
    ("cuts", lambda rows: put(rows, "primary", [True] * len(rows)), PARTITIONS,
     "7 cuts are the primary one"),
    ("pairs", edit("fuzzy_low", 0, 0.0), DISTANCES, "fuzzy_low is not the least of the curve"),
    ("pairs", without(-1), PAIRS, "the first of wave/wave_tired_alex_01.bvh and wave/wave_tired_bea_02.bvh"),
    ("linkage", edit("height", 0, -1.0), LINKAGES, "a height is no distance"),
    ("cuts", edit("n_clusters", 0, 99), PARTITIONS, "clusters 0 to 10 in all 11 its cut 99"),
    ("features", spoilt("feature", float("inf"), -1), "clips have their features",
     "feature of clip wave/wave_tired_bea_02.bvh in"),
    ("resampled", emptied, MERGED, "runs from 7 to 6 after 6"),
    ("alignments", edit("first_frame", 0, 3), ALIGNED_ONCE, "is stretched by 0"),
    ("styles", edit("energy", 0, -1.0), STYLES, "is -1"),
    ("clusters", nullable, SCHEMA, "cluster_id is int32, nullable, not int32"),
]  # fmt: skip

DAMAGE_OF_MORE = [  # which other checks tell as well
    ("references", edit("clip_id", 0, "jump/jump_energetic_alex_01.bvh"), REFERENCES,
     "has the reference jump/jump_energetic_alex_01.bvh by references, and jump/jump_neutral_emil_02.bvh by"),
    ("clusters", another, CLUSTERS, f"{STRANGER} is in a cluster and is no clip"),
    ("clips", no_text, READS, "UTF8"),
    ("clusters", without(0), CLUSTERS, "jump/jump_energetic_alex_01.bvh is in no cluster"),
]  # fmt: skip

HARMLESS = [
    ("references", edit("label", 0, "yawn")),  # all clips have labels of their own
    ("clips", lambda rows: rows.append_column("mood", pa.array(["glad"] * len(rows)))),
]


@pytest.mark.parametrize(
    ("table", "change", "check", "said"),
    [*DAMAGE, *(pytest.param(*one, marks=pytest.mark.slow) for one in MORE_DAMAGE)],
)
def test_tables_that_disagree_fail_the_check_meant_for_it(damaged, table, change, check, said):
    damaged.change(table, change)
    told = damaged.told()
    assert told.keys() == {check}
    assert said in told[check]


@pytest.mark.slow
@pytest.mark.parametrize(("table", "change", "check", "said"), DAMAGE_OF_MORE)
def test_what_several_checks_tell_is_told_by_the_one_meant_for_it(damaged, table, change, check, said):
    damaged.change(table, change)
    assert said in damaged.told_by(check)


def test_every_check_is_seen_to_fail():
    of_files = {"the manifest is complete", AS_WRITTEN, READS, CLUSTERS}  # by tests of their own
    assert {check for _, _, check, _ in DAMAGE} | of_files == {rule.name for rule in _RULES}


@pytest.mark.parametrize(("table", "change"), HARMLESS)
def test_what_is_allowed_fails_nothing(damaged, table, change):
    damaged.change(table, change)
    assert damaged.failed() == set()


def test_a_clip_in_its_cluster_twice(damaged):
    clusters = damaged.store.read(damaged.manifest["tables"]["clusters"])
    member = clusters["is_reference"].to_pylist().index(False)
    damaged.change("clusters", doubled(member))
    assert damaged.failed() == {CLUSTERS, REFERENCES}  # whose size no longer agrees
    one = clusters["cluster_id"][member].as_py()
    damaged.change(
        "references",
        lambda rows: put(rows, "size", [*rows["size"].to_numpy() + (rows["cluster_id"].to_numpy() == one)]),
    )
    assert damaged.failed() == {CLUSTERS}


@pytest.mark.parametrize(("table", "check"), [("pairs", PAIRS), ("features", "clips have their features")])
def test_a_part_that_holds_what_another_holds(damaged, table, check):
    first, again = damaged.manifest["tables"][table][0], damaged.store.part_name(table, "again")
    shutil.copy(damaged.folder / first, damaged.folder / again)
    damaged.manifest["tables"][table].append(again)
    damaged.manifest["parts"][again] = damaged.manifest["parts"][first]
    damaged.publish()
    assert damaged.failed() == {check}


def test_a_snapshot_of_an_older_motionary_says_that_it_has_no_inputs(damaged):
    for file in damaged.manifest["tables"].pop("inputs"):
        del damaged.manifest["parts"][file]
    damaged.publish()
    assert damaged.failed() == {"the manifest is complete"}
    (check,) = (check for check in verify(str(damaged.folder)) if check.name == ACCOUNTED)
    assert check.detail.endswith("the snapshot has no table inputs to compare them with")


def test_a_catalog_that_is_not_on_disk(damaged):
    memory = fsspec.filesystem("memory")
    memory.put(f"{damaged.folder}/", f"/{damaged.folder.parent.name}/", recursive=True)
    checks = list(verify(f"memory://{damaged.folder.parent.name}"))
    assert [check for check in checks if not check.passed] == []
    assert len(checks) == len(_RULES) + 1


def test_a_clip_that_is_quarantined_as_well(damaged):
    clip = damaged.store.read(damaged.manifest["tables"]["clips"])["clip_id"][0].as_py()
    row = {field.name: 0 if pa.types.is_integer(field.type) else "" for field in SCHEMAS["quarantine"]}
    row |= {"path": clip} | ({"retry": False} if "retry" in row else {})
    damaged.change("quarantine", lambda _: pa.Table.from_pylist([row], schema=SCHEMAS["quarantine"]))
    assert damaged.failed() == {ACCOUNTED, COUNTED}
    damaged.change("quarantine", doubled(0))
    assert f"{clip} is quarantined 2 times" in damaged.told_by(ACCOUNTED)


def test_a_name_that_a_person_gave(damaged):
    clip = damaged.store.read(damaged.manifest["tables"]["clips"])["clip_id"][0].as_py()
    said = {"clip_id": clip, "digest": "", "label": "yawn", "set_at": datetime.now(UTC), "set_by": "ann"}
    damaged.change("labels", lambda _: pa.Table.from_pylist([said], schema=SCHEMAS["labels"]))
    assert damaged.failed() == {LABELS}
    damaged.change("clusters", both(edit("label", 0, "yawn"), edit("label_source", 0, "override")))
    assert damaged.failed() == set()
    damaged.change("labels", doubled(0))
    assert damaged.failed() == {LABELS}
    damaged.change("labels", lambda rows: rows.slice(2))
    assert damaged.failed() == {LABELS}


@pytest.mark.parametrize(
    ("name", "source", "confidence", "sound"),
    [
        ("walk", "propagated", 0.5, True),
        ("run", "propagated", 0.5, False),
        ("walk", "propagated", 1.0, False),
        (None, "unassigned", 0.0, True),
        (None, "unassigned", 0.5, False),
        ("walk", "unassigned", 0.0, False),
        ("walk", "supplied", 1.0, False),
        ("walk", "guessed", 1.0, False),
    ],
)
def test_a_name_that_was_not_supplied(damaged, name, source, confidence, sound):
    clusters = damaged.store.read(damaged.manifest["tables"]["clusters"])
    row = clusters["label"].to_pylist().index("walk")
    damaged.change("clips", edit("action", row, None))
    damaged.change(
        "clusters",
        both(
            edit("label", row, name), edit("label_source", row, source), edit("confidence", row, confidence)
        ),
    )
    assert damaged.failed() == (set() if sound else {LABELS})


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0xFF
    file.write_bytes(content)


@pytest.mark.parametrize(
    ("damage", "fails"),
    [
        (flip, {AS_WRITTEN}),
        (lambda file: file.write_bytes(file.read_bytes()[:-9]), {AS_WRITTEN, READS, SCHEMA}),
        (Path.unlink, {AS_WRITTEN, READS, SCHEMA}),
        (lambda file: file.write_bytes(b""), {AS_WRITTEN, READS, SCHEMA}),
    ],
    ids=["flipped byte", "truncated", "deleted", "empty"],
)
def test_a_damaged_file_fails_by_name_and_hides_no_other_check(damaged, damage, fails):
    file = damaged.files("resampled")[0]
    damage(file)
    checks = list(verify(str(damaged.folder)))
    failed = {check.name for check in checks if not check.passed}
    # A byte inside a page may still be read as something, or not.
    assert fails <= failed <= fails | {READS, "clips have their resampled", MERGED}
    assert len(checks) == len(_RULES) + 1
    assert file.name in next(check.detail for check in checks if check.name == AS_WRITTEN)


def test_a_page_that_cannot_be_read_though_its_checksum_agrees(damaged):
    name = damaged.manifest["tables"]["features"][0]
    content = bytearray((damaged.folder / name).read_bytes())
    column = pq.read_metadata(damaged.folder / name).row_group(0).column(0)
    start = column.dictionary_page_offset or column.data_page_offset
    content[start : start + 40] = bytes(40)
    (damaged.folder / name).write_bytes(content)
    damaged.manifest["parts"][name] = asdict(damaged.store.facts(name))
    damaged.publish()
    assert damaged.failed() == {READS, "clips have their features", MERGED}


def test_a_manifest_that_states_other_rows(damaged):
    name = damaged.manifest["tables"]["pairs"][0]
    damaged.manifest["parts"][name]["rows"] += 1
    damaged.publish()
    (check,) = (check for check in verify(damaged.store) if not check.passed)
    assert check.name == AS_WRITTEN
    assert f"{name} has rows " in check.detail


@pytest.mark.parametrize("part", ["parts", "tables"])
def test_a_manifest_that_lacks_something(damaged, part):
    if part == "parts":
        del damaged.manifest["parts"][damaged.manifest["tables"]["cuts"][0]]
    else:
        for file in damaged.manifest["tables"].pop("resampled"):
            del damaged.manifest["parts"][file]
    damaged.publish()
    failed = damaged.failed()
    assert "the manifest is complete" in failed
    assert failed <= {"the manifest is complete", "clips have their resampled", MERGED}


def test_a_manifest_that_holds_what_is_of_no_table(damaged):
    (members,) = damaged.manifest["tables"].pop("members")
    damaged.manifest["tables"]["strange"] = damaged.manifest["tables"]["cuts"]
    damaged.publish()
    assert damaged.told() == {
        "the manifest is complete": "strange is no table of this motionary; "
        f"{members} has facts and is of no table"
    }


def test_tables_of_an_older_motionary_ask_for_another_run(damaged):
    damaged.manifest["schema_version"] = VERSION - 1
    damaged.publish()
    assert damaged.failed() == set()
    damaged.change("clusters", half_as_wide)
    assert f"tables have version {VERSION - 1}, here it is {VERSION}: run again" in damaged.told_by(SCHEMA)


def test_of_many_rows_that_are_wrong_three_are_told_and_the_others_counted(demo_catalog):
    with Catalog.open(demo_catalog) as catalog:
        told = wrong_rows(catalog, "select clip_id from clips", "select 'cut' from cuts limit 3")
    assert told[3:] == ["and 77 more of this kind", "cut", "cut", "cut"]


@pytest.mark.parametrize("content", ["", "{", "[]", '{"tables": {}}'])
def test_without_a_manifest_that_is_the_only_check(damaged, content):
    damaged.manifest_file.write_text(content)
    (check,) = verify(str(damaged.folder))
    assert (check.name, check.passed) == ("the manifest reads", False)
    assert "000001" in check.detail


def test_the_command_prints_a_line_a_check_and_exits_4_where_one_failed(motionary, damaged):
    code, out, _ = motionary("verify", damaged.folder)
    assert code == 0
    assert len(out.splitlines()) == len(_RULES) + 1
    assert all(line.startswith("PASSED  ") for line in out.splitlines())
    damaged.change("pairs", without(9))
    code, out, _ = motionary("verify", damaged.folder)
    assert code == 4
    (line,) = (line for line in out.splitlines() if not line.startswith("PASSED  "))
    assert line.startswith(f"FAILED  {PAIRS}: 1 of 3160 pairs are missing")
    code, out, _ = motionary("verify", damaged.folder, "--format", "json")
    assert code == 4
    assert [row["check"] for row in json.loads(out) if row["result"] == "FAILED"] == [PAIRS]


def test_the_command_on_a_snapshot_that_is_not_there(motionary, damaged):
    code, out, _ = motionary("verify", damaged.folder, "--snapshot", "7")
    assert code == 4
    assert out.startswith("FAILED  the manifest reads: ")
    assert motionary("verify", damaged.folder, "--snapshot", "000001")[0] == 0
