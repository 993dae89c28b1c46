"""A data card counts what was written, and says whose it is."""

import json
from collections import Counter
from pathlib import Path

import pytest

from motionary.catalog import Catalog
from motionary.catalog.card_text import card_text
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job


@pytest.fixture(scope="module")
def licensed(demo_library, silent_progress, tmp_path_factory) -> Catalog:
    """Catalog of clips under two licences, and some under none."""
    library = tmp_path_factory.mktemp("licensed") / "library"
    library.mkdir()
    files = (
        sorted((demo_library / "walk").glob("*.bvh"))[:4] + sorted((demo_library / "run").glob("*.bvh"))[:3]
    )
    rows = ["clip_id,action,subject,dataset,licence,attribution"]
    for number, file in enumerate(files):
        (library / file.name).write_bytes(file.read_bytes())
        action, _, subject, _ = file.stem.split("_")
        terms = ["CC BY 4.0,Ann | <b>Co</b>", "CC BY-NC 4.0,", ","][number % 3]
        rows.append(f"{file.name},{action},{subject},set {number % 2},{terms}")
    labels = library.parent / "labels.csv"
    labels.write_text("\n".join(rows) + "\n")
    job = Job([str(library)], str(library.parent / "takes"), PipelineConfig(), labels)
    return run(job, silent_progress).catalog


def exported(catalog: Catalog, folder: Path, **how: object) -> tuple[dict, list[dict], str]:
    catalog.export(folder, "npz", **{"card": True} | how)
    clips = [json.loads(line) for line in (folder / "clips.jsonl").read_text().splitlines()]
    return json.loads((folder / "card.json").read_text()), clips, (folder / "README.md").read_text()


def test_licences_are_summed_and_clips_without_one_are_named(licensed, tmp_path):
    card, clips, text = exported(licensed, tmp_path)
    stated = {row["clip_id"]: row["licence"] for row in licensed.clips.to_arrow().to_pylist()}
    assert {clip["clip_id"]: clip["licence"] for clip in clips} == stated
    counts = Counter(stated.values())
    assert {row["licence"]: row["clips"] for row in card["licences"]} == {
        "CC BY 4.0": counts["CC BY 4.0"], "CC BY-NC 4.0": counts["CC BY-NC 4.0"]
    }  # fmt: skip
    without = [clip_id for clip_id, licence in stated.items() if licence is None]
    assert card["without_licence"]["clips"] == len(without) == 2
    assert card["without_licence"]["clip_ids"] == sorted(without)
    assert "**No licence is stated for 2 clips**" in text
    assert card["credits"] == ["Ann | <b>Co</b>"]
    assert r"- Ann \| \<b\>Co\</b\>" in text  # what people wrote is shown, and not read as Markdown


def test_every_count_is_that_of_the_clips(licensed, tmp_path):
    card, clips, _ = exported(licensed, tmp_path, split={"train": 0.6, "test": 0.4})
    assert card["clips"] == len(clips) == len(licensed.clips)
    assert card["frames"] == sum(clip["frames"] for clip in clips)
    assert card["seconds"] == pytest.approx(sum(clip["seconds"] for clip in clips), abs=1e-3)
    for table, columns in (
        ("labels", ["label", "label_source"]),
        ("clusters", ["cluster_id"]),
        ("sources", ["dataset", "format", "licence"]),
    ):
        counts = Counter(tuple(clip[name] for name in columns) for clip in clips)
        assert {tuple(row[name] for name in columns): row["clips"] for row in card[table]} == counts
        for row in card[table]:
            mine = [clip for clip in clips if all(clip[name] == row[name] for name in columns)]
            parts = Counter(clip["split"] for clip in mine)
            assert row["parts"] == {part: parts[part] for part in ("train", "test")}
            assert row["seconds"] == pytest.approx(sum(clip["seconds"] for clip in mine), abs=1e-3)
    for part in card["split"]["parts"]:
        assert part["clips"] == sum(clip["split"] == part["part"] for clip in clips)
        assert part["share"] == pytest.approx(part["clips"] / len(clips))
    assert sum(part["groups"] for part in card["split"]["parts"]) == card["split"]["recordings"] == 7


def test_it_says_where_the_motions_come_from(licensed, tmp_path):
    card, clips, text = exported(licensed, tmp_path, where="action = 'walk'")
    assert (card["catalog"], card["snapshot"]) == ("takes", licensed.snapshot.snapshot_id)
    assert card["run"] == licensed.runs.to_arrow()["run_id"][-1].as_py()
    assert card["settings"] == licensed.settings
    assert card["chosen_by"] == {"where": "action = 'walk'"}
    assert "chosen by where `action = 'walk'`" in text
    assert card["libraries"] == ["library"]  # and not where it lies on this machine
    assert str(tmp_path.parent) not in text + json.dumps(card)
    for clip in clips:
        assert (tmp_path / clip["file"]).is_file()


def test_equal_exports_have_equal_cards(licensed, tmp_path):
    for name in ("one", "other"):
        exported(licensed, tmp_path / name, split={"train": 0.6, "test": 0.4}, group="subject")
    for name in ("README.md", "card.json", "clips.jsonl"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()


def test_clips_that_were_not_written_are_not_counted(licensed, tmp_path):
    clip_ids = licensed.clips.to_arrow()["clip_id"].to_pylist()
    (tmp_path / f"{clip_ids[0][:-4]}.npz").mkdir()  # stands where a file should
    card, clips, text = exported(licensed, tmp_path, overwrite=True)
    assert list(card["not_written"]) == clip_ids[:1]
    assert [clip["clip_id"] for clip in clips] == clip_ids[1:]
    assert card["clips"] == len(clip_ids) - 1
    assert "## Not written" in text


def test_a_long_table_is_cut_on_the_page_only(licensed, tmp_path):
    card, _, _ = exported(licensed, tmp_path)
    row = {"clips": 1, "seconds": 1.0}
    card["labels"] = [{"label": f"label {number}", "label_source": "supplied"} | row for number in range(60)]
    text = card_text(card)
    assert "label 49" in text
    assert "label 50" not in text
    assert "10 more stand in `card.json`" in text


def test_an_export_without_a_card_leaves_none(licensed, tmp_path):
    licensed.export(tmp_path, "npz")
    assert {file.suffix for file in tmp_path.rglob("*")} == {".npz"}


def test_names_that_nobody_gave_are_told_apart(licensed, tmp_path):
    card, _, _ = exported(licensed, tmp_path)
    assert "propagated" not in card_text(card)
    card["labels"][0]["label_source"] = "propagated"
    assert "nobody named these clips" in card_text(card)
