"""The command line. Every command is a few lines: it reads its options, calls, and prints.

What computes is imported inside the commands, so that `--help` answers at once.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn

import typer

from motionary.workflows.errors import UserError

if TYPE_CHECKING:
    from rich.console import Console

    from motionary.catalog import Catalog
    from motionary.pipeline.config import PipelineConfig
    from motionary.workflows.main_job import RunResult

FAILED, QUARANTINED = 1, 3

_COMPILING = "compiling the kernels, or waiting for who does: once on a machine, some thirty seconds"

app = typer.Typer(
    name="motionary",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 failed, 2 usage, 3 done with quarantined clips.",
)

CatalogUrl = Annotated[
    str, typer.Argument(metavar="CATALOG", help="Folder of the catalog, or its fsspec URL.")
]
OutputFormat = Annotated[
    Literal["table", "json", "csv", "parquet"], typer.Option("--format", help="How to write the answer.")
]
Workers = Annotated[
    int | None, typer.Option("--workers", min=1, help="Processes on this machine.", show_default="one a core")
]
Scheduler = Annotated[str | None, typer.Option("--scheduler", help="Address of a running Dask scheduler.")]


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(version("motionary"))
        raise typer.Exit


@app.callback()
def motionary(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Cluster, name and align a library of motion capture: a dictionary of motion."""


@app.command()
def run(
    library: Annotated[Path, typer.Argument(metavar="LIBRARY", help="Folder of motion capture.")],
    catalog: CatalogUrl,
    also: Annotated[
        list[Path] | None, typer.Option("--also", help="A further library; repeat for more.")
    ] = None,
    labels: Annotated[
        Path | None, typer.Option("--labels", help="CSV of labels: path or clip_id, and any label columns.")
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
    scheduler: Scheduler = None,
) -> None:
    """Cluster, name and align the motions of LIBRARY into CATALOG."""
    if clusters is not None and threshold is not None:
        raise typer.BadParameter("give --clusters or --threshold, not both")
    options: dict[str, dict[str, Any]] = {"clusters": {}, "features": {}}
    if paper:
        from motionary.workflows.settings import PAPER

        options = {stage: dict(fields) for stage, fields in PAPER.items()}
    given = {
        "primary": primary, "metric": metric, "n_clusters": clusters, "threshold": threshold,
        "label_column": label_column,
    }  # fmt: skip
    options["clusters"] |= {name: value for name, value in given.items() if value is not None}
    if not travel:
        options["features"]["travel_time"] = 0.0
    options["alignment"] = ({"weights": weights} if weights else {}) | (
        {"search": "full"} if full_grid else {}
    )
    _run([library, *(also or [])], catalog, _settings(config, options), labels, workers, scheduler)


@app.command()
def demo(
    folder: Annotated[Path, typer.Argument(help="Where the library and the catalog go.")] = Path(
        "motionary-demo"
    ),
    seed: Annotated[int, typer.Option("--seed", help="Of the embedded library.")] = 0,
    workers: Workers = None,
) -> None:
    """Run the main job on the embedded library of made-up motions and show the result."""
    from motionary.pipeline.synthetic import write_library

    library, catalog = folder / "library", folder / "catalog"
    log = _stderr()
    log.print(f"Writing the embedded library to {library}", highlight=False, soft_wrap=True)
    write_library(library, seed=seed)
    log.print(f"$ motionary run {library} {catalog} --labels {library / 'labels.csv'}", soft_wrap=True)
    _run([library], str(catalog), _settings(None, {}), library / "labels.csv", workers, None)
    print(f"\nNext:\n  open {catalog / 'overview.html'} in a browser")
    print(f'  {_program()} query {catalog} "select label, count(*) as clips from clusters group by label"')
    print(f"  {_program()} status {catalog}")


@app.command()
def status(
    catalog: CatalogUrl,
    clip: Annotated[str | None, typer.Option("--clip", help="Show one clip instead.")] = None,
) -> None:
    """Show what a catalog holds: clips, clusters, scores, quarantine."""
    from motionary.workflows.summary import print_clip, print_summary
    from motionary.workflows.tables import output_console

    opened = _open(catalog)
    if clip is None:
        print_summary(opened, output_console())
    else:
        print_clip(opened, clip, output_console())


@app.command()
def query(
    catalog: CatalogUrl,
    sql: Annotated[str, typer.Argument(metavar="SQL", help="A statement in DuckDB's SQL.")],
    format_: OutputFormat = "table",
) -> None:
    """Ask CATALOG a question in SQL; every table is a view of its name."""
    from motionary.workflows.tables import write_table

    write_table(_open(catalog).sql(sql), format_)


@app.command()
def graph(
    out: Annotated[Path, typer.Argument(help="A file ending in .svg or .txt.")],
    library: Annotated[
        Path | None,
        typer.Option("--library", help="Show the graph of this library.", show_default="three clips"),
    ] = None,
) -> None:
    """Draw the Dask graph of the main job."""
    from motionary.workflows.graph_picture import draw_graph

    draw_graph(out, library)
    print(f"wrote {out}")


@app.command()
def export(
    catalog: CatalogUrl,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the files go; made if missing.")],
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", help="Only the cluster of this number, or all of this name."),
    ] = None,
    clip: Annotated[list[str] | None, typer.Option("--clip", help="Only this clip; repeat for more.")] = None,
    aligned: Annotated[
        bool,
        typer.Option("--aligned", help="In the time of the cluster's reference instead of as captured."),
    ] = False,
    format_: Annotated[
        Literal["bvh", "npz", "parquet"],
        typer.Option("--format", help="A BVH or an NPZ a clip, or Parquet for all."),
    ] = "bvh",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files that are there.")] = False,
) -> None:
    """Write motions of CATALOG to DIR: of a cluster, of some clips, or all.

    A file is called by its clip's path in the library, with another suffix.
    Lengths stay in the source's units; BVH does not say which they are.
    """
    if cluster is not None and clip:
        raise typer.BadParameter("give --cluster or --clip, not both")
    from functools import partial

    from motionary.catalog.export_plan import plan_export
    from motionary.workflows.export import export_summary, write_with_progress
    from motionary.workflows.progress import progress

    plan = plan_export(
        _open(catalog),
        folder,
        format_,
        clips=clip or None,
        cluster=cluster,
        aligned=aligned,
        overwrite=overwrite,
    )
    failed = write_with_progress(plan, partial(progress, console=_stderr()))
    for one in failed:
        print(f"motionary: {one.clip_id} is not exported: {one.reason}", file=sys.stderr)
    print(export_summary(plan, len(failed)))
    if failed:
        raise typer.Exit(QUARANTINED)


@app.command()
def transfer(
    catalog: CatalogUrl,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="A file ending in .bvh.")],
    style: Annotated[str, typer.Option("--style", metavar="CLIP", help="Whose style is taken.")],
    onto: Annotated[str, typer.Option("--onto", metavar="CLIP", help="Who gets it; of the same cluster.")],
) -> None:
    """Give one clip of CATALOG the style of another, as BVH.

    Both are taken in the time of their cluster's reference. Printed is how fast
    feet slide while they stand, of both and of the result.
    """
    from motionary.workflows.tables import output_console
    from motionary.workflows.transfer import sliding_table, transfer_to_bvh

    made = transfer_to_bvh(_open(catalog), out, style, onto)
    print(f"wrote {out}: {made.motion.frames} frames, in the time of {made.reference_id}")
    output_console().print(sliding_table(made))
    if made.is_jerky:
        _stderr().print(
            "a joint of the result is more than twice as fast as the sources': rotations that flip in the "
            f"source of {style}, {onto} or {made.reference_id} look so; look at it before you use it",
            highlight=False,
            soft_wrap=True,
        )


@app.command()
def reproduce(
    name: Annotated[
        Literal["dtw-curve", "dtw-curve-better", "cotw", "style"],
        typer.Argument(metavar="NAME", help="dtw-curve, dtw-curve-better, cotw or style."),
    ],
    catalog: Annotated[
        str | None, typer.Argument(metavar="CATALOG", help="Labelled catalog; style needs none.")
    ] = None,
    draws: Annotated[
        int | None,
        typer.Option(
            "--draws",
            min=1,
            help="Sets of clips drawn by each rule; for cotw, pairs of each action.",
            show_default="100, cotw 10",
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the draws.")] = 0,
    label_column: Annotated[
        str, typer.Option("--label-column", help="Column that holds the classes.")
    ] = "action",
    format_: OutputFormat = "table",
) -> None:
    """Repeat a paper's experiment on the labelled clips of CATALOG, or on the embedded library.

    dtw-curve: which distance, linkage and features find the classes. dtw-curve-better: changes to the
    default. cotw: which alignment brings clips of one action together. style: how well styles are told apart
    by what alignment leaves over, on made-up takes.
    """
    from functools import partial

    from motionary.workflows.progress import progress
    from motionary.workflows.tables import output_console, write_table

    show = partial(progress, console=_stderr())
    if name == "style":
        from motionary.workflows.reproduce.style import study_style, style_report

        if catalog is not None:
            raise typer.BadParameter("style is made on the embedded library and takes no CATALOG")
        study = study_style(show, seed=seed)
        printed = style_report(study)
    else:
        from motionary.workflows.reproduce import EXPERIMENTS

        if catalog is None:
            raise typer.BadParameter(f"{name} needs a labelled CATALOG")
        conduct, report, usual = EXPERIMENTS[name]
        experiment = conduct(_open(catalog), label_column, draws or usual, seed, show)
        study, printed = experiment.study, report(experiment)
    if format_ == "table":
        output_console().print(printed)
    else:
        write_table(study.to_arrow(), format_)


def main() -> NoReturn:
    """Run the command line and exit; what a user can mend is one line on stderr and exit code 1."""
    try:
        app(prog_name="motionary")
    except BrokenPipeError:  # the reader has seen enough; nothing more may be written, at exit neither
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115
        sys.exit(FAILED)
    except (UserError, OSError) as error:
        _fail(str(error))
    except Exception as error:
        from motionary.catalog import CatalogError

        if not isinstance(error, CatalogError):
            raise
        _fail(str(error))
    sys.exit(0)


def _run(
    libraries: list[Path],
    catalog: str,
    config: PipelineConfig,
    labels: Path | None,
    workers: int | None,
    scheduler: str | None,
) -> None:
    from functools import partial

    from dask.system import CPU_COUNT

    from motionary.workflows.main_job import Job, run
    from motionary.workflows.progress import progress
    from motionary.workflows.summary import print_summary
    from motionary.workflows.tables import output_console

    job = Job([str(one) for one in libraries], catalog, config, labels, workers or CPU_COUNT, scheduler)
    log = _stderr()
    try:
        result = run(
            job,
            partial(progress, console=log),
            partial(log.print, _COMPILING, highlight=False),
            lambda dead: log.print(f"taking over from a run that died: {dead}", highlight=False),
        )
    except KeyboardInterrupt:
        _fail("interrupted; the published catalog is as it was, and the same command resumes")
    _explain(result, labels is not None, log)
    print_summary(result.catalog, output_console())
    if len(result.catalog.quarantine):
        raise typer.Exit(QUARANTINED)


def _explain(result: RunResult, has_labels: bool, log: Console) -> None:
    if result.labels_outside:
        count, first = len(result.labels_outside), result.labels_outside[0]
        log.print(f"passed over {count} labels of files outside the library ({first}, ...)", highlight=False)
    if not has_labels:
        log.print("clusters have no names without labels: --labels CSV", highlight=False)
    if result.reused:
        total = result.computed + result.reused
        log.print(f"{result.reused} of {total} results were there already", highlight=False)


def _settings(file: Path | None, options: dict[str, dict[str, Any]]) -> PipelineConfig:
    from motionary.workflows.settings import load_settings

    return load_settings(file, options)


def _program() -> str:
    """Name this program so that the line can be typed again here."""
    import shutil

    return "motionary" if shutil.which("motionary") else os.path.relpath(sys.argv[0])


def _open(url: str) -> Catalog:
    from motionary.catalog import Catalog

    return Catalog.open(url)


def _stderr() -> Console:
    from rich.console import Console

    return Console(stderr=True)


def _fail(message: str) -> NoReturn:
    print(f"motionary: {message}", file=sys.stderr)
    sys.exit(FAILED)
