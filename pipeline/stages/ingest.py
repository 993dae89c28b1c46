"""Files -> motions, their features, and what could not be read."""

from __future__ import annotations

import traceback
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pyarrow as pa

from motionary.pipeline.canonical import SkeletonError
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.features import FrameFeatures, frame_features
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import ReadError, read_motion
from motionary.pipeline.readers.digests import digest_of
from motionary.pipeline.readers.library import Source
from motionary.pipeline.stages.columns import carried_rows, renamed, vectors
from motionary.pipeline.stages.motions import motion_rows, skeleton_record
from motionary.pipeline.tables import TABLES

VERSION = 3
MAKES = ("ingested", "frames", "features", "quarantine")

Tables = dict[str, pa.Table]


def ingest(
    clips: Sequence[tuple[str, Source]],
    config: PipelineConfig,
    carried: Sequence[tuple[Mapping[str, pa.Table], Mapping[str, str]]] = (),
) -> dict[str, pa.Table]:
    """Read clips, compute their features, and set aside what cannot be read.

    Parameters
    ----------
    clips : sequence of (str, Source)
        A batch of a library, each clip with the key of its content; of equal keys one is read.
    config : PipelineConfig
        `read` and `features` are used.
    carried : sequence of (tables, names)
        Earlier results that hold some of the clips, and what those are called there.

    Returns
    -------
    dict of str to pyarrow.Table
        `ingested`, `frames`, `features` and `quarantine`. Every clip is a row of `ingested` or
        of `quarantine`.
    """
    known = {
        name: carried_rows(carried, name, "path" if name == "quarantine" else "clip_id") for name in MAKES
    }
    first: dict[str, Tables] = {}
    rows: dict[str, list[pa.Table]] = {name: [TABLES[name].empty_table()] for name in MAKES}
    for key, source in clips:
        tables = first.get(key) or {
            name: known[name][source.clip_id] for name in MAKES if source.clip_id in known[name]
        }
        tables = _named(tables, source) if tables else _read(source, config)
        first.setdefault(key, tables)
        for name, table in tables.items():
            rows[name].append(table)
    return {name: pa.concat_tables(tables) for name, tables in rows.items()}


def _read(source: Source, config: PipelineConfig) -> Tables:
    try:
        return _ingest_one(source, config)
    except (ReadError, SkeletonError) as error:
        line = error.line if isinstance(error, ReadError) else None
        passing = isinstance(error.__cause__, OSError | ImportError)  # a package that is not installed yet
        passing = passing or digest_of(source.files) != source.digest
        return {"quarantine": _quarantined(source, line, error.what, error.mend, retry=passing)}
    except Exception as error:  # one file that meets a fault of ours must not stop the job, nor hide it
        place = traceback.extract_tb(error.__traceback__)[-1]
        what = f"unexpected {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"
        mend = "report this fault of motionary with the file"
        return {"quarantine": _quarantined(source, None, what, mend, retry=True)}


def _named(tables: Tables, source: Source) -> Tables:
    """Give what was read of equal bytes the names of another clip."""
    named = {
        name: renamed(table, source.clip_id, "path" if name == "quarantine" else "clip_id")
        for name, table in tables.items()
    }
    if "ingested" in named:
        named["ingested"] = renamed(named["ingested"], source.path, "path")
    return named


def _ingest_one(source: Source, config: PipelineConfig) -> dict[str, pa.Table]:
    skeleton = source.files[1] if len(source.files) > 1 else None
    own = config.features.conventions
    motion = read_motion(source.files[0], skeleton=skeleton, conventions=own, **asdict(config.read))
    if digest_of(source.files) != source.digest:
        raise ReadError(
            source.files[0], None, "it is not what it was when the run began",
            "run again, and where workers run elsewhere let them see the same files",
        )  # fmt: skip
    features = frame_features(motion, config.features)
    return {
        "ingested": _ingested(source, motion, features),
        "frames": motion_rows(source.clip_id, motion),
        "features": _feature_rows(source.clip_id, features),
    }


def _quarantined(source: Source, line: int | None, what: str, mend: str, *, retry: bool) -> pa.Table:
    row = {
        "path": source.clip_id,
        "line": line,
        "reason": what,
        "mend": mend,
        "digest": source.digest,
        "retry": retry,
    }
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
