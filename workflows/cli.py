"""The command line: which commands there are, and what becomes of what they raise.

What computes is imported inside the commands, so that `--help` answers at once.
"""

from __future__ import annotations

import errno
import os
import sys
from typing import Annotated, NoReturn

import typer

from motionary.workflows.commands import (
    align,
    assign,
    browse,
    check,
    explain,
    fetch,
    label,
    look,
    nightly,
    plan,
    report,
    reproduce,
    run,
    similar,
    snapshots,
    take_out,
)
from motionary.workflows.commands.options import examples, fail
from motionary.workflows.errors import UserError

CLOSED_PIPE = 128 + 13
"""Exit code where nobody reads on: what a shell shows of the tools that SIGPIPE, signal 13, has ended."""

app = typer.Typer(
    name="motionary",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 failed, 2 usage, 3 done with quarantined clips, 4 verification failed, "
    "141 nobody read the answer to its end (as in `| head -1`).",
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


# A module's EXAMPLES name its commands; the order is that of `motionary --help`.
for module in (
    run,
    plan,
    nightly,
    look,
    report,
    browse,
    similar,
    assign,
    explain,
    align,
    take_out,
    snapshots,
    check,
    fetch,
    reproduce,
):
    for name, lines in module.EXAMPLES.items():
        app.command(name, epilog=examples(*lines))(getattr(module, name))
app.add_typer(label.label, name="label")


def main() -> NoReturn:
    """Run the command line and exit; what a user can mend is one line on stderr and exit code 1."""
    if sys.stdout is None:
        fail("standard output is closed, and answers are written there; redirect it, if only to /dev/null")
    try:
        _answer()
    except BrokenPipeError:  # the reader has seen enough; nothing more may be written, at exit neither
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115
        sys.exit(CLOSED_PIPE)
    except UserError as error:
        fail(str(error))
    except OSError as error:
        fail(_disk_fault(error))
    except Exception as error:
        from motionary.catalog import CatalogError
        from motionary.pipeline.canonical import SkeletonError
        from motionary.pipeline.compilation import KernelCacheError
        from motionary.pipeline.readers import ReadError

        told = isinstance(error, CatalogError | ReadError | SkeletonError | KernelCacheError)
        # What keeps s3fs from reaching a server, or from signing in there, is botocore's own.
        if not told and not type(error).__module__.startswith("botocore."):
            raise
        fail(str(error))
    sys.exit(0)


def _answer() -> None:
    """Run the command, to the last byte of its answer; Typer and Rich would exit with 1 at a closed pipe."""
    try:
        app(prog_name="motionary")
    except SystemExit as ended:
        if isinstance(ended.__context__, BrokenPipeError):
            raise ended.__context__ from None
        print(end="", flush=True)  # while what this raises can still be told
        raise


_MENDS = {
    errno.ENOSPC: "make room there; what was published is as it was",
    errno.EDQUOT: "the quota is used up: make room there; what was published is as it was",
    errno.EROFS: "that folder cannot be written: name another, or mount it for writing",
    errno.EACCES: "let this user write there, or name another folder",
    errno.EPERM: "let this user write there, or name another folder",
    errno.EMFILE: "allow more open files: ulimit -n",
}


def _disk_fault(error: OSError) -> str:
    """Say what the disk refused, where, and what to do about it."""
    mend = _MENDS.get(error.errno or 0)
    if error.strerror is None or mend is None:
        return str(error)
    where = f"{error.filename}: " if error.filename else ""
    return f"{where}{error.strerror[:1].lower()}{error.strerror[1:]}; {mend}"
