"""The command that aligns one motion to another, by any method."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motionary.workflows.commands.options import AtSnapshot, OutputFormat, compile_first, open_catalog

if TYPE_CHECKING:
    from motionary.catalog.views.alignment_ways import Way

EXAMPLES = {
    "align": (
        "motionary align walk.bvh other.bvh  # how well CoTW brings one into the time of the other",
        "motionary align CATALOG A B --method dtw --method cotw --plot out.html",
        "motionary align CATALOG A B --method all --format json",
        "motionary align A.bvh B.bvh --plot out.html --joint left_wrist",
    )
}

METHODS = {
    "uniform": "UTW",
    "dtw": "DTW",
    "dtw-sakoe-chiba": "DTW, Sakoe-Chiba",
    "dtw-itakura": "DTW, Itakura",
    "limited-dtw": "DTW, 2 steps",
    "derivative-dtw": "DDTW",
    "iterative-motion-warping": "IMW",
    "canonical-time-warping": "CTW",
    "generalized-time-warping": "GTW",
    "cotw": "CoTW",
    "adaptive-dtw": "adaptive DTW",
    "online-a": "online A",
    "online-b": "online B",
    "online-c": "online C",
}
"""Names and titles of `motionary.pipeline.alignment.registry.ALIGNERS`, which help must not import."""

EVERY = "all"


def align(
    takes: Annotated[
        list[str],
        typer.Argument(
            metavar="[CATALOG] A B",
            help="Two files; or a catalog and two of its clips, or files that are read by its settings.",
        ),
    ],
    method: Annotated[
        list[str] | None,
        typer.Option(
            "--method",
            help=f"{', '.join(METHODS)}, or as in papers (DDTW, GTW); repeat it to compare some, or {EVERY}.",
            show_default="cotw",
            autocompletion=lambda: [*METHODS, EVERY],
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot", metavar="OUT.html", help="A page that shows it; one that is there is replaced."
        ),
    ] = None,
    joint: Annotated[
        list[str] | None,
        typer.Option(
            "--joint", help="Plot this canonical joint; repeat for more.", show_default="what moves most"
        ),
    ] = None,
    format_: OutputFormat = "table",
    snapshot: AtSnapshot = None,
) -> None:
    """Bring A into the time of B, and score it.

    The first line, uniform, is A only stretched to B's length. The page of --plot
    plays both, and shows the warp over the costs and joints before and after.
    """
    url, moving, reference = _named(takes)
    if snapshot is not None and url is None:
        raise typer.BadParameter("--snapshot is of a catalog: give CATALOG A B")
    asked = _checked_methods(method or ["cotw"])
    ways = _checked_ways(joint, plot)
    _check_plot(plot)
    from contextlib import nullcontext

    from threadpoolctl import threadpool_limits

    from motionary.workflows.align_pair import align_pair, read_pair, write_alignment_page
    from motionary.workflows.tables import write_table

    with nullcontext() if url is None else open_catalog(url, snapshot) as catalog:
        pair = read_pair(moving, reference, catalog)
    compile_first()
    with threadpool_limits(1):  # products of matrices this small lose by being shared among threads
        made = align_pair(pair, [*METHODS] if EVERY in asked else asked, lenient=EVERY in asked)
    for name, why in made.refused.items():
        print(f"motionary: {name} is left out: {why}", file=sys.stderr)
    if plot is not None:
        print(f"wrote {plot}: {write_alignment_page(made, plot, ways) / 1e6:.1f} MB", file=sys.stderr)
    write_table(made.scores, format_)


def _named(takes: list[str]) -> tuple[str | None, str, str]:
    if len(takes) not in (2, 3):
        raise typer.BadParameter(f"{len(takes)} names; give two files, or a catalog and two of its clips")
    return (takes[0] if len(takes) == 3 else None), takes[-2], takes[-1]


def _checked_methods(methods: list[str]) -> list[str]:
    """Return the names of methods, which may be given by their titles or as functions are written, too."""
    known = {EVERY: EVERY}
    for name, title in METHODS.items():
        known |= {name: name, title.lower(): name}
    asked = []
    for one in methods:
        plain = one.strip().lower().replace("_", "-")
        if plain not in known:
            raise typer.BadParameter(
                f"{one!r} is none of {', '.join(METHODS)}, {EVERY}", param_hint="--method"
            )
        asked.append(known[plain])
    return asked


def _checked_ways(joints: list[str] | None, plot: Path | None) -> list[Way] | None:
    """Return every direction of the joints."""
    if not joints:
        return None
    if plot is None:
        raise typer.BadParameter("--joint is what is plotted; give it with --plot OUT.html")
    from motionary.pipeline.canonical import CANONICAL_JOINTS

    unknown = [one for one in joints if one not in CANONICAL_JOINTS]
    if unknown:
        known = ", ".join(CANONICAL_JOINTS)
        raise typer.BadParameter(f"{unknown[0]!r} is none of {known}", param_hint="--joint")
    return [(one, direction) for one in dict.fromkeys(joints) for direction in range(3)]


def _check_plot(plot: Path | None) -> None:
    if plot is None:
        return
    if plot.suffix.lower() not in (".html", ".htm"):
        raise typer.BadParameter(f"{plot} does not end in .html", param_hint="--plot")
    from motionary.workflows.errors import UserError

    if plot.is_dir():
        raise UserError(f"{plot} is a folder; name a file in it")
    if not plot.absolute().parent.is_dir():
        raise UserError(f"there is no folder {plot.absolute().parent} to write {plot.name} to; make it")
