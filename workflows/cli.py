"""The command line: which commands there are, and what becomes of what they raise.

What computes is imported inside the commands, so that `--help` answers at once.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated, NoReturn

import typer

from motionary.workflows.commands.look import query, status
from motionary.workflows.commands.options import FAILED, fail
from motionary.workflows.commands.reproduce import reproduce
from motionary.workflows.commands.run import demo, graph, run
from motionary.workflows.commands.take_out import export, transfer
from motionary.workflows.errors import UserError

app = typer.Typer(
    name="motionary",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 failed, 2 usage, 3 done with quarantined clips.",
)


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(version("motionary"))
        raise typer.Exit


@app.callback()
def motionary(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Cluster, name and align a library of motion capture: a dictionary of motion."""


for command in (run, demo, status, query, graph, export, transfer, reproduce):
    app.command()(command)


def main() -> NoReturn:
    """Run the command line and exit; what a user can mend is one line on stderr and exit code 1."""
    try:
        app(prog_name="motionary")
    except BrokenPipeError:  # the reader has seen enough; nothing more may be written, at exit neither
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115
        sys.exit(FAILED)
    except (UserError, OSError) as error:
        fail(str(error))
    except Exception as error:
        from motionary.catalog import CatalogError

        if not isinstance(error, CatalogError):
            raise
        fail(str(error))
    sys.exit(0)
