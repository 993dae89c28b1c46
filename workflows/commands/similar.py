"""The command that finds clips like a clip or a file."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from motionary.workflows.commands.options import (
    AtSnapshot,
    CatalogUrl,
    OutputFormat,
    compile_first,
    open_catalog,
)

if TYPE_CHECKING:
    import pyarrow as pa

    from motionary.catalog import Catalog
    from motionary.catalog.neighbours import Rank
    from motionary.pipeline.config import Metric

EXAMPLES = {
    "similar": (
        "motionary similar CATALOG CLIP  # the ten clips nearest to it",
        "motionary similar CATALOG new_take.bvh -k 5 --joints arms  # a file, by its arms alone",
        "motionary similar CATALOG CLIP --rank mutual  # libraries of different energy evened out",
        "motionary similar CATALOG step.bvh --within  # where it occurs in the takes, and when",
        "motionary similar CATALOG CLIP --format json | jq '.[].clip_id'",
    )
}


def similar(
    catalog: CatalogUrl,
    clip_or_file: Annotated[
        str, typer.Argument(metavar="CLIP_OR_FILE", help="A clip of the catalog, or a motion file.")
    ],
    k: Annotated[int, typer.Option("-k", min=1, help="How many to find.")] = 10,
    metric: Annotated[
        Literal["dtw", "b_dtw", "weighted", "fuzzy"] | None,
        typer.Option("--metric", help="The distance.", show_default="the clusters'"),
    ] = None,
    joints: Annotated[
        str | None,
        typer.Option(
            "--joints",
            help="Compare these joints alone: arms, legs, full, or canonical joints with commas between.",
        ),
    ] = None,
    rank: Annotated[
        Literal["distance", "mutual"],
        typer.Option("--rank", help="By distance, or by how near each is for the other."),
    ] = "distance",
    within: Annotated[
        bool, typer.Option("--within", help="Find where in the takes it occurs, with times.")
    ] = False,
    format_: OutputFormat = "table",
    snapshot: AtSnapshot = None,
) -> None:
    """Find the clips of CATALOG that are most like a clip or a file.

    A clip's distances are read where the run stored all pairs; else a clip, as a file, is compared with all,
    exactly. --rank mutual needs all pairs.
    """
    if within and (metric is not None or rank != "distance"):
        raise typer.BadParameter("--within has a distance of its own; give it without --metric and --rank")
    if joints is not None and rank == "mutual":
        raise typer.BadParameter("--rank mutual is of the stored distances; give it without --joints")
    from motionary.workflows.tables import write_table

    opened = open_catalog(catalog, snapshot)
    if within:
        table, remark = _occurrences(opened, clip_or_file, k, joints)
    else:
        table, remark = _similar(opened, clip_or_file, k, metric, joints, rank)
    write_table(table, format_)
    print(remark, file=sys.stderr)


def _similar(
    catalog: Catalog, clip_or_file: str, k: int, metric: Metric | None, joints: str | None, rank: Rank
) -> tuple[pa.Table, str]:
    from motionary.catalog.example import clip_seconds
    from motionary.catalog.neighbours import FEW_FRAMES
    from motionary.catalog.neighbours import similar as similar_clips

    if joints is not None or clip_or_file not in clip_seconds(catalog):
        compile_first()
    chosen = None if joints is None else _checked_joints(catalog, joints)
    found = similar_clips(catalog, clip_or_file, k, metric=metric, joints=chosen, rank=rank)
    hint = ""
    if found.frames is not None and found.frames < FEW_FRAMES:
        hint = "; --within finds where in longer takes it occurs"
    return found.table, f"{found.name}: {found.how}{hint}"


def _checked_joints(catalog: Catalog, joints: str) -> list[str]:
    from motionary.catalog.joint_columns import joint_columns

    names = [joint.strip() for joint in joints.split(",")]
    try:
        joint_columns(names, catalog.config.features.kind)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--joints") from error
    return names


def _occurrences(catalog: Catalog, clip_or_file: str, k: int, joints: str | None) -> tuple[pa.Table, str]:
    from motionary.catalog.occurrences import occurrences

    compile_first()
    chosen = None if joints is None else _checked_joints(catalog, joints)
    found = occurrences(catalog, clip_or_file, k, joints=chosen)
    return found.to_arrow(), repr(found).strip("<>")
