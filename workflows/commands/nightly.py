"""The command that a timer starts."""

from __future__ import annotations

import sys
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motionary.workflows.commands.options import fail

if TYPE_CHECKING:
    from motionary.workflows.preparation import Job

EXAMPLES = {
    "nightly": (
        "motionary nightly --example > nightly.toml  # every setting, with a comment",
        "motionary nightly nightly.toml --dry-run  # counts and an estimate as JSON",
        "motionary nightly nightly.toml --json  # the report on stdout, the log on stderr",
    )
}

_USAGE = 2


def nightly(
    config: Annotated[
        Path | None,
        typer.Argument(metavar="CONFIG", help="TOML file; --example shows one.", show_default=False),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would be done, and write nothing.")
    ] = False,
    example: Annotated[bool, typer.Option("--example", help="Print a commented CONFIG and exit.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Answer with the report.")] = False,
) -> None:
    """Run the main job as a timer does: with limits, retention, log and report.

    Exit codes: 0 published, 1 failed or refused by a limit, 2 CONFIG is wrong, 3 published with quarantined
    clips.
    """
    if example:
        print(files("motionary.workflows").joinpath("nightly.toml").read_text(encoding="utf-8"), end="")
        return
    if config is None:
        raise typer.BadParameter("name a configuration file; --example shows one")
    from motionary.workflows.nightly_settings import load_nightly
    from motionary.workflows.settings import SettingsError

    try:
        settings = load_nightly(config)
    except SettingsError as error:
        print(f"motionary: {error}", file=sys.stderr)
        raise typer.Exit(_USAGE) from None
    if dry_run:
        _plan(settings.job)
        return
    from motionary.workflows.nightly import run_nightly
    from motionary.workflows.run_log import open_log

    with open_log(settings.log) as log:
        report = run_nightly(settings, log)
    if settings.log is not None and report.error:  # cron sends stderr by mail; without a file it is the log
        fail(report.error)
    if as_json:
        print(report.to_json())
    else:
        print(f"{report.run_id} {report.status}, snapshot {report.snapshot_after or report.snapshot_before}")
    raise typer.Exit(report.exit_code)


def _plan(job: Job) -> None:
    import json
    from dataclasses import asdict

    from motionary.workflows.nightly import refuse_empty_libraries
    from motionary.workflows.preparation import prepare

    refuse_empty_libraries(job.libraries)
    print(json.dumps(asdict(prepare(job).plan)))
