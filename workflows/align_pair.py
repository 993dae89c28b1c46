"""One motion aligned to another by any of the methods, with scores, and a page that shows it.

Whatever a method reads, features, postures or rotations, it is given at one frame rate, so that its warp fits
the poses that all are scored by.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pyarrow as pa

from motionary.catalog import Catalog
from motionary.catalog.example import example_of
from motionary.catalog.views.aligned_pair import AlignedPair, Take
from motionary.catalog.views.alignment_lines import MOST_SHOWN
from motionary.catalog.views.alignment_page import alignment_page
from motionary.catalog.views.alignment_ways import Way
from motionary.pipeline.alignment import Warp, dtw
from motionary.pipeline.alignment.postures import weighted_postures
from motionary.pipeline.alignment.registry import ALIGNERS, Aligner
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.evaluation import alignment_scores
from motionary.pipeline.features import POSE_COLUMNS, frame_features
from motionary.pipeline.joint_rotations import joint_rotations, refuse_other_joints
from motionary.pipeline.motion import FloatArray
from motionary.pipeline.readers import read_motion
from motionary.pipeline.tables import table_field
from motionary.pipeline.writers import whole_file
from motionary.workflows.errors import UserError

SCORES = pa.schema(
    [
        table_field("method", pa.string(), "what --method calls it"),
        table_field("title", pa.string(), "what charts call it"),
        table_field(
            "correlation",
            pa.float64(),
            "the mean Pearson correlation with the reference over the coordinates that move in either",
            nullable=True,
        ),
        table_field(
            "distance", pa.float64(), "the mean distance of its poses from the reference's", "leg lengths"
        ),
        table_field("from_dtw", pa.float64(), "the mean distance in time from the warp of DTW", "s"),
        table_field("longest_still", pa.float64(), "the longest that the warp holds a single frame", "s"),
        table_field(
            "longest_leap", pa.float64(), "the most of it that passes from one frame to the next", "s"
        ),
        table_field(
            "roughness",
            pa.float64(),
            "how sharply its joints turn for how much they move",
            nullable=True,
        ),
        table_field("seconds", pa.float64(), "the time that the method took"),
    ]
)


@dataclass(frozen=True, eq=False)
class Alignment:
    """A motion aligned to another, and how well.

    Parameters
    ----------
    pair : AlignedPair
    scores : pyarrow.Table
        Of `SCORES`; the first row is `uniform`, how it was before.
    refused : dict of str to str
        Methods that could not align the two, and why.
    """

    pair: AlignedPair
    scores: pa.Table
    refused: dict[str, str]


def read_pair(moving: str, reference: str, catalog: Catalog | None = None) -> AlignedPair:
    """Read two motions that are to be aligned.

    Parameters
    ----------
    moving, reference : str
        A file, or of a catalog a clip_id too: the one that is warped, and the one whose time it takes.
    catalog : Catalog, optional
        Its settings say how files are read and at which rate; the usual ones without it.

    Returns
    -------
    AlignedPair
        Without warps.

    Raises
    ------
    UserError
        Without a catalog, one of them is a folder.
    CatalogError
        The catalog has no such clip, nor is it a file.
    ReadError, SkeletonError
        A file cannot be read, or its skeleton is not known.
    """
    config = catalog.config.features if catalog is not None else FeatureConfig()
    return AlignedPair(
        _take(moving, catalog),
        _take(reference, catalog),
        rate=config.frame_rate,
        warps={},
        conventions=config.conventions,
    )


def align_pair(pair: AlignedPair, methods: Sequence[str], *, lenient: bool = False) -> Alignment:
    """Align a motion to another.

    Parameters
    ----------
    pair : AlignedPair
        From `read_pair`.
    methods : sequence of str
        Of `ALIGNERS`; the plain stretch is always among the scores.
    lenient : bool
        Go on without the methods that cannot align the two.

    Raises
    ------
    UserError
        A method cannot align the two; the message says why, and which methods read poses alone.
    """
    plain = dtw(pair.moving.pose, pair.reference.pose)
    warps: dict[str, Warp] = {}
    rows: list[dict[str, Any]] = []
    refused: dict[str, str] = {}
    for aligner in (ALIGNERS[name] for name in dict.fromkeys(["uniform", *methods])):
        try:
            moving, reference = _read_by(aligner, pair)
            _load_kernels(aligner, moving)
            started = perf_counter()
            warp = aligner.align(moving, reference)
        except ValueError as error:
            if not lenient:
                raise UserError(_refusal(pair, aligner, error)) from error
            refused[aligner.name] = str(error)
            continue
        seconds = perf_counter() - started
        rows.append(
            {
                "method": aligner.name,
                "title": aligner.title,
                **asdict(alignment_scores(pair.moving.pose, pair.reference.pose, warp, plain, pair.rate)),
                "seconds": seconds,
            }
        )
        if aligner.name != "uniform":
            warps[aligner.title] = warp
    if len(warps) > MOST_SHOWN:  # not all are shown at once: first those that bring the two nearest
        correlation = {row["title"]: row["correlation"] or 0.0 for row in rows}
        warps = dict(sorted(warps.items(), key=lambda one: -correlation[one[0]]))
    return Alignment(replace(pair, warps=warps), pa.Table.from_pylist(rows, schema=SCORES), refused)


def write_alignment_page(alignment: Alignment, file: Path, ways: Sequence[Way] | None = None) -> int:
    """Write the page of an alignment, whole or not at all; return its length in bytes."""
    text = alignment_page(alignment.pair, alignment.scores, alignment.refused, ways)
    content = text.encode("utf-8", "replace")
    with whole_file(file) as temporary, temporary.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    return len(content)


def _take(name: str, catalog: Catalog | None) -> Take:
    if catalog is None:
        if Path(name).is_dir():
            raise UserError(
                f"{name} is a folder; give two files, or a catalog and two of its clips: CATALOG A B"
            )
        motion = read_motion(name)
        return Take(name, motion, frame_features(motion, FeatureConfig()).values[:, :POSE_COLUMNS])
    example, config = example_of(catalog, name), catalog.config
    if example.clip_id is not None:
        motion = catalog.motion(example.clip_id)
    else:
        motion = read_motion(name, conventions=config.features.conventions, **asdict(config.read))
    return Take(name, motion, example.pose[:, :POSE_COLUMNS])


def _refusal(pair: AlignedPair, aligner: Aligner, error: ValueError) -> str:
    told = f"{aligner.name} cannot align {pair.moving.name} to {pair.reference.name}: {error}"
    if aligner.reads == "features":
        return told
    others = ", ".join(one.name for one in ALIGNERS.values() if one.reads == "features")
    return f"{told}; these read features: {others}"


def _read_by(aligner: Aligner, pair: AlignedPair) -> tuple[FloatArray, FloatArray]:
    """Return both as a method reads them, at the pair's rate."""
    moving, reference = pair.moving.motion, pair.reference.motion
    if aligner.reads == "rotations":
        refuse_other_joints(moving, reference)
        turned = partial(joint_rotations, rate=pair.rate, conventions=pair.conventions)
        return turned(moving), turned(reference)
    if aligner.reads == "postures":
        return weighted_postures(moving, reference, pair.rate, pair.conventions)
    return pair.moving.pose, pair.reference.pose


def _load_kernels(aligner: Aligner, like: FloatArray) -> None:
    """Align something small for nothing: what is compiled takes its time when it is first called."""
    values = np.random.default_rng(0).standard_normal((8, *like.shape[1:]))
    values /= np.linalg.norm(values, axis=-1, keepdims=True)  # quaternions are such
    aligner.align(values.astype(like.dtype), values[::-1].astype(like.dtype))
