"""The command that repeats the papers' experiments."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from motionary.workflows.commands.options import OutputFormat, open_catalog, stderr_console

EXAMPLES = {
    "reproduce": (
        "motionary reproduce dtw-curve CATALOG",
        "motionary reproduce cotw CATALOG --draws 3 --format json",
        "motionary reproduce assign CATALOG",
        "motionary reproduce style",
    )
}


def reproduce(
    name: Annotated[
        Literal["dtw-curve", "dtw-curve-better", "cotw", "style", "assign", "mutual"],
        typer.Argument(metavar="NAME", help="dtw-curve, dtw-curve-better, cotw, style, assign or mutual."),
    ],
    catalog: Annotated[
        str | None, typer.Argument(metavar="CATALOG", help="Labelled catalog; style needs none.")
    ] = None,
    draws: Annotated[
        int | None,
        typer.Option(
            "--draws",
            min=1,
            help="Sets of clips drawn by each rule; for cotw, pairs of each action; for assign, partings.",
            show_default="100, cotw 10, assign 5",
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
    by what alignment leaves over, on made-up takes. assign: whether takes that are held out get their names.
    mutual: whether ranking by mutual proximity finds a clip's action better.
    """
    from functools import partial

    from motionary.workflows.progress import progress
    from motionary.workflows.tables import output_console, write_table

    show = partial(progress, console=stderr_console())
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
        experiment = conduct(open_catalog(catalog), label_column, draws or usual, seed, show)
        study, printed = experiment.study, report(experiment)
    if format_ == "table":
        output_console().print(printed)
    else:
        write_table(study.to_arrow(), format_)
