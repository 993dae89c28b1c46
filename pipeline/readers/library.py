"""The clips of a library: which files there are, what each clip is called, and a digest of its bytes.

A clip's name is its file's path in the library, suffix included, with `/`; where several roots are
watched, the root folder's name goes before it. It does not change when other files come or go. Hidden files
and folders and files of other types are passed over, as are the bodies that AMASS keeps beside its motions
(`shape.npz`, `*_stagei.npz`); an ASF is no clip but belongs to the clips that are read with it. Links to
folders are not followed. A zip is a folder, see `motionary.pipeline.readers.zipped`; one that cannot be
opened is a clip that cannot be read.

A file whose size, times and inode are what they were need not be read to know its digest, as in git: times
tell nothing only of a file that was changed within `_SETTLED` seconds of being looked at. What lies in a zip
has the zip's size and times.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from motionary.pipeline.readers.amc import find_skeleton, skeletons_in
from motionary.pipeline.readers.digests import digest_of
from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.zipped import Member, archive_of, members_of

FORMATS = {".bvh": "bvh", ".amc": "asf/amc", ".c3d": "c3d", ".npz": "amass", ".zip": "zip"}

Root = str | os.PathLike[str]

_NO_CLIP = re.compile(r"^\.|(^|_)(shape|stagei)\.npz$", re.IGNORECASE)  # AMASS keeps bodies beside motions
_SETTLED = 2.0  # seconds: the coarsest times that file systems in use keep (FAT)


@dataclass(frozen=True)
class FileState:
    """What tells that a file was not touched, without reading it.

    Parameters
    ----------
    path : str
        Of what lies in a zip, the zip's with the name in it; the rest is the zip's.
    size : int
        Bytes.
    mtime_ns, ctime_ns : int
        When its content and when its inode last changed.
    inode : int
    """

    path: str
    size: int
    mtime_ns: int
    ctime_ns: int
    inode: int


@dataclass(frozen=True)
class Source:
    """A clip as the library holds it, not yet read.

    Parameters
    ----------
    clip_id : str
        Its name: see the module.
    path : str
        Relative to `root`, with `/`.
    root : str
        The root it was found under, as given; for a single file, the file's folder.
    files : tuple of str
        Every file it is read from: itself, then an AMC's ASF where there is one.
    digest : str
        BLAKE2b, 128 bits, in hexadecimal, over the lengths and contents of `files`; empty where one cannot be
        opened (reading the clip then says why). What is refused in a zip counts by its entry there.
    format : str
        A value of `FORMATS`; "zip" is one that cannot be opened.
    states : tuple of FileState
        Of `files`, when they were digested; empty where one cannot be told from a file that changes again.
    """

    clip_id: str
    path: str
    root: str
    files: tuple[str, ...]
    digest: str
    format: str
    states: tuple[FileState, ...] = ()


KnownDigest = Callable[[tuple[FileState, ...]], str | None]
"""Given the states of a clip's files, their digest where it is known."""

KnownMembers = Callable[[FileState], Sequence[tuple[str, ...]]]
"""Given the state of a zip, the names in it of the files of each of its clips; none where it is not known."""


def scan_library(
    roots: Root | Sequence[Root],
    known_digest: KnownDigest = lambda states: None,
    known_members: KnownMembers = lambda state: (),
) -> list[Source]:
    """List the clips under one root or several.

    Parameters
    ----------
    roots : path or sequence of paths
        Folders, searched to any depth, or single files.
    known_digest : callable
        Asked before files are read for their digest.
    known_members : callable
        Asked before a zip is opened for its list of files.

    Returns
    -------
    list of Source
        Sorted by `clip_id`, which is unique.

    Raises
    ------
    FileNotFoundError
        A root does not exist.
    PermissionError
        A folder may not be listed.
    ValueError
        No root is given, two have the same name, there is no clip under any of them, or two files would be
        one clip.
    """
    given = [roots] if isinstance(roots, str | os.PathLike) else list(roots)
    if not given:
        raise ValueError("no library is given; name a folder of motion files")
    folders = [Path(root) for root in given]
    for folder in folders:
        if not folder.exists():
            raise FileNotFoundError(f"there is no library at {folder}; check the path")
    prefixes = _prefixes(folders)
    sources = [
        source
        for folder, prefix in zip(folders, prefixes, strict=True)
        for source in _sources_under(folder, prefix, known_digest, known_members)
    ]
    if not sources:
        places = ", ".join(map(str, folders))
        raise ValueError(f"no motion files ({', '.join(FORMATS)}) under {places}; check the path")
    sources.sort(key=lambda source: source.clip_id)
    for one, other in pairwise(sources):
        if one.clip_id == other.clip_id:
            raise ValueError(
                f"two files would be clip {one.clip_id!r}: {one.files[0]!a} and {other.files[0]!a}; "
                "rename the one whose name is not UTF-8"
            )
    return sources


def _prefixes(folders: Sequence[Path]) -> list[str]:
    if len(folders) == 1:
        return [""]
    names = [Path(os.path.abspath(folder)).name for folder in folders]  # noqa: PTH100 - a link's own name
    for place, name in enumerate(names):
        if name in names[:place]:
            first = folders[names.index(name)]
            raise ValueError(
                f"two roots are called {name!r}: {first} and {folders[place]}; "
                "rename one of the folders, or give the folder above both"
            )
    return [f"{name}/" if folder.is_dir() else "" for name, folder in zip(names, folders, strict=True)]


def _sources_under(
    root: Path, prefix: str, known_digest: KnownDigest, known_members: KnownMembers
) -> Iterator[Source]:
    folder = root if root.is_dir() else root.parent
    for path, skeletons in _files_under(root):
        for files in _clips_of(path, skeletons, known_members):
            yield _source(files, folder, prefix, known_digest)


def _files_under(root: Path) -> Iterator[tuple[Path, Sequence[Path]]]:
    """Find files that are clips or hold some, each with the ASF files beside it."""
    if root.is_file():
        if root.suffix.lower() in FORMATS:
            yield root, skeletons_in(root.parent)
        return
    for folder, folders, names in os.walk(root, onerror=_refuse):
        folders[:] = [name for name in folders if not name.startswith(".")]
        paths = [Path(folder, name) for name in names if not _NO_CLIP.search(name)]
        skeletons = [path for path in paths if path.suffix.lower() == ".asf"]
        yield from ((path, skeletons) for path in paths if path.suffix.lower() in FORMATS)


def _clips_of(path: Path, skeletons: Sequence[Path], known_members: KnownMembers) -> list[tuple[Path, ...]]:
    """List the files of each clip that a file is or holds."""
    if path.suffix.lower() != ".zip":
        return [_with_skeleton(path, skeletons)]
    states = _states((str(path),))
    known = known_members(states[0]) if states else ()
    if known:
        return [tuple(path / name for name in names) for names in known]
    try:
        members = members_of(path)
    except ReadError:
        return [(path,)]
    beside: dict[Path, list[Path]] = {}
    for name in members:
        if name.lower().endswith(".asf"):
            beside.setdefault((path / name).parent, []).append(path / name)
    clips = [path / name for name, member in members.items() if _is_clip(member)]
    return [_with_skeleton(clip, sorted(beside.get(clip.parent, ()))) for clip in clips]


def _is_clip(member: Member) -> bool:
    *folders, name = re.split(r"[/\\]", member.info.orig_filename)
    hidden = any(one == "__MACOSX" or (one.startswith(".") and one.strip(".")) for one in folders)
    suffix = Path(name).suffix.lower()
    return not hidden and not _NO_CLIP.search(name) and suffix != ".zip" and suffix in FORMATS


def _with_skeleton(path: Path, skeletons: Sequence[Path]) -> tuple[Path, ...]:
    amc = FORMATS[path.suffix.lower()] == "asf/amc"
    skeleton = find_skeleton(path.stem, skeletons) if amc else None
    return (path,) if skeleton is None else (path, skeleton)


def _source(files: Sequence[Path], root: Path, prefix: str, known_digest: KnownDigest) -> Source:
    place = os.fsencode(files[0].relative_to(root).as_posix()).decode("utf-8", "backslashreplace")
    names = tuple(map(str, files))
    states = _states(names)
    digest = (known_digest(states) if states else None) or digest_of(names)
    kind = FORMATS[files[0].suffix.lower()]
    return Source(prefix + place, place, str(root), names, digest, kind, states)


def _states(files: Sequence[str]) -> tuple[FileState, ...]:
    """Look at files that are about to be digested; nothing where one changed so lately that it may again."""
    states = []
    for file in files:
        inside = archive_of(file)
        try:
            seen = (inside[0] if inside else Path(file)).stat()
        except OSError:
            return ()
        if max(seen.st_mtime, seen.st_ctime) > time.time() - _SETTLED:
            return ()
        states.append(FileState(file, seen.st_size, seen.st_mtime_ns, seen.st_ctime_ns, seen.st_ino))
    return tuple(states)


def _refuse(error: OSError) -> None:
    # Passing it over would make a folder's clips vanish from the catalog without a word.
    raise PermissionError(
        f"{error.filename} cannot be listed ({error.strerror}); check its permissions"
    ) from error
