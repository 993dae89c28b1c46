"""Commands that run the main job, or draw its graph."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from motionary.workflows.commands.job_options import job_of, worker_count
from motionary.workflows.commands.options import (
    COMPILING,
    QUARANTINED,
    AsJson,
    CatalogUrl,
    Memory,
    Scheduler,
    Workers,
    fail,
    stderr_console,
)

if TYPE_CHECKING:
    from rich.console import Console

    from motionary.workflows.main_job import RunResult
    from motionary.workflows.preparation import Job

EXAMPLES = {
    "run": (
        "motionary run LIBRARY CATALOG --labels labels.csv",
        "motionary run LIBRARY CATALOG --label-pattern '(?P<action>[a-z]+)_'",
        "motionary run LIBRARY CATALOG --dry-run  # what there is to do",
        "motionary run LIBRARY CATALOG --primary complete --mu 0.2 --prune  # leaves most pairs out",
        "motionary run LIBRARY CATALOG --landmarks auto  # of a library too large for all pairs",
        "motionary run LIBRARY CATALOG --json | jq .clusters",
    ),
    "demo": (
        "motionary demo",
        "motionary demo FOLDER --seed 1",
        "motionary demo FOLDER --clips 10000  # how this machine does on a large library",
    ),
    "graph": ("motionary graph graph.svg", "motionary graph graph.txt --library LIBRARY"),
}


def run(
    library: Annotated[Path, typer.Argument(metavar="LIBRARY", help="Folder of motion capture.")],
    catalog: CatalogUrl,
    also: Annotated[
        list[Path] | None, typer.Option("--also", help="A further library; repeat for more.")
    ] = None,
    labels: Annotated[
        Path | None, typer.Option("--labels", help="CSV of labels: path or clip_id, and any label columns.")
    ] = None,
    label_pattern: Annotated[
        str | None,
        typer.Option(
            "--label-pattern",
            help="Regular expression on clip_ids; named groups are label columns. A value of the CSV wins.",
        ),
    ] = None,
    label_column: Annotated[
        str | None,
        typer.Option("--label-column", help="Column that clusters are named by.", show_default="action"),
    ] = None,
    paper: Annotated[
        bool, typer.Option("--paper", help="The paper's settings: its pose, complete linkage, widest strip.")
    ] = False,
    primary: Annotated[
        Literal["ward", "complete", "average", "fuzzy"] | None,
        typer.Option("--primary", help="Linkage whose clusters are published.", show_default="ward"),
    ] = None,
    metric: Annotated[
        Literal["weighted", "dtw", "b_dtw"] | None,
        typer.Option("--metric", help="Distance that linkage works on.", show_default="weighted"),
    ] = None,
    clusters: Annotated[
        int | None, typer.Option("--clusters", "--kappa", min=1, help="Exactly this many clusters.")
    ] = None,
    threshold: Annotated[
        float | None, typer.Option("--threshold", "--mu", min=0, help="Cut the dendrogram at this height.")
    ] = None,
    prune: Annotated[
        bool,
        typer.Option(
            "--prune",
            help="With --primary complete --mu: leave out pairs that a bound puts above mu. The same "
            "clusters, sooner; the other partitions are then absent.",
        ),
    ] = False,
    landmarks: Annotated[
        str | None,
        typer.Option(
            "--landmarks",
            metavar="N|auto",
            help="For a library too large for all pairs: compare those of N clips (auto: 20 times the root "
            "of all, 1,000 at least), and the others with clips like them. Approximate clusters.",
        ),
    ] = None,
    weights: Annotated[
        Literal["full", "legs", "arms"] | None,
        typer.Option("--weights", help="Part of the body that alignment attends to.", show_default="full"),
    ] = None,
    full_grid: Annotated[
        bool,
        typer.Option(
            "--full-grid",
            help="Search every segment length and slack for references over 96 frames too: slower.",
        ),
    ] = False,
    travel: Annotated[
        bool,
        typer.Option("--travel/--no-travel", help="Whether the direction of travel tells motions apart."),
    ] = True,
    config: Annotated[Path | None, typer.Option("--config", help="Settings of every stage, TOML.")] = None,
    workers: Workers = None,
    memory: Memory = None,
    scheduler: Scheduler = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what there is to do, and write nothing.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Cluster, name and align the motions of LIBRARY into CATALOG."""
    from motionary.workflows.costs.memory import refuse
    from motionary.workflows.preparation import prepare
    from motionary.workflows.tables import write_json

    job = job_of(
        library=library, catalog=catalog, also=also, labels=labels, label_pattern=label_pattern,
        label_column=label_column, paper=paper, primary=primary, metric=metric, clusters=clusters,
        threshold=threshold, prune=prune, landmarks=landmarks, weights=weights, full_grid=full_grid,
        travel=travel, config=config, workers=workers, memory=memory, scheduler=scheduler,
    )  # fmt: skip
    if not dry_run:
        _run(job, as_json)
        return
    ready = prepare(job)
    if as_json:
        write_json(vars(ready.plan))
    else:
        print(ready.plan)
    refuse(ready.need)


def demo(
    folder: Annotated[Path, typer.Argument(help="Where the library and the catalog go.")] = Path(
        "motionary-demo"
    ),
    seed: Annotated[int, typer.Option("--seed", help="Of the embedded library.")] = 0,
    clips: Annotated[
        int, typer.Option("--clips", min=1, help="In the library; made larger, it keeps those it has.")
    ] = 80,
    workers: Workers = None,
    memory: Memory = None,
    as_json: AsJson = False,
) -> None:
    """Run the main job on the embedded library of made-up motions and show the result."""
    from functools import partial

    from motionary.pipeline.synthetic import write_library
    from motionary.workflows.errors import UserError
    from motionary.workflows.preparation import Job
    from motionary.workflows.progress import progress
    from motionary.workflows.settings import load_settings

    library, catalog = folder / "library", folder / "catalog"
    log = stderr_console()
    log.print(f"Writing the embedded library to {library}", highlight=False, soft_wrap=True)
    try:
        with progress({"write": clips}, log) as done:
            count, written = worker_count(workers), partial(done, "write")
            write_library(library, seed, clips, processes=count, written=written)
    except ValueError as error:
        raise UserError(str(error)) from error
    log.print(f"$ motionary run {library} {catalog} --labels {library / 'labels.csv'}", soft_wrap=True)
    labels = library / "labels.csv"
    settings = load_settings(None, {})
    job = Job([str(library)], str(catalog), settings, labels, workers=worker_count(workers), memory=memory)
    _run(job, as_json)
    if as_json:
        return
    print(f"\nNext:\n  open {catalog / 'overview.html'} in a browser")
    print(f'  {_program()} query {catalog} "select label, count(*) as clips from clusters group by label"')
    print(f"  {_program()} status {catalog}")


def graph(
    out: Annotated[Path, typer.Argument(help="A file ending in .svg or .txt.")],
    library: Annotated[
        Path | None,
        typer.Option("--library", help="Show the graph of this library.", show_default="three clips"),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Draw the Dask graph of the main job."""
    from motionary.workflows.graph_picture import draw_graph
    from motionary.workflows.tables import write_json

    draw_graph(out, library)
    if as_json:
        write_json({"file": str(out)})
    else:
        print(f"wrote {out}")


def _run(job: Job, as_json: bool) -> None:
    from functools import partial

    from motionary.workflows.main_job import run
    from motionary.workflows.progress import progress
    from motionary.workflows.summary import print_summary, summary_record
    from motionary.workflows.tables import output_console, write_json

    log = stderr_console()
    try:
        result = run(
            job,
            partial(progress, console=log),
            partial(log.print, COMPILING, highlight=False),
            take_over=lambda dead: log.print(f"taking over from a run that died: {dead}", highlight=False),
            planned=lambda plan: log.print(str(plan), highlight=False, soft_wrap=True),
            remark=partial(log.print, highlight=False, soft_wrap=True),
        )
    except KeyboardInterrupt:
        fail("interrupted; the published catalog is as it was, and the same command resumes")
    _explain(result, job, log)
    if as_json:
        write_json(summary_record(result.catalog))
    else:
        print_summary(result.catalog, output_console())
    if len(result.catalog.quarantine):
        raise typer.Exit(QUARANTINED)


def _explain(result: RunResult, job: Job, log: Console) -> None:
    if result.stale_labels:
        name, now = next(iter(result.stale_labels.items()))
        log.print(
            f"{len(result.stale_labels)} labels are lost: their files were renamed ({name} is now {now}, "
            f"...); write the new names into {job.labels} and run again",
            highlight=False,
            soft_wrap=True,
        )
    if result.labels_outside:
        count, first = len(result.labels_outside), result.labels_outside[0]
        log.print(f"passed over {count} labels of files outside the library ({first}, ...)", highlight=False)
    if job.labels is None and job.label_pattern is None and not len(result.catalog.labels):
        log.print("clusters have no names without labels: --labels CSV", highlight=False)
    if result.reused:
        total = result.computed + result.reused
        log.print(f"{result.reused} of {total} results were there already", highlight=False)


def _program() -> str:
    """Name this program so that the line can be typed again here."""
    import shutil

    return "motionary" if shutil.which("motionary") else os.path.relpath(sys.argv[0])
