"""Motions out of a catalog as files that other programs read: BVH, NPZ, CSV, Parquet or JSONL.

BVH, NPZ and CSV are one file a clip, named by its `clip_id` with the suffix replaced; Parquet is `frames` or
`aligned` whole, with `clips` beside it that says what the frames are of; JSONL is a line a clip. A split puts
them into a folder a part. Lengths stay in the source's units. Clips are read part by part, so that a library
of any size passes through the memory of one batch.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from motionary.catalog.data_card import write_card
from motionary.catalog.errors import CatalogError
from motionary.catalog.export_choice import rows_of, with_column
from motionary.catalog.export_plan import ONE_FILE, ExportPlan
from motionary.catalog.places import rows_by_part
from motionary.pipeline.stages.columns import per_clip
from motionary.pipeline.stages.motions import read_motion_rows
from motionary.pipeline.writers import motion_line, whole_file, write_bvh, write_csv, write_npz

_OF_ONE_FILE = (errno.ENAMETOOLONG, errno.EISDIR, errno.ENOTDIR, errno.EEXIST)


@dataclass(frozen=True)
class ExportedClip:
    """A clip and its file, or the reason why it has none."""

    clip_id: str
    path: Path
    reason: str | None = None


def write_export(plan: ExportPlan) -> Iterator[ExportedClip]:
    """Write the files of a plan, each whole or not at all, and tell of every clip when it is done.

    A clip that its format cannot hold is told with the reason, and the others go on. The data card comes
    last: it counts what was written.

    Raises
    ------
    CatalogError
        The folder cannot be written, or the disk is full; what was told before is written.
    """
    for folder in {path.parent for path in plan.paths.values()} if plan.format in ONE_FILE else {plan.folder}:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _cannot_write(folder, error) from error
    write = {"parquet": _tables, "jsonl": _lines}.get(plan.format, _file_a_clip)
    failed = {}
    for one in write(plan):
        if one.reason is not None:
            failed[one.clip_id] = one.reason
        yield one
    if plan.card:
        try:
            write_card(plan, failed)
        except OSError as error:
            raise _cannot_write(plan.folder, error) from error


def _clips(plan: ExportPlan) -> Iterator[tuple[dict, pa.Table]]:
    """Read a plan's clips: what is known of each, and its poses."""
    for part in rows_by_part(plan.catalog, plan.table, plan.paths):
        poses = per_clip(part)
        for clip in rows_of(plan.clips, list(poses)).to_pylist():
            yield clip, poses[clip["clip_id"]]


def _file_a_clip(plan: ExportPlan) -> Iterator[ExportedClip]:
    for clip, poses in _clips(plan):
        path = plan.paths[clip["clip_id"]]
        reason = None
        try:
            motion = read_motion_rows(clip, poses, clip["frame_rate"])
            path.parent.mkdir(parents=True, exist_ok=True)
            if plan.format == "bvh":
                write_bvh(motion, path)
            elif plan.format == "csv":
                write_csv(motion, path)
            else:
                write_npz(motion, path, label=clip["label"])
        except ValueError as error:
            reason = str(error)
        except OSError as error:
            if error.errno not in _OF_ONE_FILE:
                raise _cannot_write(path, error) from error
            reason = f"{path}: {error.strerror}"
        yield ExportedClip(clip["clip_id"], path, reason)


def _lines(plan: ExportPlan) -> Iterator[ExportedClip]:
    files: dict[Path, TextIO] = {}
    try:
        with ExitStack() as stack:
            for path in set(plan.paths.values()):
                temporary = stack.enter_context(whole_file(path))
                files[path] = stack.enter_context(temporary.open("w", encoding="utf-8", newline="\n"))
            for clip, poses in _clips(plan):
                path = plan.paths[clip["clip_id"]]
                reason = None
                try:
                    motion = read_motion_rows(clip, poses, clip.pop("frame_rate"))
                    files[path].write(motion_line(motion, clip))
                except ValueError as error:
                    reason = str(error)
                yield ExportedClip(clip["clip_id"], path, reason)
    except OSError as error:
        raise _cannot_write(plan.folder, error) from error


def _tables(plan: ExportPlan) -> Iterator[ExportedClip]:
    known = ["cluster_id", "label", *(["split"] if plan.split else [])]
    writers: dict[Path, pq.ParquetWriter] = {}
    try:
        with whole_file(plan.folder / "clips.parquet") as temporary:
            pq.write_table(plan.clips, temporary, compression="zstd")
        with ExitStack() as stack:
            for part in rows_by_part(plan.catalog, plan.table, plan.paths):
                rows, about = part, rows_of(plan.clips.select(["clip_id", *known]), part["clip_id"])
                for name in known:
                    rows = with_column(rows, about, name)
                clip_ids = pc.unique(part["clip_id"]).to_pylist()
                for path in dict.fromkeys(plan.paths[clip_id] for clip_id in clip_ids):
                    if path not in writers:
                        temporary = stack.enter_context(whole_file(path))
                        writers[path] = stack.enter_context(
                            pq.ParquetWriter(temporary, rows.schema, compression="zstd")
                        )
                    there = [clip_id for clip_id in clip_ids if plan.paths[clip_id] == path]
                    writers[path].write_table(rows.filter(pc.is_in(rows["clip_id"], pa.array(there))))
                yield from (ExportedClip(clip_id, plan.paths[clip_id]) for clip_id in clip_ids)
    except OSError as error:
        raise _cannot_write(plan.folder, error) from error


def _cannot_write(path: Path, error: OSError) -> CatalogError:
    return CatalogError(f"{path} cannot be written: {error.strerror}")
