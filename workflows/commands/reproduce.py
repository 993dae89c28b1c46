"""The command that repeats the papers' experiments."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from motionary.workflows.commands.options import OutputFormat, compile_first, open_catalog, stderr_console

EXAMPLES = {
    "reproduce": (
        "motionary reproduce dtw-curve CATALOG",
        "motionary reproduce cotw CATALOG --draws 3 --format json",
        "motionary reproduce gtw --draws 20",
        "motionary reproduce fp-dtw  # on the embedded library",
        "motionary reproduce adaptive-dtw CATALOG",
        "motionary reproduce assign CATALOG",
        "motionary reproduce style",
        "motionary reproduce landmarks CATALOG",
    )
}


def reproduce(
    name: Annotated[
        Literal[
            "dtw-curve",
            "dtw-curve-better",
            "cotw",
            "gtw",
            "fp-dtw",
            "adaptive-dtw",
            "style",
            "assign",
            "mutual",
            "landmarks",
        ],
        typer.Argument(
            metavar="NAME",
            help="dtw-curve, dtw-curve-better, cotw, gtw, fp-dtw, adaptive-dtw, style, assign, mutual or "
            "landmarks.",
        ),
    ],
    catalog: Annotated[
        str | None,
        typer.Argument(
            metavar="CATALOG",
            help="Labelled catalog; gtw and style take none, fp-dtw and adaptive-dtw may do without.",
        ),
    ] = None,
    draws: Annotated[
        int | None,
        typer.Option(
            "--draws",
            min=1,
            help="Sets drawn by each rule; for cotw, fp-dtw and adaptive-dtw pairs of each action; for style "
            "takes of each, for assign partings, for landmarks samples.",
            show_default="100, cotw 10, fp-dtw 20, adaptive-dtw 10, style 10, assign and landmarks 5",
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
    default. cotw: which alignment brings clips of one action together. gtw: sequences distorted in time and
    space. fp-dtw: following a live motion. adaptive-dtw: without standing still. style: how well styles are
    told apart by what alignment leaves over, on made-up takes. assign: whether takes that are held out get
    their names. mutual: whether ranking by mutual proximity finds a clip's action better. landmarks: how far
    clusters by landmarks are from those of all pairs.
    """
    from functools import partial

    from threadpoolctl import threadpool_limits

    from motionary.workflows.progress import progress
    from motionary.workflows.reproduce import EXPERIMENTS
    from motionary.workflows.tables import output_console, write_table

    experiment = EXPERIMENTS[name]
    if experiment.on == "made up" and catalog is not None:
        raise typer.BadParameter(f"{name} makes up what it aligns and takes no CATALOG")
    if experiment.on == "labelled" and catalog is None:
        raise typer.BadParameter(f"{name} needs a labelled CATALOG")
    compile_first()
    show = partial(progress, console=stderr_console())
    how = (draws or experiment.draws, seed, show)
    on: tuple = ()
    if experiment.on != "made up":
        on = (None if catalog is None else open_catalog(catalog), label_column)
    # Times are compared, and products of matrices this small lose by being shared among threads.
    with threadpool_limits(1):
        conducted = experiment.conduct(*on, *how)
    if format_ == "table":
        output_console().print(experiment.report(conducted))
    else:
        write_table(conducted.study.to_arrow(), format_)
