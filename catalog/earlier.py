"""What the published snapshot offers the next run: digests of files, and results to build upon."""

from __future__ import annotations

import json
import posixpath
from collections.abc import Mapping, Sequence

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.schema import SCHEMAS
from motionary.catalog.snapshot import Snapshot
from motionary.catalog.store import Store
from motionary.pipeline.layout import Earlier, Layout
from motionary.pipeline.readers.library import FileState, KnownDigest, KnownMembers
from motionary.pipeline.task import MAKES


def published_inputs(store: Store, snapshot: Snapshot | None) -> pa.Table:
    """Read which clips a published run found; none where a motionary published it that did not list them."""
    if snapshot is None or "inputs" not in snapshot.tables:
        return SCHEMAS["inputs"].empty_table()
    return store.read(snapshot.tables["inputs"])


def earlier_run(store: Store, snapshot: Snapshot | None, inputs: pa.Table) -> Earlier:
    """Describe a published run with its inputs as one to build upon."""
    if snapshot is None or not len(inputs):
        return Earlier()
    quarantine = store.read(snapshot.tables["quarantine"])
    return Earlier(
        snapshot_id=snapshot.snapshot_id,
        batches=_groups(inputs, "batch"),
        sides=_groups(inputs, side_column(inputs)),
        digests=dict(zip(inputs["clip_id"].to_pylist(), inputs["digest"].to_pylist(), strict=True)),
        retry=frozenset(quarantine.filter(quarantine["retry"])["path"].to_pylist()),
        results={stage: _keys(snapshot.tables.get(makes[0], ())) for stage, makes in MAKES.items()},
        settings=snapshot.stages,
        side=_side(store, snapshot),
    )


def known_digests(inputs: pa.Table) -> KnownDigest:
    """Return who knows the digests of files that were not touched since the run of these inputs."""
    inputs = inputs.filter(pc.greater(pc.list_value_length(inputs["files"]), 0))
    known = {
        tuple(FileState(**state) for state in row["files"]): row["digest"]
        for row in inputs.select(["files", "digest"]).to_pylist()
    }
    return lambda states: known.get(tuple(_storable(state) for state in states))


def known_members(inputs: pa.Table) -> KnownMembers:
    """Return who knows what clips lie in zips that were not touched since the run of these inputs."""
    inputs = inputs.filter(pc.greater(pc.list_value_length(inputs["files"]), 0))
    by_state: dict[tuple[int, ...], list[list[str]]] = {}
    for files in inputs["files"].to_pylist():
        by_state.setdefault(_touched(FileState(**files[0])), []).append([one["path"] for one in files])

    def members(archive: FileState) -> list[tuple[str, ...]]:
        inside = f"{_text(archive.path)}/"
        clips = [paths for paths in by_state.get(_touched(archive), ()) if paths[0].startswith(inside)]
        return [tuple(one.removeprefix(inside) for one in paths) for paths in clips]

    return members


def _touched(state: FileState) -> tuple[int, int, int, int]:
    return state.size, state.mtime_ns, state.ctime_ns, state.inode


def inputs_table(layout: Layout) -> pa.Table:
    """List the clips of a run with the state of their files: the table `inputs`."""
    rows = [
        {
            "clip_id": clip.clip_id,
            "root": _text(clip.source.root),
            "path": clip.source.path,
            "files": [vars(_storable(state)) for state in clip.source.states],
            "digest": clip.source.digest,
            "key": clip.key,
            "batch": batch,
            "side": side,
        }
        for side, batches in enumerate(layout.batches_of_side)
        for batch in batches
        for clip in layout.batches[batch]
    ]
    return pa.Table.from_pylist(rows, schema=SCHEMAS["inputs"])


def side_column(inputs: pa.Table) -> str:
    """Say which column of `inputs` tells the sides of tiles: once every batch was one."""
    return "side" if "side" in inputs.column_names and not inputs["side"].null_count else "batch"


def _groups(inputs: pa.Table, column: str) -> list[dict[str, str]]:
    groups: dict[int, dict[str, str]] = {}
    for row in inputs.select(["clip_id", "key", column]).to_pylist():
        groups.setdefault(row[column], {})[row["clip_id"]] = row["key"]
    return [groups[number] for number in sorted(groups)]


def _side(store: Store, snapshot: Snapshot) -> int:
    run = store.read(snapshot.tables["runs"]).to_pylist()[-1]
    return int(run.get("side") or json.loads(run["settings"])["distances"]["tile"])


def _keys(files: Sequence[str]) -> list[str]:
    return [posixpath.basename(file).removesuffix(".parquet") for file in files]


def _storable(state: FileState) -> FileState:
    fields: Mapping = vars(state) | {"path": _text(state.path)}
    return FileState(**fields)


def _text(path: str) -> str:
    """Write a path that is not UTF-8 such that a table can hold it."""
    return path.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
