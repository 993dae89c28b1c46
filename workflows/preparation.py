"""What a run finds before it starts: the library, its labels, what the published snapshot offers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog import CatalogError
from motionary.catalog.earlier import (
    earlier_run,
    inputs_table,
    known_digests,
    known_members,
    published_inputs,
)
from motionary.catalog.labels import following
from motionary.catalog.schema import SCHEMAS
from motionary.catalog.snapshot import CURRENT, Snapshot, current_snapshot
from motionary.catalog.store import Store
from motionary.pipeline.clustering.landmark_steps import landmark_count
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.landmark_graph import LandmarkGraph
from motionary.pipeline.layout import lay_out, side_for
from motionary.pipeline.readers.library import KnownDigest, KnownMembers, Source, scan_library
from motionary.pipeline.stage_settings import reading_settings
from motionary.workflows.computation import StoredParts
from motionary.workflows.costs.amounts import Amounts
from motionary.workflows.costs.memory import Need, need_of
from motionary.workflows.errors import UserError
from motionary.workflows.labels_file import SuppliedLabels, supplied_labels
from motionary.workflows.plan import Plan, plan_run


@dataclass(frozen=True)
class Job:
    """What a run is asked to do.

    Parameters
    ----------
    libraries : sequence of str
        Folders of motion capture.
    catalog : str
        Folder or fsspec URL of the catalog; made where there is none.
    config : PipelineConfig
        Every stage's settings.
    labels : Path, optional
        CSV of supplied labels.
    workers : int
        Processes on this machine.
    scheduler : str, optional
        A running Dask scheduler instead.
    label_pattern : str, optional
        Regular expression on clip_ids whose named groups are label columns; a value of the CSV wins.
    memory : int, optional
        Bytes that all processes of this machine may take together, or with `scheduler` one worker; by default
        what the machine has.
    """

    libraries: Sequence[str]
    catalog: str
    config: PipelineConfig
    labels: Path | None = None
    workers: int = 1
    scheduler: str | None = None
    label_pattern: str | None = None
    memory: int | None = None


@dataclass(frozen=True)
class Prepared:
    """A job with its library listed, and with what the catalog's published snapshot offers it.

    `side` is what the sides of tiles were cut by. `stale_labels` are names in the labels file of files that
    were renamed since the published run, with the clip_ids that these have now.
    """

    job: Job
    store: Store
    roots: Sequence[str]
    supplied: SuppliedLabels
    stale_labels: Mapping[str, str]
    before: Snapshot | None
    inputs: pa.Table
    labels: pa.Table
    side: int
    graph: LibraryGraph
    plan: Plan
    amounts: Amounts
    need: Need


def prepare(job: Job) -> Prepared:
    """List a job's library and see what there is to do, changing nothing.

    Raises
    ------
    CatalogError, UserError
        As `run`.
    """
    store = Store(absolute(job.catalog))
    before = current_snapshot(store)
    then = published_inputs(store, before)
    roots = [os.path.abspath(library) for library in job.libraries]  # noqa: PTH100 - keeps a link's own name
    sources = library_sources(roots, known_digests(then), known_members(then))
    wanted = job.config.clusters.n_clusters
    if wanted is not None and wanted > len(sources):
        raise UserError(f"{wanted} clusters are asked for, and the library holds {len(sources)} clips")
    supplied = supplied_labels(job.labels, job.label_pattern, sources, job.config.clusters.label_column)

    earlier = earlier_run(store, before, then)
    side = job.config.distances.tile or side_for(len(sources), earlier)
    job = replace(job, config=_settled(job.config, len(sources)))
    layout = lay_out(sources, reading_settings(job.config), side, earlier)
    _refuse_without_numbers(store, before)
    said = store.read(before.tables["labels"]) if before and "labels" in before.tables else None
    inputs = inputs_table(layout)
    labels = following(said or SCHEMAS["labels"].empty_table(), inputs)
    overrides = labels.filter(pc.is_in(labels["clip_id"], pa.array([*layout.keys], pa.string())))
    stored = StoredParts(store, before)
    kind = LandmarkGraph if job.config.distances.pairs == "landmarks" else LibraryGraph
    graph = kind(layout, supplied.table, overrides, job.config, earlier, stored)
    amounts = Amounts.of(graph)
    need = need_of(amounts, job.workers, job.memory, job.scheduler)
    graph = replace(graph, room=need.room)
    plan = plan_run(graph, store, before, job.workers, need)
    stale = _stale_labels(job, supplied, graph.names, then)
    return Prepared(
        job, store, roots, supplied, stale, before, inputs, labels, side, graph, plan, amounts, need
    )


def _settled(config: PipelineConfig, clips: int) -> PipelineConfig:
    """Fill in how many landmarks there are; where they are not fewer than the clips, compare all pairs."""
    distances, clusters = config.distances, config.clusters
    if distances.pairs != "landmarks":
        return config
    count = clusters.landmarks or landmark_count(clips)
    if count >= clips:
        all_pairs = replace(distances, pairs="all")
        return replace(config, distances=all_pairs, clusters=replace(clusters, landmarks=None))
    if clusters.n_clusters is not None and clusters.n_clusters > count:
        raise UserError(
            f"{clusters.n_clusters} clusters are asked for of {count} landmarks; take more landmarks"
        )
    return replace(config, clusters=replace(clusters, landmarks=count))


def _refuse_without_numbers(store: Store, before: Snapshot | None) -> None:
    """Refuse to number clusters anew where the numbers that they had are lost."""
    for table in ("members", "lineage"):
        for file in before.tables.get(table, ()) if before else ():
            if not store.filesystem.exists(store.path(file)):
                raise CatalogError(
                    f"{store.full_path(file)} is gone, and with it the clusters' numbers; restore it, or "
                    f"write the id of an earlier snapshot into {store.full_path(CURRENT)} and run again"
                )


def _stale_labels(
    job: Job, supplied: SuppliedLabels, names: Mapping[str, str], inputs: pa.Table
) -> dict[str, str]:
    now = {before: clip_id for clip_id, before in names.items() if before != clip_id}
    if job.labels is None or not supplied.outside or not now:
        return {}
    then = {
        os.path.realpath(os.path.join(row["root"], row["path"])): row["clip_id"]  # noqa: PTH118
        for row in inputs.select(["clip_id", "root", "path"]).to_pylist()
        if row["clip_id"] in now
    }
    clip_ids = {
        name: name if name in now else then.get(os.path.realpath(job.labels.parent / name))
        for name in supplied.outside
        if "\0" not in name
    }
    return {name: now[one] for name, one in clip_ids.items() if one is not None}


def library_sources(
    roots: Sequence[str],
    known_digest: KnownDigest = lambda states: None,
    known_members: KnownMembers = lambda state: (),
) -> list[Source]:
    """List the clips of libraries.

    Raises
    ------
    UserError
        A library is missing or holds no clip.
    """
    try:
        return scan_library(roots, known_digest, known_members)
    except (OSError, ValueError) as error:
        raise UserError(str(error)) from error


def absolute(url: str) -> str:
    """Return a catalog's URL such that workers find it from any folder."""
    return url if "://" in url else os.path.abspath(url)  # noqa: PTH100 - Path.resolve would follow links
