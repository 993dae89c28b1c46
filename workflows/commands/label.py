"""Commands on what people call clips: `motionary label ...`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from motionary.workflows.commands.options import (
    AsJson,
    CatalogUrl,
    OutputFormat,
    examples,
    open_catalog,
    stderr_console,
)

label = typer.Typer(
    no_args_is_help=True,
    help="Say what clips are called; that wins over every other name, now and in later runs.",
)

Clip = Annotated[
    str,
    typer.Argument(
        metavar="CLIP", help="A clip_id, or a pattern of *, ? and [a-z] in quotes; * matches / as well."
    ),
]


@label.command(
    "set",
    epilog=examples(
        "motionary label set CATALOG walk/walk_tired_alex_01.bvh trudge",
        "motionary label set CATALOG 'walk/*_tired_*' trudge  # all that a pattern means",
    ),
)
def set_(
    catalog: CatalogUrl,
    clip: Clip,
    called: Annotated[str, typer.Argument(metavar="LABEL", help="What it is called.")],
    as_json: AsJson = False,
) -> None:
    """Call CLIP of CATALOG by LABEL."""
    with open_catalog(catalog) as opened:
        known = opened.inputs.to_arrow()["clip_id"].to_pylist()
    _relabel(catalog, dict.fromkeys(_meant(clip, known, catalog), called.strip()), as_json)


@label.command(epilog=examples("motionary label remove CATALOG 'walk/*_tired_*'"))
def remove(catalog: CatalogUrl, clip: Clip, as_json: AsJson = False) -> None:
    """Forget what was set for CLIP: it has its supplied label again, or its cluster's."""
    with open_catalog(catalog) as opened:
        known = opened.labels.to_arrow()["clip_id"].to_pylist()
    _relabel(catalog, dict.fromkeys(_meant(clip, known, f"the list of labels of {catalog}")), as_json)


@label.command("import", epilog=examples("motionary label import CATALOG review.csv"))
def import_(
    catalog: CatalogUrl,
    csv: Annotated[
        Path,
        typer.Argument(
            metavar="CSV", help="Columns clip_id or path, and label; an empty one is passed over."
        ),
    ],
    as_json: AsJson = False,
) -> None:
    """Set the labels of a CSV, such as the list of `label review` filled in: all of them, or none."""
    from motionary.workflows.label_import import labels_to_import

    with open_catalog(catalog) as opened:
        changes = labels_to_import(csv, opened)
    _relabel(catalog, changes, as_json)


@label.command("list", epilog=examples("motionary label list CATALOG --format csv > labels.csv"))
def list_(catalog: CatalogUrl, format_: OutputFormat = "table") -> None:
    """List what people have set, also for clips that are gone: those labels wait for them."""
    from motionary.workflows.tables import write_table

    with open_catalog(catalog) as opened:
        opened.files("labels")
        listed = opened.sql(
            "select clip_id, label, set_at, set_by, i.clip_id is not null as in_library "
            "from labels l left join inputs i using (clip_id) order by clip_id"
        )
    write_table(listed, format_)


@label.command(
    epilog=examples(
        "motionary label review CATALOG -n 20",
        "motionary label review CATALOG --format csv > review.csv  # fill in column label, then import it",
    )
)
def review(
    catalog: CatalogUrl,
    format_: OutputFormat = "table",
    most: Annotated[int, typer.Option("-n", min=1, help="The most clips to list.")] = 50,
) -> None:
    """List what to look at first: likely mistakes, uncertain names, clips without one, duplicates.

    As CSV it can be edited and imported again: column label is for what you decide.
    """
    from motionary.catalog.review import left_open
    from motionary.catalog.review import review as listed
    from motionary.workflows.tables import write_table

    with open_catalog(catalog) as opened:
        found, less = listed(opened), left_open(opened)
    shown = found.slice(0, most)
    write_table(shown.drop_columns("label") if format_ == "table" else shown, format_)
    if len(found) > most:
        _say(f"{most} of {len(found)} clips; -n {len(found)} lists them all")
    if less:
        _say(less)


def _meant(clip: str, known: Sequence[str], where: str) -> list[str]:
    """Find the clips that a name or a pattern means; a name that is there is never a pattern."""
    from fnmatch import fnmatchcase

    from motionary.workflows.relabel import refuse_unknown

    matching = [one for one in known if fnmatchcase(one, clip)] if clip not in known else [clip]
    if not matching:
        refuse_unknown([clip], known, where)
    return matching


def _relabel(url: str, changes: Mapping[str, str | None], as_json: bool) -> None:
    from motionary.workflows.relabel import relabel
    from motionary.workflows.summary import counted
    from motionary.workflows.tables import write_json

    take_over = lambda dead: _say(f"taking over from a run that died: {dead}")  # noqa: E731
    with open_catalog(url) as before, relabel(url, changes, current_user(), take_over) as after:
        snapshot_id = after.snapshot.snapshot_id
        changed = before.snapshot.snapshot_id != snapshot_id
    if as_json:
        write_json({"clips": [*changes] if changed else [], "snapshot": snapshot_id})
    elif changed:
        _say(f"labels of {counted(len(changes), 'clip')} changed in snapshot {snapshot_id}")
    else:
        why = "every label was so already" if changes else "there is no label to set"
        _say(f"{why}; nothing was changed")


def current_user() -> str:
    """Name who is at work; by number where the system knows no name."""
    import getpass
    import os

    try:
        return getpass.getuser()
    except (KeyError, OSError, ImportError):  # Python before 3.13 lets the lookup's own error through
        return f"user {os.getuid()}" if hasattr(os, "getuid") else "unknown"


def _say(remark: str) -> None:
    stderr_console().print(remark, highlight=False, soft_wrap=True, markup=False)
