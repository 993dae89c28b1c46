"""Motions that a question is asked about, many at once: found, read, and what cannot be read.

Given are files, folders, patterns and motions. One that is not there or cannot be read stops no other: it
becomes an `Unreadable` in its place.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.canonical import SkeletonError
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.features import motion_features
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import FORMATS, ReadError, read_motion, scan_library


@dataclass(frozen=True)
class Unreadable:
    """Why a motion has no features."""

    line: int | None
    reason: str
    mend: str


@dataclass(frozen=True, eq=False)
class Given:
    """One motion that is asked about.

    Parameters
    ----------
    name : str
        The file as it was given, or its path below the folder that was; a motion's own name.
    source : sequence of str, Motion or Unreadable
        What its features are made of: its files, an AMC's ASF after it where that is known.
    """

    name: str
    source: Sequence[str] | Motion | Unreadable


Asked = str | os.PathLike[str] | Motion | Given


def given_motions(asked: Asked | Sequence[Asked]) -> list[Given]:
    """List what is asked about, in the order given.

    Parameters
    ----------
    asked : path, Motion, or sequence of these
        A folder or a zip stands for the clips that a run would find in it; a pattern such as `takes/*.bvh`
        (`**` for any depth) for the motion files that fit it, sorted. What is listed already stays.
    """
    several = [asked] if isinstance(asked, str | os.PathLike | Motion | Given) else asked
    return [given for one in several for given in _listed(one)]


def given_features(given: Given, config: PipelineConfig) -> NDArray[np.float32] | Unreadable:
    """Read a motion and make the vectors that the run compared its clips by; see `motion_features`."""
    source = given.source
    if isinstance(source, Unreadable):
        return source
    try:
        motion = source if isinstance(source, Motion) else _read(source, config)
        return motion_features(motion, config.features)
    except (ReadError, SkeletonError) as error:
        return Unreadable(error.line if isinstance(error, ReadError) else None, error.what, error.mend)
    except Exception as error:  # one file that meets a fault of ours must not stop the others
        what = f"unexpected {type(error).__name__}: {error}"
        return Unreadable(None, what, "report this fault of motionary with the file")


def _read(files: Sequence[str], config: PipelineConfig) -> Motion:
    skeleton = files[1] if len(files) > 1 else None
    own = config.features.conventions
    return read_motion(files[0], skeleton=skeleton, conventions=own, **asdict(config.read))


def _listed(one: Asked) -> Iterator[Given]:
    if isinstance(one, Given):
        yield one
    elif isinstance(one, Motion):
        yield Given(one.name, one)
    else:
        yield from _on_disk(os.fspath(one))


def _on_disk(name: str) -> Iterator[Given]:
    if not name:  # which Path takes for the working directory
        yield Given(name, Unreadable(None, "the name is empty", "name a file, a folder or a pattern"))
        return
    path = Path(name)
    try:
        folder, file = path.is_dir(), path.is_file()
    except OSError:  # too long a name; reading it says so
        folder = file = False
    if folder or (file and path.suffix.lower() == ".zip"):
        yield from _clips_under(path)
    elif glob.has_magic(name) and not file:
        yield from _fitting(name)
    else:
        yield Given(_shown(name), (name,))


def _fitting(pattern: str) -> Iterator[Given]:
    files = sorted(glob.glob(pattern, recursive=True))  # noqa: PTH207 - Path.glob wants a folder to begin at
    motions = [file for file in files if Path(file).suffix.lower() in FORMATS and Path(file).is_file()]
    for file in motions:
        yield from _on_disk(file)
    if not motions:
        yield Given(_shown(pattern), Unreadable(None, "no motion file fits this pattern", "check the path"))


def _clips_under(root: Path) -> Iterator[Given]:
    try:
        # Nobody asks for digests here, and to make them every file would be read.
        sources = scan_library(root, known_digest=lambda states: "not asked for")
    except (OSError, ValueError) as error:
        reason, _, mend = str(error).rpartition("; ")
        yield Given(_shown(root), Unreadable(None, reason, mend))
        return
    for source in sources:
        yield Given(_shown(Path(source.root) / source.path), source.files)


def _shown(path: str | os.PathLike[str]) -> str:
    """Write a file's name such that it is text, whatever its bytes."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")
