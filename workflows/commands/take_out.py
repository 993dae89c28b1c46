"""Commands that write motions of a catalog as files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from motionary.workflows.commands.options import QUARANTINED, AsJson, CatalogUrl, open_catalog, stderr_console

EXAMPLES = {
    "export": (
        "motionary export CATALOG walks --cluster walk --aligned  # BVH, in the time of the reference",
        "motionary export CATALOG tired --where \"style = 'tired'\" --format csv",
        "motionary export CATALOG DIR --split train=.8,test=.2 --group subject",
        "motionary export CATALOG DIR --format jsonl --card  # README.md, card.json, clips.jsonl, too",
    ),
    "transfer": (
        "motionary transfer CATALOG tired_walk.bvh --style CLIP --onto OTHER  # both of one cluster",
    ),
}

Where = Annotated[
    str | None, typer.Option("--where", metavar="SQL", help="Only clips that fulfil this condition.")
]
SplitShares = Annotated[
    str | None,
    typer.Option(
        "--split", metavar="PART=SHARE,...", help="A folder a part: train=.8,test=.2; parts no recording."
    ),
]
Group = Annotated[
    list[str] | None,
    typer.Option(
        "--group", metavar="COLUMN", help="Nor clips with one value of this label, such as subject; repeat."
    ),
]
SharedFrames = Annotated[
    bool,
    typer.Option(
        "--shared-frames/--no-shared-frames", help="Whether clips that share a frame are one recording."
    ),
]


def export(
    catalog: CatalogUrl,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the files go; made if missing.")],
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", help="Only the cluster of this number, or all of this name."),
    ] = None,
    clip: Annotated[list[str] | None, typer.Option("--clip", help="Only this clip; repeat for more.")] = None,
    where: Where = None,
    aligned: Annotated[
        bool,
        typer.Option("--aligned", help="In the time of the cluster's reference instead of as captured."),
    ] = False,
    format_: Annotated[
        Literal["bvh", "npz", "csv", "parquet", "jsonl"],
        typer.Option("--format", help="A BVH, NPZ or CSV a clip; or Parquet or JSONL for all."),
    ] = "bvh",
    split: SplitShares = None,
    group: Group = None,
    seed: Annotated[int, typer.Option("--seed", help="Another one gives another split.")] = 0,
    shared_frames: SharedFrames = True,
    card: Annotated[
        bool, typer.Option("--card", help="Write a data card and a list of the clips; a split always does.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files that are there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write motions of CATALOG to DIR: of a cluster, of some clips, or all.

    A file is called by its clip's path in the library, with another suffix.
    Lengths stay in the source's units; BVH does not say which they are.
    """
    if cluster is not None and clip:
        raise typer.BadParameter("give --cluster or --clip, not both")
    if group and split is None:
        raise typer.BadParameter("--group is for a --split")
    from functools import partial

    from motionary.catalog.export_plan import plan_export
    from motionary.workflows.export import export_record, export_summary, split_remarks, write_with_progress
    from motionary.workflows.progress import progress
    from motionary.workflows.tables import write_json

    plan = plan_export(
        open_catalog(catalog),
        folder,
        format_,
        clips=clip or None,
        cluster=cluster,
        where=where,
        aligned=aligned,
        split=_shares(split),
        group=group or (),
        seed=seed,
        shared_frames=shared_frames,
        card=card,
        overwrite=overwrite,
    )
    for remark in split_remarks(plan):
        print(f"motionary: {remark}", file=sys.stderr)
    failed = write_with_progress(plan, partial(progress, console=stderr_console()))
    for one in failed:
        print(f"motionary: {one.clip_id} is not exported: {one.reason}", file=sys.stderr)
    if as_json:
        write_json(export_record(plan, failed))
    else:
        print(export_summary(plan, failed))
    if failed:
        raise typer.Exit(QUARANTINED)


def _shares(text: str | None) -> dict[str, float] | None:
    from motionary.catalog import CatalogError
    from motionary.catalog.splits import read_shares

    try:
        return None if text is None else read_shares(text)
    except CatalogError as error:
        raise typer.BadParameter(str(error)) from error


def transfer(
    catalog: CatalogUrl,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="A file ending in .bvh.")],
    style: Annotated[str, typer.Option("--style", metavar="CLIP", help="Whose style is taken.")],
    onto: Annotated[str, typer.Option("--onto", metavar="CLIP", help="Who gets it; of the same cluster.")],
    as_json: AsJson = False,
) -> None:
    """Give one clip of CATALOG the style of another, as BVH.

    Both are taken in the time of their cluster's reference. Printed is how fast
    feet slide while they stand, of both and of the result.
    """
    from motionary.workflows.tables import output_console, write_json
    from motionary.workflows.transfer import sliding_table, transfer_to_bvh

    made = transfer_to_bvh(open_catalog(catalog), out, style, onto)
    if as_json:
        write_json({"file": str(out), **made.record()})
    else:
        print(f"wrote {out}: {made.motion.frames} frames, in the time of {made.reference_id}")
        output_console().print(sliding_table(made))
    if made.is_jerky:
        stderr_console().print(
            "a joint of the result is more than twice as fast as the sources': rotations that flip in the "
            f"source of {style}, {onto} or {made.reference_id} look so; look at it before you use it",
            highlight=False,
            soft_wrap=True,
        )
