"""`python -m tests.torture fuzz`: damaged files, thousands of them, and what the product makes of each.

A case is a kind, a seed and a number, and is made again from these. It is one of

- *read*: the file was taken, and what came out is finite;
- *refused*: by the product's own error, which names the file, its line where it is a motion, and a reason;
- a *fault*: any other exception, a message that lacks one of these, more memory than `MEMORY`, more time
  than `SECONDS`, or the death of the process.

Cases run in forked children, some hundred in each, so that one which hangs or dies costs itself alone.
"""

from __future__ import annotations

import faulthandler
import gc
import json
import os
import resource
import shutil
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Literal, TextIO

SECONDS = 30
"""A case that takes longer hangs: hundreds of times what a valid file of its size needs."""
MEMORY = 400 * 2**20
"""Bytes that a case may add to the process; the largest file given has a few MiB."""
BATCH = 200

Outcome = Literal["read", "refused"]


class Fault(AssertionError):
    """The product did with a damaged file what it may not; the message says what."""


@dataclass(frozen=True)
class Kind:
    """One kind of file to damage.

    Parameters
    ----------
    name : str
    share : float
        Of all cases.
    prepare : callable
        Given a folder, makes there what all cases share.
    make : callable
        Given a random generator, the case's number and the folder of `prepare`, returns the case's files by
        name.
    check : callable
        Given the folder of `prepare` and a folder with the case's files, lets the product at them.
        Raises `Fault` for an answer that is not good enough; what else it raises is a fault as well.
    """

    name: str
    share: float
    prepare: Callable[[Path], object]
    make: Callable[[Random, int, Path], Mapping[str, bytes]]
    check: Callable[[Path, Path], Outcome]


@dataclass
class Tally:
    """What came of the cases of one kind."""

    cases: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)


def fuzz(kinds: list[Kind], cases: int, seed: int, work: Path) -> dict[str, Tally]:
    """Run cases of every kind.

    Parameters
    ----------
    kinds : list of Kind
    cases : int
        Of all kinds together, divided by their shares.
    seed : int
    work : Path
        A folder to work in; the files of faulty cases stay in `work/faults`.

    Returns
    -------
    dict of str to Tally
        By kind.
    """
    whole = sum(kind.share for kind in kinds)
    tallies = {}
    for kind in kinds:
        shared = work / kind.name
        shared.mkdir(parents=True, exist_ok=True)
        kind.prepare(shared)
        count = round(cases * kind.share / whole)
        tallies[kind.name] = tally = Tally()
        start = 0
        while start < count:
            start += _batch(kind, seed, range(start, min(start + BATCH, count)), work, tally)
    return tallies


def print_tallies(tallies: Mapping[str, Tally], out: TextIO = sys.stdout) -> int:
    """Print the counts and the faults; return how many faults there are."""
    print(f"{'kind':10}{'cases':>8}{'refused':>9}{'read':>8}{'faults':>8}", file=out)
    for name, tally in tallies.items():
        refused, read = tally.outcomes["refused"], tally.outcomes["read"]
        print(f"{name:10}{tally.cases:8}{refused:9}{read:8}{len(tally.faults):8}", file=out)
    cases, faults = (
        sum(f(t) for t in tallies.values()) for f in (lambda t: t.cases, lambda t: len(t.faults))
    )
    refused, read = (sum(t.outcomes[name] for t in tallies.values()) for name in ("refused", "read"))
    print(f"{'all':10}{cases:8}{refused:9}{read:8}{faults:8}", file=out)
    for name, tally in tallies.items():
        for fault in tally.faults[:20]:
            print(f"\nFAULT {name} {fault}", file=out)
    return faults


def case_files(kind: Kind, seed: int, number: int, shared: Path) -> Mapping[str, bytes]:
    """Make the files of one case."""
    return kind.make(Random(f"{kind.name} {seed} {number}"), number, shared)


def _batch(kind: Kind, seed: int, numbers: range, work: Path, tally: Tally) -> int:
    """Run cases in a child until all are done or one kills it; return how many that were."""
    traces = work / "traces.txt"
    read_end, write_end = os.pipe()
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        try:
            _in_child(kind, seed, numbers, work, write_end, traces)
        finally:
            os._exit(0)
    os.close(write_end)
    done = 0
    with os.fdopen(read_end) as answers:
        for line in answers:
            outcome, text = json.loads(line)
            tally.outcomes[outcome] += 1
            if outcome == "fault":
                tally.faults.append(f"{numbers[done]}: {text}")
                _keep(kind, seed, numbers[done], work)
            done += 1
    _, status = os.waitpid(child, 0)
    if done < len(numbers):
        what = traces.read_text(errors="replace")[:3000] if traces.exists() else ""
        how = os.waitstatus_to_exitcode(status)
        tally.outcomes["fault"] += 1
        tally.faults.append(f"{numbers[done]}: ended the process ({how}); {what}")
        _keep(kind, seed, numbers[done], work)
        done += 1
    tally.cases += done
    return done


def _in_child(kind: Kind, seed: int, numbers: range, work: Path, answers: int, traces: Path) -> None:
    folder = work / kind.name / f"case-{os.getpid()}"
    with traces.open("w") as trace, os.fdopen(answers, "w", buffering=1) as out:
        faulthandler.enable(trace)
        for number in numbers:
            files = case_files(kind, seed, number, work / kind.name)
            _write(folder, files)
            faulthandler.dump_traceback_later(SECONDS, exit=True, file=trace)
            print(json.dumps(_judged(kind, work / kind.name, folder)), file=out)
            faulthandler.cancel_dump_traceback_later()
            shutil.rmtree(folder)


def _judged(kind: Kind, shared: Path, folder: Path) -> tuple[str, str]:
    gc.collect()
    used = _address_space()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, resource.RLIM_INFINITY))
    try:
        return kind.check(shared, folder), ""
    except Fault as fault:
        return "fault", str(fault)
    except BaseException:
        return "fault", traceback.format_exc(limit=-4)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def _address_space() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _keep(kind: Kind, seed: int, number: int, work: Path) -> None:
    _write(work / "faults" / f"{kind.name}-{seed}-{number}", case_files(kind, seed, number, work / kind.name))


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
