"""The clips of a library: which files there are, what each clip is called, and a digest of its bytes.

A clip's name is its file's path in the library, suffix included, with `/`; where several roots are
watched, the root folder's name goes before it. It does not change when other files come or go. Hidden files
and folders, and files of other types, are passed over; an ASF is no clip but belongs to the clips that are
read with it. Links to folders are not followed.

A file whose size, times and inode are what they were need not be read to know its digest, as in git: times
tell nothing only of a file that was changed within `_SETTLED` seconds of being looked at.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from itertools import pairwise
from pathlib import Path

from motionary.pipeline.readers.amc import find_skeleton, skeletons_in
from motionary.pipeline.readers.text import is_special

FORMATS = {".bvh": "bvh", ".amc": "asf/amc"}

Root = str | os.PathLike[str]

_SETTLED = 2.0  # seconds: the coarsest times that file systems in use keep (FAT)


@dataclass(frozen=True)
class FileState:
    """What tells that a file was not touched, without reading it.

    Parameters
    ----------
    path : str
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
        opened (reading the clip then says why).
    format : str
        "bvh" or "asf/amc".
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


def scan_library(
    roots: Root | Sequence[Root], known_digest: KnownDigest = lambda states: None
) -> list[Source]:
    """List the clips under one root or several.

    Parameters
    ----------
    roots : path or sequence of paths
        Folders, searched to any depth, or single files.
    known_digest : callable
        Asked before files are read for their digest.

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
        for source in _sources_under(folder, prefix, known_digest)
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


def _sources_under(root: Path, prefix: str, known_digest: KnownDigest) -> Iterator[Source]:
    if root.is_file():
        if root.suffix.lower() in FORMATS:
            yield _source(root, root.parent, prefix, skeletons_in(root.parent), known_digest)
        return
    for folder, folders, names in os.walk(root, onerror=_refuse):
        folders[:] = [name for name in folders if not name.startswith(".")]
        paths = [Path(folder, name) for name in names if not name.startswith(".")]
        skeletons = [path for path in paths if path.suffix.lower() == ".asf"]
        for path in paths:
            if path.suffix.lower() in FORMATS:
                yield _source(path, root, prefix, skeletons, known_digest)


def _source(
    path: Path, root: Path, prefix: str, skeletons: Sequence[Path], known_digest: KnownDigest
) -> Source:
    files = [path]
    kind = FORMATS[path.suffix.lower()]
    skeleton = find_skeleton(path.stem, skeletons) if kind == "asf/amc" else None
    if skeleton is not None:
        files.append(skeleton)
    place = os.fsencode(path.relative_to(root).as_posix()).decode("utf-8", "backslashreplace")
    names = tuple(map(str, files))
    states = _states(names)
    digest = (known_digest(states) if states else None) or digest_of(names)
    return Source(prefix + place, place, str(root), names, digest, kind, states)


def _states(files: Sequence[str]) -> tuple[FileState, ...]:
    """Look at files that are about to be digested; nothing where one changed so lately that it may again."""
    states = []
    for file in files:
        try:
            seen = Path(file).stat()
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


def digest_of(files: Sequence[str]) -> str:
    """Digest the contents of files, each with its length; empty where one cannot be opened."""
    digest = blake2b(digest_size=16)
    try:
        for file in files:
            if is_special(Path(file)):
                return ""
            content = Path(file).read_bytes()
            digest.update(len(content).to_bytes(8, "little"))
            digest.update(content)
    except OSError:
        return ""
    return digest.hexdigest()
