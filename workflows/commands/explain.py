"""The command that tells why two clips are together or apart."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from motionary.workflows.commands.options import AtSnapshot, CatalogUrl, compile_first, open_catalog

EXAMPLES = {
    "explain": (
        "motionary explain CATALOG CLIP_A CLIP_B  # the curve, the joints, the zones, the warp",
        "motionary explain CATALOG CLIP new_take.bvh --metric dtw  # a file, and by plain DTW",
        "motionary explain CATALOG CLIP_A CLIP_B --json | jq .warp",
    )
}


def explain(
    catalog: CatalogUrl,
    a: Annotated[str, typer.Argument(metavar="A", help="A clip of the catalog, or a file.")],
    b: Annotated[str, typer.Argument(metavar="B", help="The other.")],
    metric: Annotated[
        Literal["dtw", "b_dtw", "weighted", "fuzzy"] | None,
        typer.Option("--metric", help="The distance to explain.", show_default="the clusters'"),
    ] = None,
    snapshot: AtSnapshot = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Answer as JSON, complete enough to draw it.")
    ] = False,
) -> None:
    """Tell why A and B are as far apart as they are.

    Which joints make the distance, where the two are alike at each threshold of
    the DTW-Curve and which of these zones count, and how one is warped to the other.
    """
    from motionary.workflows.explain_text import print_explanation
    from motionary.workflows.tables import output_console, write_json

    compile_first()
    explanation = open_catalog(catalog, snapshot).explain(a, b, metric)
    if as_json:
        write_json(explanation.to_dict())
    else:
        print_explanation(explanation, output_console())
