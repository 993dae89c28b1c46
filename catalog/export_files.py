"""The files of an export: names that differ on every file system, and what may not be written."""

from __future__ import annotations

import os
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Sequence
from hashlib import blake2b
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.errors import CatalogError

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


def file_names(clip_ids: Sequence[str], suffix: str) -> dict[str, str]:
    """Name a file for every clip: its clip_id with another suffix, in the same folders.

    Clips whose names would be equal, in upper or lower case or however accents are written, or equal to a
    folder's, keep their own suffix before the new one, as
    `walk.amc.bvh` and `walk.bvh.bvh`; where that does not help, a digest of the clip_id stands there too.

    Raises
    ------
    CatalogError
        A clip_id leads out of the folder.
    """
    longer: list[Callable[[str], str]] = [
        lambda clip_id: str(PurePosixPath(clip_id).with_suffix(suffix)),
        lambda clip_id: clip_id + suffix,
        lambda clip_id: f"{clip_id}.{blake2b(clip_id.encode(), digest_size=6).hexdigest()}{suffix}",
    ]
    for clip_id in clip_ids:
        if ".." in PurePosixPath(clip_id).parts or PurePosixPath(clip_id).is_absolute():
            raise CatalogError(f"clip {clip_id!r} would be written outside the folder; rename it")
    lengths = dict.fromkeys(clip_ids, 0)
    while True:
        names = {clip_id: longer[length](clip_id) for clip_id, length in lengths.items()}
        sharing = defaultdict(list)
        for clip_id, name in names.items():
            sharing[_as_file_systems_see(name)].append(clip_id)
        folders = {str(folder) for name in sharing for folder in PurePosixPath(name).parents}
        alike = [one for name, group in sharing.items() if len(group) > 1 or name in folders for one in group]
        if not alike:
            return names
        for clip_id in alike:
            lengths[clip_id] = min(lengths[clip_id] + 1, len(longer) - 1)


def _as_file_systems_see(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


def refuse_library(catalog: Catalog, paths: Sequence[Path]) -> None:
    """Check that no file would be written into the catalog, or the library that it was last made from.

    Raises
    ------
    CatalogError
        One would: a catalog holds nothing but its own files; the library's next run would read it as a clip,
        and it may be a capture that is replaced.
    """
    if isinstance(catalog.store.filesystem, LocalFileSystem):
        home = Path(catalog.store.path("")).resolve()
        if any(path.resolve().is_relative_to(home) for path in paths):
            raise CatalogError(f"{paths[0]} lies in the catalog {home} itself; name a folder outside")
    runs = catalog.runs.to_arrow()
    roots = [Path(root).resolve() for root in runs["library"][-1].as_py()] if len(runs) else []
    for root in roots:
        inside = next((path for path in paths if path.resolve().is_relative_to(root)), None)
        if inside:
            raise CatalogError(
                f"{inside} lies in the library {root}, whose next run would take it for a capture; "
                "name a folder outside"
            )


def refuse_existing(paths: Sequence[Path]) -> None:
    """Check that none of the files is there.

    Raises
    ------
    CatalogError
        One is.
    """
    there = [path for path in paths if os.path.lexists(path)]
    if there:
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise CatalogError(
            f"{there[0]}{more} would be replaced; name another folder, or allow it (--overwrite)"
        )
