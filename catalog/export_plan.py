"""What an export writes where: the clips that are meant, a file name for each, and what is refused."""

from __future__ import annotations

import os
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path, PurePosixPath
from typing import Literal

import pyarrow as pa
import pyarrow.compute as pc
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog, nearest
from motionary.pipeline.tables import table_field

ExportFormat = Literal["bvh", "npz", "parquet"]


@dataclass(frozen=True)
class ExportPlan:
    """What is to be written where; nothing has been written yet.

    Parameters
    ----------
    catalog : Catalog
    folder : Path
    format : {"bvh", "npz", "parquet"}
    table : {"frames", "aligned"}
        Where the poses come from.
    clips : pyarrow.Table
        A row a clip, in clip_id order: its rows of `clusters` and `clips`, and `frame_rate`, that of the
        poses.
    paths : mapping of str to Path
        Each clip's file.
    """

    catalog: Catalog
    folder: Path
    format: ExportFormat
    table: Literal["frames", "aligned"]
    clips: pa.Table
    paths: Mapping[str, Path]


def plan_export(
    catalog: Catalog,
    folder: str | os.PathLike[str],
    format_: ExportFormat = "bvh",
    *,
    clips: Sequence[str] | None = None,
    cluster: int | str | None = None,
    aligned: bool = False,
    overwrite: bool = False,
) -> ExportPlan:
    """Say which clips go to which files; the parameters are those of `Catalog.export`.

    Raises
    ------
    CatalogError
        There is no such clip or cluster, or nothing to export; the folder holds one of the files already, or
        is part of the library.
    """
    if format_ not in ("bvh", "npz", "parquet"):
        raise CatalogError(f"format is {format_!r}; a motion is exported as bvh, npz or parquet")
    if not str(folder):
        raise CatalogError("the folder to export into has no name; for the working directory write .")
    if clips is not None and cluster is not None:
        raise CatalogError("clips and a cluster are given; a selection is by one of them")
    table: Literal["frames", "aligned"] = "aligned" if aligned else "frames"
    catalog.files(table)  # a catalog that lacks it is refused before its clips are looked at
    chosen = _chosen(catalog, clips, cluster)
    destination = Path(folder)
    if format_ == "parquet":
        paths = dict.fromkeys(chosen, destination / f"{table}.parquet")
        written = [*set(paths.values()), destination / "clips.parquet"]
    else:
        # Names are given to the whole catalog, so that a clip's does not depend on what else is chosen.
        names = file_names(catalog.clips.to_arrow()["clip_id"].to_pylist(), f".{format_}")
        paths = {clip_id: destination / names[clip_id] for clip_id in chosen}
        written = list(paths.values())
    refuse_library(catalog, written)
    if not overwrite:
        _refuse_existing(written)
    return ExportPlan(catalog, destination, format_, table, _described(catalog, chosen, aligned), paths)


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


def rows_of(table: pa.Table, clip_ids: Sequence[str] | pa.ChunkedArray) -> pa.Table:
    """Take the row of each clip, in the order given, from a table that has one row a clip."""
    wanted = clip_ids if isinstance(clip_ids, pa.ChunkedArray) else pa.array(clip_ids, pa.string())
    return table.take(pc.index_in(wanted, table["clip_id"].combine_chunks()))


def with_column(table: pa.Table, other: pa.Table, column: str) -> pa.Table:
    """Append a column of another table that has the same rows."""
    return table.append_column(other.schema.field(column), other[column])


def _chosen(catalog: Catalog, clips: Sequence[str] | None, cluster: int | str | None) -> list[str]:
    members = catalog.clusters.to_arrow()
    known = members["clip_id"].to_pylist()
    if not known or clips == []:
        chosen = "holds no clips" if not known else "holds clips, and none of them is chosen"
        raise CatalogError(f"{catalog.store.url} {chosen}: there is nothing to export")
    if clips is not None:
        for clip_id in sorted(set(clips) - set(known)):
            raise CatalogError(f"no clip {clip_id!r} in {catalog.store.url}{nearest(clip_id, known)}")
        return sorted(set(clips))
    if cluster is not None:
        wanted = pa.array(_cluster_ids(catalog, str(cluster)), pa.int32())
        members = members.filter(pc.is_in(members["cluster_id"], wanted))
    return sorted(members["clip_id"].to_pylist())


def _cluster_ids(catalog: Catalog, cluster: str) -> list[int]:
    """Find clusters by number, else all that have a name."""
    names = {row["cluster_id"]: row["label"] for row in catalog.references.to_arrow().to_pylist()}
    by_number = [number for number in names if str(number) == cluster]
    found = by_number or [number for number, name in names.items() if name == cluster]
    if not found:
        close = nearest(cluster, sorted({name for name in names.values() if name}))
        raise CatalogError(
            f"no cluster {cluster!r} in {catalog.store.url}{close or f'; it has 1 to {max(names)}'}"
        )
    return found


def _described(catalog: Catalog, clip_ids: Sequence[str], aligned: bool) -> pa.Table:
    """Join what is known of clips: cluster, rate of their poses, skeleton, supplied labels."""
    described = rows_of(catalog.clusters.to_arrow(), clip_ids)
    clips = rows_of(catalog.clips.to_arrow(), clip_ids)
    rates = clips["fps"]
    if aligned:
        alignments = rows_of(catalog.alignments.to_arrow(), clip_ids)
        described = with_column(described, alignments, "reference_id")
        rates = alignments["frame_rate"]
    described = described.append_column(table_field("frame_rate", pa.float64(), "of the poses", "1/s"), rates)
    for name in clips.column_names:
        if name not in described.column_names:  # a supplied label may be called as a column above is
            described = with_column(described, clips, name)
    return described


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


def _refuse_existing(paths: Sequence[Path]) -> None:
    there = [path for path in paths if os.path.lexists(path)]
    if there:
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise CatalogError(
            f"{there[0]}{more} would be replaced; name another folder, or allow it (--overwrite)"
        )
