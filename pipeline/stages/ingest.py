"""Files -> motions, their features, and what could not be read."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from motionary.pipeline.canonical import SkeletonError
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.features import FrameFeatures, frame_features, merged
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import ReadError, read_motion
from motionary.pipeline.readers.library import Source, digest_of
from motionary.pipeline.resample import Resampled
from motionary.pipeline.stages.columns import vectors
from motionary.pipeline.stages.motions import motion_rows, skeleton_record
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("ingested", "frames", "features", "resampled", "quarantine")


def ingest(sources: Sequence[Source], config: PipelineConfig) -> dict[str, pa.Table]:
    """Read clips, compute their features, and set aside what cannot be read.

    Parameters
    ----------
    sources : sequence of Source
        Clips of a library.
    config : PipelineConfig
        `read` and `features` are used.

    Returns
    -------
    dict of str to pyarrow.Table
        `ingested`, `frames`, `features`, `resampled` and `quarantine`. Every source is a row of `ingested`
        or of `quarantine`.
    """
    rows: dict[str, list[pa.Table]] = {name: [TABLES[name].empty_table()] for name in MAKES}
    for source in sources:
        try:
            tables = _ingest_one(source, config)
        except (ReadError, SkeletonError) as error:
            line = error.line if isinstance(error, ReadError) else None
            tables = {"quarantine": _quarantined(source, line, error.what, error.mend)}
        except Exception as error:  # one file that meets a fault of ours must not stop the job, nor hide it
            place = traceback.extract_tb(error.__traceback__)[-1]
            what = f"unexpected {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"
            tables = {
                "quarantine": _quarantined(source, None, what, "report this fault of motionary with the file")
            }
        for name, table in tables.items():
            rows[name].append(table)
    return {name: pa.concat_tables(tables) for name, tables in rows.items()}


def _ingest_one(source: Source, config: PipelineConfig) -> dict[str, pa.Table]:
    skeleton = source.files[1] if len(source.files) > 1 else None
    motion = read_motion(source.files[0], skeleton=skeleton, **asdict(config.read))
    if digest_of(source.files) != source.digest:
        raise ReadError(source.files[0], None, "it changed while the run was reading it", "run again")
    compared = frame_features(motion, config.features)
    # Alignment and style always read pose and travel, whatever the distances compare.
    kept = compared
    if config.features.kind != "pose+travel":
        kept = frame_features(motion, replace(config.features, kind="pose+travel"))
    return {
        "ingested": _ingested(source, motion, kept),
        "frames": motion_rows(source.clip_id, motion),
        "features": _feature_rows(source.clip_id, kept),
        "resampled": _resampled_rows(source.clip_id, merged(compared, config.features)),
    }


def _quarantined(source: Source, line: int | None, what: str, mend: str) -> pa.Table:
    row = {"path": source.clip_id, "line": line, "reason": what, "mend": mend}
    return pa.Table.from_pylist([row], schema=TABLES["quarantine"])


def _ingested(source: Source, motion: Motion, features: FrameFeatures) -> pa.Table:
    row = {
        "clip_id": source.clip_id,
        "path": source.path,
        "digest": source.digest,
        "format": source.format,
        "fps": motion.fps,
        "frames": motion.frames,
        "seconds": motion.seconds,
        "convention": features.convention,
        "leg_length": features.leg_length,
        "unit": motion.unit,
        "skeleton": skeleton_record(motion.skeleton),
        "notes": list(motion.notes),
    }
    return pa.Table.from_pylist([row], schema=TABLES["ingested"])


def _feature_rows(clip_id: str, features: FrameFeatures) -> pa.Table:
    frames = len(features.values)
    return pa.table(
        {
            "clip_id": pa.repeat(clip_id, frames),
            "frame": np.arange(frames, dtype=np.int32),
            "root_x": features.path[:, 0].astype(np.float32),
            "root_z": features.path[:, 1].astype(np.float32),
            "root_height": features.height.astype(np.float32),
            "heading": features.heading.astype(np.float32),
            "feature": vectors(features.values),
        },
        schema=TABLES["features"],
    )


def _resampled_rows(clip_id: str, resampled: Resampled) -> pa.Table:
    groups = len(resampled.values)
    return pa.table(
        {
            "clip_id": pa.repeat(clip_id, groups),
            "frame": np.arange(groups, dtype=np.int32),
            "first_frame": resampled.first.astype(np.int32),
            "last_frame": resampled.last.astype(np.int32),
            "feature": vectors(resampled.values),
        },
        schema=TABLES["resampled"],
    )
