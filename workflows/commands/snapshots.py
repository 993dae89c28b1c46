"""Commands on the history of a catalog: its runs, what changed between two, and what may go."""

from __future__ import annotations

from typing import Annotated

import typer

from motionary.workflows.commands.options import (
    AsJson,
    CatalogUrl,
    OutputFormat,
    open_catalog,
    stderr_console,
)

EXAMPLES = {
    "runs": ("motionary runs CATALOG",),
    "diff": (
        "motionary diff CATALOG 1 2  # by snapshots' numbers, or by runs' ids",
        "motionary diff CATALOG 1 2 --format csv > changes.csv",
    ),
    "vacuum": (
        "motionary vacuum CATALOG --keep 7 --dry-run",
        "motionary vacuum CATALOG --days 30",
    ),
}

_RUN_HELP = "A run's id, or a snapshot's number."


def runs(catalog: CatalogUrl, format_: OutputFormat = "table") -> None:
    """List the runs that made CATALOG, oldest first, and whether their snapshots are still there."""
    from motionary.catalog.history import run_history
    from motionary.workflows.tables import write_table

    with open_catalog(catalog) as opened:
        write_table(run_history(opened), format_)


def diff(
    catalog: CatalogUrl,
    before: Annotated[str, typer.Argument(metavar="RUN", help=_RUN_HELP)],
    after: Annotated[str, typer.Argument(metavar="RUN", help=_RUN_HELP)],
    format_: OutputFormat = "table",
) -> None:
    """Tell what changed in CATALOG from one run to another: clips, clusters, labels, references."""
    from motionary.catalog.history import diff as difference
    from motionary.workflows.tables import write_table

    with open_catalog(catalog, before) as old, open_catalog(catalog, after) as new:
        changes = difference(old, new)
        counts = ", ".join(f"{len(table)} {name}" for name, table in vars(changes).items())
        write_table(changes.to_table(), format_)
        snapshots = f"{old.snapshot.snapshot_id} to {new.snapshot.snapshot_id}"
        stderr_console().print(f"{snapshots}: {counts}", highlight=False, soft_wrap=True)


def vacuum(
    catalog: CatalogUrl,
    keep: Annotated[
        int | None,
        typer.Option("--keep", min=1, help="Keep this many of the newest snapshots.", show_default="1"),
    ] = None,
    days: Annotated[
        float | None, typer.Option("--days", min=0, help="Keep snapshots younger than this.")
    ] = None,
    grace_hours: Annotated[
        float,
        typer.Option("--grace-hours", min=0, help="Keep what was published until less than this ago."),
    ] = 1.0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would be removed.")] = False,
    as_json: AsJson = False,
) -> None:
    """Remove old snapshots of CATALOG, and the files that only they use.

    What somebody has open stays. Readers of an object store, and those who may
    not write in the catalog's folder, are protected by the grace time alone.
    """
    from motionary.catalog.vacuum import vacuum as remove
    from motionary.catalog.writer_lock import the_only_writer

    log = stderr_console()
    with open_catalog(catalog) as opened:
        store = opened.store
    with the_only_writer(
        store, lambda dead: log.print(f"taking over from a run that died: {dead}", highlight=False)
    ):
        done = remove(store, keep, days, grace_hours, dry_run)
    if as_json:
        from motionary.workflows.tables import write_json

        write_json({"dry_run": dry_run, **vars(done)})
        return
    which = f" ({', '.join(done.snapshots)})" if done.snapshots else ""
    print(
        f"{'would remove' if dry_run else 'removed'} {_count(len(done.snapshots), 'snapshot')}{which} "
        f"and {_count(done.files, 'file')} of {done.bytes / 1e6:.1f} MB"
    )
    if grace_hours and not done.snapshots:
        log.print(f"what was current less than {grace_hours:g} h ago stays (--grace-hours)", highlight=False)
    if done.held:
        log.print(f"a reader holds {', '.join(done.held)}", highlight=False, soft_wrap=True)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
