"""What a catalog is asked about: one of its clips, or a file that it does not hold.

Either is brought to the vectors that the run compared its clips by: a clip's are read, a file is read,
normalised and resampled as the run's settings say, so that both get the same answers.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.catalog.errors import CatalogError, NoClips, nearest
from motionary.catalog.places import batch_of, rows_by_clip
from motionary.pipeline.motion import Motion
from motionary.pipeline.stages.columns import matrix, per_clip

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


@dataclass(frozen=True, eq=False)
class Example:
    """What is asked about, as the vectors that distances are computed from.

    Parameters
    ----------
    name : str
        The clip_id, or the file as it was given.
    clip_id : str or None
        None for a file.
    features : array (frames, d) float32
        Low-motion frames merged, as in table `resampled`; d is 59, or 54 for the paper's features.
    first_frame, last_frame : array (frames,) int
        The frames at the common rate that each of them stands for, both included.
    pose : array (T, 59) float32
        Pose and travel of every frame at the common rate, as in table `features`.
    seconds : float
        From the first frame to the last.
    """

    name: str
    clip_id: str | None
    features: NDArray[np.float32]
    first_frame: NDArray[np.integer]
    last_frame: NDArray[np.integer]
    pose: NDArray[np.float32]
    seconds: float


ClipOrFile = str | os.PathLike[str] | Example
"""How an example is named: a clip_id, a file, or itself where it was made before."""


@dataclass(frozen=True, eq=False)
class LibraryFeatures:
    """The vectors of all clips of a catalog.

    Parameters
    ----------
    clip_ids : list of str
        In order.
    clips : list of array (frames, d) float32
        Of each, its rows of table `resampled`; not to be written to.
    """

    clip_ids: Sequence[str]
    clips: Sequence[NDArray[np.float32]]


def example_of(catalog: Catalog, clip_or_file: ClipOrFile) -> Example:
    """Find what is asked about.

    Parameters
    ----------
    catalog : Catalog
    clip_or_file : str, path or Example
        A clip_id of the catalog, or else a file, in a zip or not, read as the run's settings say; an AMC
        finds its ASF by its name. An example stands for itself.

    Raises
    ------
    CatalogError
        It is neither; the message names the clips most like it.
    ReadError
        The file cannot be read: line, what is wrong, mend.
    SkeletonError
        No joint-name convention fits the file's skeleton, or it has no legs.
    """
    from motionary.pipeline.readers import read_motion
    from motionary.pipeline.readers.zipped import archive_of

    if isinstance(clip_or_file, Example):
        return clip_or_file
    name = os.fspath(clip_or_file)
    seconds = clip_seconds(catalog)
    if name in seconds:
        return _catalogued(catalog, name, seconds[name])
    if not Path(name).is_file() and archive_of(name) is None:
        raise CatalogError(_unknown(catalog, name, list(seconds)))
    config = catalog.config
    motion = read_motion(name, conventions=config.features.conventions, **asdict(config.read))
    return example_from_motion(catalog, motion, name)


def example_from_motion(catalog: Catalog, motion: Motion, name: str) -> Example:
    """Make an example of a motion, by the settings of the catalog's run.

    Raises
    ------
    SkeletonError
        No joint-name convention fits the skeleton, or it has no legs.
    """
    from motionary.pipeline.features import frame_features, merged

    config = catalog.config.features
    pose = frame_features(motion, config).values
    resampled = merged(pose, config)
    return Example(name, None, resampled.values, resampled.first, resampled.last, pose, motion.seconds)


def library_features(catalog: Catalog) -> LibraryFeatures:
    """Return the vectors of all clips, read once and kept while the catalog is open.

    Raises
    ------
    CatalogError
        There are no clips.
    """

    def read() -> LibraryFeatures:
        clips = {
            clip_id: matrix(rows["feature"])
            for file in catalog.files("resampled")
            for clip_id, rows in per_clip(catalog.store.read([file])).items()
        }
        if not clips:
            raise NoClips(f"{catalog.store.url} has no clips, and so nothing to compare with")
        clip_ids = sorted(clips)
        return LibraryFeatures(clip_ids, [clips[clip_id] for clip_id in clip_ids])

    return catalog.keep("library features", read)


def clip_seconds(catalog: Catalog) -> dict[str, float]:
    """Return how long every clip is, read once and kept while the catalog is open."""

    def read() -> dict[str, float]:
        clips = catalog.clips.to_arrow()
        return dict(zip(clips["clip_id"].to_pylist(), clips["seconds"].to_pylist(), strict=True))

    return catalog.keep("seconds of every clip", read)


def _catalogued(catalog: Catalog, clip_id: str, seconds: float) -> Example:
    merged, plain = (next(rows_by_clip(catalog, table, [clip_id]))[1] for table in ("resampled", "features"))
    return Example(
        name=clip_id,
        clip_id=clip_id,
        features=matrix(merged["feature"]),
        first_frame=merged["first_frame"].to_numpy(),
        last_frame=merged["last_frame"].to_numpy(),
        pose=matrix(plain["feature"]),
        seconds=seconds,
    )


def _unknown(catalog: Catalog, name: str, clip_ids: Sequence[str]) -> str:
    if Path(name).is_dir():
        return f"{name} is a folder; name a clip of {catalog.store.url} or one motion file"
    if name in batch_of(catalog):
        quarantine = catalog.quarantine.to_arrow()
        why = quarantine.filter(pc.equal(quarantine["path"], name)).to_pylist()[0]
        return f"{name} is in quarantine: {why['reason']}; {why['mend']}"
    return f"{name!r} is neither a clip of {catalog.store.url} nor a file{nearest(name, clip_ids)}"
