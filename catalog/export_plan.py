"""What an export writes where; nothing is written yet."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import pyarrow as pa

from motionary.catalog.errors import CatalogError
from motionary.catalog.export_choice import chosen_clips, described
from motionary.catalog.export_files import file_names, refuse_existing, refuse_library
from motionary.catalog.query import Catalog
from motionary.catalog.splits import Split, split_clips

ExportFormat = Literal["bvh", "npz", "csv", "parquet", "jsonl"]

_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)
ONE_FILE = ("parquet", "jsonl")
"""Formats of which one file holds all clips, or all of a part."""

CARD_FILES = ("README.md", "card.json", "clips.jsonl")
"""What stands beside the motions where a data card is asked for."""


@dataclass(frozen=True)
class ExportPlan:
    """What is to be written where; nothing has been written yet.

    Parameters
    ----------
    catalog : Catalog
    folder : Path
    format : {"bvh", "npz", "csv", "parquet", "jsonl"}
    table : {"frames", "aligned"}
        Where the poses come from.
    clips : pyarrow.Table
        A row a clip, in clip_id order: its rows of `clusters` and `clips`, and `frame_rate`, that of the
        poses; `split`, its part, where there is a split.
    paths : mapping of str to Path
        Each clip's file.
    split : Split, optional
    card : bool
        Whether a data card and a list of the clips are written beside the files.
    chosen_by : mapping of str to object
        How the clips were chosen; empty for all.
    """

    catalog: Catalog
    folder: Path
    format: ExportFormat
    table: Literal["frames", "aligned"]
    clips: pa.Table
    paths: Mapping[str, Path]
    split: Split | None = None
    card: bool = False
    chosen_by: Mapping[str, object] = field(default_factory=dict)


def plan_export(
    catalog: Catalog,
    folder: str | os.PathLike[str],
    format_: ExportFormat = "bvh",
    *,
    clips: Sequence[str] | None = None,
    cluster: int | str | None = None,
    where: str | None = None,
    aligned: bool = False,
    split: Mapping[str, float] | None = None,
    group: str | Sequence[str] = (),
    seed: int = 0,
    shared_frames: bool = True,
    card: bool = False,
    overwrite: bool = False,
) -> ExportPlan:
    """Say which clips go to which files; the parameters are those of `Catalog.export`.

    Raises
    ------
    CatalogError
        There is no such clip or cluster, or nothing to export; the condition or the split cannot be used; the
        folder holds one of the files already, or is part of the library.
    """
    if format_ not in _FORMATS:
        raise CatalogError(
            f"format is {format_!r}; a motion is exported as {', '.join(_FORMATS[:-1])} or {_FORMATS[-1]}"
        )
    if not str(folder):
        raise CatalogError("the folder to export into has no name; for the working directory write .")
    if clips is not None and cluster is not None:
        raise CatalogError("clips and a cluster are given; a selection is by one of them")
    columns = (group,) if isinstance(group, str) else tuple(group)
    if split is None and columns:
        raise CatalogError(f"clips are grouped by {', '.join(columns)} for a split, and none is asked for")
    table: Literal["frames", "aligned"] = "aligned" if aligned else "frames"
    catalog.files(table)  # a catalog that lacks it is refused before its clips are looked at
    destination = Path(folder)
    chosen = chosen_clips(catalog, clips, cluster, where)
    parts = None if split is None else split_clips(catalog, chosen, split, columns, shared_frames, seed)
    part_of = None if parts is None else parts.part_of
    paths = _paths(catalog, chosen, destination, format_, table, part_of)
    card = card or parts is not None
    written = list(dict.fromkeys(paths.values()))
    written += [destination / "clips.parquet"] if format_ == "parquet" else []
    written += [destination / name for name in CARD_FILES] if card else []
    refuse_library(catalog, written)
    if not overwrite:
        refuse_existing(written)
    about = described(catalog, chosen, aligned, part_of)
    by = {"clips": clips and len(clips), "cluster": cluster, "where": where}
    chosen_by = {name: value for name, value in by.items() if value is not None}
    return ExportPlan(catalog, destination, format_, table, about, paths, parts, card, chosen_by)


def _paths(
    catalog: Catalog,
    chosen: Sequence[str],
    folder: Path,
    format_: ExportFormat,
    table: str,
    part_of: Mapping[str, str] | None,
) -> dict[str, Path]:
    """Name each clip's file, in the folder of its part."""
    if format_ in ONE_FILE:
        names = dict.fromkeys(chosen, f"{table}.{format_}")
    else:
        # Names are given to the whole catalog, so that a clip's does not depend on what else is chosen.
        names = file_names(catalog.clips.to_arrow()["clip_id"].to_pylist(), f".{format_}")
    return {one: folder / (part_of[one] if part_of else "") / names[one] for one in chosen}
