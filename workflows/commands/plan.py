"""The command that says what a run will take, before it."""

from __future__ import annotations

import inspect
import signal
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from motionary.workflows.commands.job_options import job_of
from motionary.workflows.commands.options import COMPILING, stderr_console
from motionary.workflows.commands.run import run
from motionary.workflows.sigterm import on_sigterm

if TYPE_CHECKING:
    from motionary.workflows.costs.foretold import Foretold
    from motionary.workflows.preparation import Job

EXAMPLES = {
    "plan": (
        "motionary plan LIBRARY",
        "motionary plan LIBRARY CATALOG  # what is left to do there",
        "motionary plan LIBRARY --workers 64 --memory 32GB --json | jq .seconds",
    ),
}

_OptionalCatalog = Annotated[
    str | None,
    typer.Argument(metavar="CATALOG", help="Where it would go.", show_default="nothing is there yet"),
]


def plan(**options: Any) -> None:
    """Say what `run` would take: clips, frames, pairs, memory, disk, and hours by the number of workers.

    Takes the options of `run`. A sample of the clips is read, compared, clustered and aligned, into temporary
    files: some seconds, up to half a minute.
    """
    from motionary.workflows.tables import write_json

    as_json = options.pop("as_json")
    with on_sigterm(_end):
        if options["catalog"] is not None:
            told = _foretell(job_of(**options))
        else:
            with TemporaryDirectory(prefix="motionary-plan-") as folder:
                nowhere = str(Path(folder, "catalog"))
                told = replace(_foretell(job_of(**options | {"catalog": nowhere})), room_on_disk=None)
    if as_json:
        write_json(told.to_json())
    else:
        print(told)


def _end(*_: object) -> NoReturn:
    """Leave as an interrupt would, so that temporary folders go: they may be large."""
    sys.exit(128 + signal.SIGTERM)


def _signature() -> inspect.Signature:
    """Take the options of `run`, so that a command line of `run` is one of `plan` too."""
    of_run = inspect.signature(run, eval_str=True)
    taken = {name: one for name, one in of_run.parameters.items() if name != "dry_run"}
    taken["catalog"] = taken["catalog"].replace(annotation=_OptionalCatalog, default=None)
    return of_run.replace(parameters=[*taken.values()])


plan.__signature__ = _signature()  # type: ignore[attr-defined]


def _foretell(job: Job) -> Foretold:
    from functools import partial

    from motionary.workflows.costs.model import foretell

    log = stderr_console()
    say = partial(log.print, highlight=False, soft_wrap=True)
    return foretell(job, partial(say, COMPILING), say)
