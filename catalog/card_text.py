"""A data card as Markdown, for the folder it lies in."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

_LONGEST = 50  # rows of a table that people still read

_FILES = {
    "bvh": ("`*.bvh`", "a clip each: root in the world, the other joints' rotations in degrees, ZXY"),
    "npz": (
        "`*.npz`",
        "a clip each: `positions`, `rotations`, `joint_names`, `parents`, `offsets`, `fps`, ...",
    ),
    "csv": (
        "`*.csv`",
        "a clip each, a row a frame: `x.JOINT` ... in the world, `qx.JOINT` ... to the parent",
    ),
    "parquet": ("`{poses}.parquet`", "a row a frame; `clips.parquet` tells the skeletons"),
    "jsonl": ("`{poses}.jsonl`", "a line a clip: `joints`, `parents`, `offsets`, `positions`, `rotations`"),
}

_KEPT = {
    "bytes": "have the same bytes",
    "shared frames": "share a frame (as cuts of one recording do)",
}


def card_text(card: Mapping[str, Any]) -> str:
    """Write a card, see `motionary.catalog.data_card.data_card`, as Markdown."""
    parts = [
        _opening(card),
        _files(card),
        _split(card["split"]) if card["split"] else "",
        _sources(card),
        _labels(card["labels"]),
        f"## Clusters\n\n{_counts(card['clusters'], ['cluster_id'])}",
        _not_written(card["not_written"]),
        _settings(card),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _opening(card: Mapping[str, Any]) -> str:
    poses = (
        "In time they follow their clusters' references, at one rate."
        if card["poses"] == "aligned"
        else "They run as captured, at their own rates."
    )
    libraries = ", ".join(map(_code, card["libraries"])) or "no library"
    chosen = ", ".join(f"{name} {_code(value)}" for name, value in card["chosen_by"].items())
    return (
        f"# Motions of {_plain(card['catalog'])}\n\n"
        f"{_number(card['clips'], 'clip')} of motion capture as {card['format'].upper()}; captured were "
        f"{_number(card['frames'], 'frame')}, {card['seconds'] / 60:.1f} minutes. {poses} Taken from "
        f"snapshot {card['snapshot']} of catalog {_code(card['catalog'])}, made by run {card['run']} of "
        f"motionary {card['versions']['run']} from {libraries}; "
        f"{f'chosen by {chosen}' if chosen else 'all clips'}."
    )


def _files(card: Mapping[str, Any]) -> str:
    name, meaning = _FILES[card["format"]]
    folders = ", ".join(f"`{part['part']}/`" for part in card["split"]["parts"]) if card["split"] else ""
    rows = [
        (name.format(poses=card["poses"]), meaning + (f"; in {folders}" if folders else "")),
        ("`clips.jsonl`", "a line a clip: its `file`, cluster, name, supplied labels, licence"),
        ("`card.json`", "this page for programs, complete"),
    ]
    return (
        f"## Files\n\n{_table(('file', 'is'), rows)}\n\n"
        "Right-handed, Y up; a figure that faces +Z has its left side at +X. Quaternions are x, y, z, w. "
        "Lengths are in the source's units: `unit` in `clips.jsonl` is the metres in one, where it is known."
    )


def _split(split: Mapping[str, Any]) -> str:
    header = ("part", "clips", "share", "asked", "groups", "seconds")
    rows = [
        (one["part"], one["clips"], f"{one['share']:.3f}", f"{one['asked']:g}", one["groups"], one["seconds"])
        for one in split["parts"]
    ]
    kept = [_KEPT.get(one, f"agree in {_code(one)}") for one in split["kept_together"]]
    by = "bytes and frames" if "shared frames" in split["kept_together"] else "bytes"
    text = (
        f"## Split\n\n{_table(header, rows)}\n\nShares are of clips. Never parted are clips that "
        f"{' or '.join(kept)}, directly or through others; they make {split['recordings']} recordings by "
        f"{by}. Seed {split['seed']}."
    )
    if split["without_value"]:
        text += (
            f" {_number(split['without_value'], 'clip')} without a value are kept together, too, as they may "
            "be of one; what other parts have of the same one nobody can say."
        )
    return text


def _sources(card: Mapping[str, Any]) -> str:
    text = f"## Sources and licences\n\n{_counts(card['sources'], ['dataset', 'format', 'licence'])}"
    unlicensed = card["without_licence"]["clips"]
    if unlicensed:
        text += (
            f"\n\n**No licence is stated for {_number(unlicensed, 'clip')}** (`card.json` lists them): ask "
            "whose they are before you pass them on."
        )
    if card["credits"]:
        text += "\n\nTo be named where these motions are used:\n\n"
        text += "\n".join(f"- {_plain(one)}" for one in card["credits"])
    elif card["clips"] > unlicensed:
        text += "\n\nName the sources as their licences ask where you use these motions."
    return text


def _labels(rows: Sequence[Mapping[str, Any]]) -> str:
    text = f"## Labels\n\n{_counts(rows, ['label', 'label_source'])}"
    if any(row["label_source"] == "propagated" for row in rows):
        text += (
            "\n\n*propagated*: nobody named these clips; they are called as most of their cluster is, with "
            "the `confidence` that `clips.jsonl` tells."
        )
    return text


def _not_written(failed: Mapping[str, str]) -> str:
    if not failed:
        return ""
    rows = [(_code(clip_id), _plain(reason)) for clip_id, reason in failed.items()]
    return f"## Not written\n\n{_table(('clip', 'reason'), rows)}"


def _settings(card: Mapping[str, Any]) -> str:
    settings = json.dumps(card["settings"], indent=1, ensure_ascii=False).replace("```", "'''")
    versions = ", ".join(f"{name} {number}" for name, number in card["versions"].items() if name != "run")
    return f"## Settings of the run\n\n```json\n{settings}\n```\n\nWritten by {versions}."


def _counts(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> str:
    parts = list(rows[0].get("parts", {})) if rows else []
    shown = [
        (
            *("none" if row[name] is None else _plain(row[name]) for name in columns),
            row["clips"],
            row["seconds"],
            *(row["parts"][part] for part in parts),
        )
        for row in rows[:_LONGEST]
    ]
    more = f"\n\n{len(rows) - _LONGEST} more stand in `card.json`." if len(rows) > _LONGEST else ""
    return _table((*columns, "clips", "seconds", *parts), shown) + more


def _table(header: Iterable[str], rows: Sequence[Sequence[object]]) -> str:
    header = list(header)
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def _plain(value: object) -> str:
    """Text in one line that Markdown shows and does not read."""
    text = " ".join(str(value).split())
    for sign in "\\`*_[]|<>":
        text = text.replace(sign, f"\\{sign}")
    return text


def _code(value: object) -> str:
    text = " ".join(str(value).split()).replace("`", "'").replace("|", "\\|")
    return f"`{text}`"


def _number(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'' if count == 1 else 's'}"
