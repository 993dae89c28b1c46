"""Commands that write motions of a catalog as files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from motionary.workflows.commands.options import QUARANTINED, CatalogUrl, open_catalog, stderr_console


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
        open_catalog(catalog),
        folder,
        format_,
        clips=clip or None,
        cluster=cluster,
        aligned=aligned,
        overwrite=overwrite,
    )
    failed = write_with_progress(plan, partial(progress, console=stderr_console()))
    for one in failed:
        print(f"motionary: {one.clip_id} is not exported: {one.reason}", file=sys.stderr)
    print(export_summary(plan, len(failed)))
    if failed:
        raise typer.Exit(QUARANTINED)


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

    made = transfer_to_bvh(open_catalog(catalog), out, style, onto)
    print(f"wrote {out}: {made.motion.frames} frames, in the time of {made.reference_id}")
    output_console().print(sliding_table(made))
    if made.is_jerky:
        stderr_console().print(
            "a joint of the result is more than twice as fast as the sources': rotations that flip in the "
            f"source of {style}, {onto} or {made.reference_id} look so; look at it before you use it",
            highlight=False,
            soft_wrap=True,
        )
