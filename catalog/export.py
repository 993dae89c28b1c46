"""Motions out of a catalog as files that other programs read: BVH, NPZ or Parquet.

BVH and NPZ are one file a clip, named by its `clip_id` with the suffix replaced; Parquet is `frames` or
`aligned` whole, with `clips` beside it that says what the frames are of. Lengths stay in the source's units.
Clips are read part by part, so that a library of any size passes through the memory of one batch.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from motionary.catalog.errors import CatalogError
from motionary.catalog.export_plan import ExportPlan, rows_of, with_column
from motionary.pipeline.stages.columns import per_clip
from motionary.pipeline.stages.motions import read_motion_rows
from motionary.pipeline.writers import whole_file, write_bvh, write_npz

_OF_ONE_FILE = (errno.ENAMETOOLONG, errno.EISDIR, errno.ENOTDIR, errno.EEXIST)


@dataclass(frozen=True)
class ExportedClip:
    """A clip and its file, or the reason why it has none."""

    clip_id: str
    path: Path
    reason: str | None = None


def write_export(plan: ExportPlan) -> Iterator[ExportedClip]:
    """Write the files of a plan, each whole or not at all, and tell of every clip when it is done.

    A clip that its format cannot hold is told with the reason, and the others go on.

    Raises
    ------
    CatalogError
        The folder cannot be written, or the disk is full; what was told before is written.
    """
    try:
        plan.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _cannot_write(plan.folder, error) from error
    yield from _whole_table(plan) if plan.format == "parquet" else _file_a_clip(plan)


def _parts(plan: ExportPlan) -> Iterator[pa.Table]:
    """Read the poses of a plan's clips, one part of the catalog at a time."""
    wanted = pc.field("clip_id").isin(plan.clips["clip_id"].combine_chunks())
    store = plan.catalog.store
    for file in plan.catalog.files(plan.table):
        part = pq.read_table(store.path(file), filesystem=store.filesystem, filters=wanted)
        if len(part):
            yield part


def _file_a_clip(plan: ExportPlan) -> Iterator[ExportedClip]:
    for part in _parts(plan):
        poses = per_clip(part)
        for clip in rows_of(plan.clips, list(poses)).to_pylist():
            motion = read_motion_rows(clip, poses[clip["clip_id"]], clip["frame_rate"])
            path = plan.paths[clip["clip_id"]]
            reason = None
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                if plan.format == "bvh":
                    write_bvh(motion, path)
                else:
                    write_npz(motion, path, label=clip["label"])
            except ValueError as error:
                reason = str(error)
            except OSError as error:
                if error.errno not in _OF_ONE_FILE:
                    raise _cannot_write(path, error) from error
                reason = f"{path}: {error.strerror}"
            yield ExportedClip(clip["clip_id"], path, reason)


def _whole_table(plan: ExportPlan) -> Iterator[ExportedClip]:
    path = next(iter(plan.paths.values()))
    clusters = plan.clips.select(["clip_id", "cluster_id", "label"])
    try:
        with whole_file(plan.folder / "clips.parquet") as temporary:
            pq.write_table(plan.clips, temporary, compression="zstd")
        with whole_file(path) as temporary, ExitStack() as stack:
            writer = None
            for part in _parts(plan):
                about = rows_of(clusters, part["clip_id"])
                rows = with_column(with_column(part, about, "cluster_id"), about, "label")
                writer = writer or stack.enter_context(
                    pq.ParquetWriter(temporary, rows.schema, compression="zstd")
                )
                writer.write_table(rows)
                yield from (ExportedClip(clip_id, path) for clip_id in pc.unique(part["clip_id"]).to_pylist())
    except OSError as error:
        raise _cannot_write(path, error) from error


def _cannot_write(path: Path, error: OSError) -> CatalogError:
    return CatalogError(f"{path} cannot be written: {error.strerror}")
