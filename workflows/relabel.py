"""Labels that people set, published at once: new names for the clusters and clips, nothing else computed.

The clusters themselves stay as they are until the next run, which cuts by these labels too where it cuts by
labels.
"""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog import Catalog
from motionary.catalog.errors import nearest
from motionary.catalog.labels import with_labels
from motionary.catalog.snapshot import OVERVIEW, next_snapshot_id, publish
from motionary.catalog.store import PartFacts, Store
from motionary.catalog.views.overview import overview_page
from motionary.catalog.writer_lock import Writer, the_only_writer
from motionary.pipeline.graph import naming_task
from motionary.pipeline.task import run_task
from motionary.workflows.computation import StoredParts
from motionary.workflows.errors import UserError
from motionary.workflows.preparation import absolute

_MOST_TOLD = 5


def relabel(
    url: str,
    changes: Mapping[str, str | None],
    set_by: str,
    take_over: Callable[[Writer], object] = lambda writer: None,
) -> Catalog:
    """Set, replace and remove labels, and publish the names that follow.

    Parameters
    ----------
    url : str
        The catalog.
    changes : mapping of str to str or None
        The new label by clip_id; None removes one.
    set_by : str
        Who says so.
    take_over : callable
        Told of a writer of this catalog that died.

    Returns
    -------
    Catalog
        Opened at the new snapshot; at the old one where every label was so already.

    Raises
    ------
    CatalogError
        There is no catalog, an older motionary published it, or another process writes it.
    UserError
        A clip is not in the library, a label is no name, or there is none to remove. Nothing has changed.
    """
    return publish_labels(url, lambda current: _changed(current, changes, set_by), take_over)


def publish_labels(
    url: str,
    changed: Callable[[Catalog], pa.Table],
    take_over: Callable[[Writer], object] = lambda writer: None,
) -> Catalog:
    """Publish other labels, made from those that are there while nobody else can change them.

    Parameters
    ----------
    url : str
        The catalog.
    changed : callable
        Makes table `labels` anew, of the catalog as it is; what it raises is raised, and nothing changed.
    take_over : callable
        Told of a writer of this catalog that died.

    Returns
    -------
    Catalog
        Opened at the new snapshot; at the old one where the table is as it was.

    Raises
    ------
    CatalogError
        There is no catalog, an older motionary published it, or another process writes it.
    """
    store = Store(absolute(url))
    Catalog.open(store.url).close()  # a folder that is none is not locked
    with the_only_writer(store, take_over), Catalog.open(store.url) as current:
        labels = changed(current)
        if not labels.equals(current.labels.to_arrow()):
            _publish(current, labels)
    return Catalog.open(store.url)


def refuse_unknown(names: Sequence[str], known: Sequence[str], where: str) -> None:
    """Refuse clips that are not known, all together, with the names that may have been meant.

    Parameters
    ----------
    names : sequence of str
        What the unknown clips were called; a path may read like the name of a known one.
    known : sequence of str
        The clips.
    where : str
        What does not have them.

    Raises
    ------
    UserError
        There is one.
    """
    unknown = sorted(set(names))
    if not unknown:
        return
    told = []
    for name in unknown[:_MOST_TOLD]:
        meant = nearest(name, known).removeprefix("; ")
        told.append(f"{name!r} ({meant})" if meant else repr(name))
    more = f" and {len(unknown) - _MOST_TOLD} more" if len(unknown) > _MOST_TOLD else ""
    raise UserError(f"nothing was changed: {where} has no clip {', '.join(told)}{more}")


def _changed(catalog: Catalog, changes: Mapping[str, str | None], set_by: str) -> pa.Table:
    inputs = catalog.inputs.to_arrow()
    digests = dict(zip(inputs["clip_id"].to_pylist(), inputs["digest"].to_pylist(), strict=True))
    unknown = [one for one, label in changes.items() if label is not None and one not in digests]
    refuse_unknown(unknown, [*digests], catalog.store.url)
    try:
        return with_labels(catalog.labels.to_arrow(), changes, digests, datetime.now(UTC), set_by)
    except ValueError as error:
        raise UserError(f"nothing was changed: {error}") from None


def _publish(current: Catalog, labels: pa.Table) -> None:
    store, before = current.store, current.snapshot
    made = _named(current, labels)
    made["labels"] = dict([store.save_whole("labels", labels)])
    tables = dict(before.tables) | {table: [*files] for table, files in made.items()}
    facts = dict(before.parts) | {file: known for files in made.values() for file, known in files.items()}
    snapshot = replace(
        before,
        snapshot_id=next_snapshot_id(store),
        created_at=datetime.now(UTC).isoformat(timespec="seconds"),
        tables=tables,
        parts={file: facts[file] for files in tables.values() for file in files},
    )
    publish(store, snapshot, before)
    store.write(OVERVIEW, overview_page(Catalog(store, snapshot)).encode())


def _named(current: Catalog, labels: pa.Table) -> dict[str, dict[str, PartFacts]]:
    """Store what the naming stage makes of these labels; return its files and their facts by table."""
    store = current.store
    overrides = labels.filter(pc.is_in(labels["clip_id"], current.inputs.to_arrow()["clip_id"]))
    clustered, represented = (
        posixpath.basename(current.files(table)[0]).removesuffix(".parquet")
        for table in ("clips", "represented")
    )
    task = naming_task(clustered, represented, overrides, current.config)
    files = {table: store.part_name(table, task.key) for table in task.makes}
    stored = StoredParts(store, current.snapshot).facts(task.key, task.makes) or run_task(task, store).stored
    return {table: {file: stored[table]} for table, file in files.items()}
