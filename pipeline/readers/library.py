"""The clips of a library: which files there are, what each clip is called, and a digest of its bytes.

A clip's name is its file's path in the library, suffix included, with `/`; where several roots are
watched, the root folder's name goes before it. It does not change when other files come or go. Hidden files
and folders, and files of other types, are passed over; an ASF is no clip but belongs to the clips that are
read with it. Links to folders are not followed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path

from motionary.pipeline.readers.amc import find_skeleton, skeletons_in

FORMATS = {".bvh": "bvh", ".amc": "asf/amc"}

Root = str | os.PathLike[str]


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
    """

    clip_id: str
    path: str
    root: str
    files: tuple[str, ...]
    digest: str
    format: str


def scan_library(roots: Root | Sequence[Root]) -> list[Source]:
    """List the clips under one root or several.

    Parameters
    ----------
    roots : path or sequence of paths
        Folders, searched to any depth, or single files.

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
        No root is given, two have the same name, or there is no clip under any of them.
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
        for source in _sources_under(folder, prefix)
    ]
    if not sources:
        places = ", ".join(map(str, folders))
        raise ValueError(f"no motion files ({', '.join(FORMATS)}) under {places}; check the path")
    return sorted(sources, key=lambda source: source.clip_id)


def _prefixes(folders: Sequence[Path]) -> list[str]:
    if len(folders) == 1:
        return [""]
    names = [folder.resolve().name for folder in folders]
    for place, name in enumerate(names):
        if name in names[:place]:
            first = folders[names.index(name)]
            raise ValueError(
                f"two roots are called {name!r}: {first} and {folders[place]}; "
                "rename one of the folders, or give the folder above both"
            )
    return [f"{name}/" if folder.is_dir() else "" for name, folder in zip(names, folders, strict=True)]


def _sources_under(root: Path, prefix: str) -> Iterator[Source]:
    if root.is_file():
        if root.suffix.lower() in FORMATS:
            yield _source(root, root.parent, prefix, skeletons_in(root.parent))
        return
    for folder, folders, names in os.walk(root, onerror=_refuse):
        folders[:] = [name for name in folders if not name.startswith(".")]
        paths = [Path(folder, name) for name in names if not name.startswith(".")]
        skeletons = [path for path in paths if path.suffix.lower() == ".asf"]
        for path in paths:
            if path.suffix.lower() in FORMATS:
                yield _source(path, root, prefix, skeletons)


def _source(path: Path, root: Path, prefix: str, skeletons: Sequence[Path]) -> Source:
    files = [path]
    kind = FORMATS[path.suffix.lower()]
    skeleton = find_skeleton(path.stem, skeletons) if kind == "asf/amc" else None
    if skeleton is not None:
        files.append(skeleton)
    place = os.fsencode(path.relative_to(root).as_posix()).decode("utf-8", "backslashreplace")
    return Source(
        prefix + place, place, str(root), tuple(map(str, files)), digest_of(tuple(map(str, files))), kind
    )


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
            content = Path(file).read_bytes()
            digest.update(len(content).to_bytes(8, "little"))
            digest.update(content)
    except OSError:
        return ""
    return digest.hexdigest()
