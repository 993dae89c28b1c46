"""`python -m tests.torture kill`: runs killed with SIGKILL, and what is left of the catalog.

A catalog of 20 clips is there. Its library gains four, loses one, one is changed and one renamed; the run
over it is killed, its whole process group at once, and

- the catalog must open at its old snapshot (or at the new one, if the run had come to publishing), verify,
  and hold the same rows;
- the same run, started again, must end well and publish the tables of a run that nobody killed;
- of the parts that were whole at the kill, those written again belong to one unit of work at most (one task;
  one a worker).

Half the moments are drawn from the time that a run takes; the others are its *steps*: before and after
every kind of file is put in place, for the first and for the last time. Steps are found from outside, by
counting the calls of `os.replace` and `os.rename` in a run of one process; the product has no hook for this.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random
from typing import Literal

import pyarrow as pa

from motionary.catalog import Catalog
from motionary.catalog.verify import verify
from tests.torture import forked
from tests.torture.world import (
    add_clip,
    contents,
    differences,
    embedded_library,
    linked_copy,
    run_arguments,
    spread,
    take_clips,
)

CLIPS, GAINED = 20, 4
SETTLED = 2.5
"""Seconds after which a run trusts the times of files that were changed."""
TABLES_BY_LABEL = "select label, count(*) as clips from clusters group by label order by label"

RECORDS = ("inputs", "labels", "runs")
"""Tables that publishing writes, which no unit of work computes."""

When = Literal["before", "after"]
State = dict[str, tuple[int, int]]


@dataclass(frozen=True)
class Scene:
    """What every kill starts from and is held against.

    Parameters
    ----------
    work : Path
    arguments : callable
        Of a catalog's folder and a number of workers: those of the run.
    catalog : Path
        The catalog before the run; never run into.
    old, new, again : mapping of str to pyarrow.Table
        The tables before the run, after it, and after it and another.
    seconds : mapping of int to float
        How long the run takes, by number of workers.
    steps : sequence of str
        What the run puts in place, in order.
    """

    work: Path
    arguments: Callable[[Path, int], list[str]]
    catalog: Path
    old: Mapping[str, pa.Table]
    new: Mapping[str, pa.Table]
    again: Mapping[str, pa.Table]
    seconds: Mapping[int, float]
    steps: Sequence[str]


@dataclass(frozen=True)
class Kill:
    """One kill: after `seconds`, or before or after the `step`-th file is put in place (from 0)."""

    workers: int = 1
    seconds: float = 0.0
    step: int | None = None
    when: When = "before"


@dataclass
class Kills:
    """What came of all kills."""

    by_moment: int = 0
    by_step: int = 0
    too_late: int = 0
    after_publishing: int = 0
    resumed: int = 0
    left_over: int = 0
    units_again: Counter[int] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)


def set_up(work: Path, count: int = CLIPS, workers: Sequence[int] = (1, 2)) -> Scene:
    """Make the catalog, change the library, and run without a kill."""
    forked.warm_up(work)
    embedded, library, catalog = embedded_library(work / "embedded"), work / "library", work / "before"
    settings = work / "settings.toml"
    settings.write_text("[distances]\ntile = 4\n")  # several units of work in every stage

    def arguments(catalog: Path, workers: int) -> list[str]:
        return [*run_arguments(library, catalog, workers), "--config", str(settings)]

    names = take_clips(embedded, library, count)
    _finish(arguments(catalog, 1), work / "log.txt")
    _change(embedded, library, names)
    time.sleep(SETTLED)
    _copy(catalog, work / "after")
    seconds = {}
    for number in workers:
        _copy(catalog, work / "after")
        started = time.perf_counter()
        _finish(arguments(work / "after", number), work / "log.txt")
        seconds[number] = time.perf_counter() - started
    new = forked.call(partial(contents, work / "after"))
    _finish(arguments(work / "after", 1), work / "log.txt")
    again = forked.call(partial(contents, work / "after"))
    old = forked.call(partial(contents, catalog))
    steps = _steps(arguments(_copy(catalog, work / "after"), 1), work)
    return Scene(work, arguments, catalog, old, new, again, seconds, steps)


def plan(scene: Scene, kills: int, seed: int, steps: int | None = None) -> list[Kill]:
    """Choose the moments: `kills` at random, one in ten with two workers, and all steps or some of them."""
    rng = Random(seed)
    moments = []
    for number in range(kills):
        workers = 2 if 2 in scene.seconds and number % 10 == 9 else 1
        moments.append(Kill(workers, rng.uniform(0, scene.seconds[workers])))
    places = [
        Kill(step=step, when=when)
        for name in dict.fromkeys(scene.steps)
        for step in sorted({scene.steps.index(name), len(scene.steps) - 1 - scene.steps[::-1].index(name)})
        for when in ("before", "after")
    ]
    return moments + (places if steps is None else rng.sample(places, min(steps, len(places))))


def run_kills(
    scene: Scene, kills: Sequence[Kill], show: Callable[[int, Kills], object] = lambda done, kills: None
) -> Kills:
    """Kill, look, run again and compare, kill by kill."""
    found = Kills()
    for number, one in enumerate(kills, 1):
        _one(scene, one, found)
        show(number, found)
    return found


def print_kills(scene: Scene, found: Kills) -> None:
    """Print the counts."""
    total = found.by_moment + found.by_step
    again = ", ".join(f"{units}: {count}" for units, count in sorted(found.units_again.items()))
    print(f"a run takes {', '.join(f'{s:.2f} s with {w} workers' for w, s in scene.seconds.items())}")
    print(f"steps (files put in place by a run): {len(scene.steps)}, of {len(set(scene.steps))} kinds")
    print(f"kills                                    {total}")
    print(f"  at random moments                      {found.by_moment}")
    print(f"  at steps                               {found.by_step}")
    print(f"  that came after the run's end          {found.too_late}")
    print(f"  after the new snapshot was published   {found.after_publishing}")
    print(f"resumed, with the tables of an unkilled run  {found.resumed}")
    print(f"units of work done twice (units: kills)  {again}")
    print(f"unfinished files left by the kills       {found.left_over}")
    print(f"faults                                   {len(found.faults)}")
    for fault in found.faults[:20]:
        print(f"\nFAULT kill {fault}")


def _one(scene: Scene, kill: Kill, found: Kills) -> None:
    catalog = _copy(scene.catalog, scene.work / "killed")
    arguments = scene.arguments(catalog, kill.workers)
    code = _killed(arguments, kill, scene.work / "log.txt")
    found.too_late += code is not None
    found.by_moment += kill.step is None
    found.by_step += kill.step is not None
    if kill.step is not None and code is not None:
        found.faults.append(f"{kill}: the step never came: {_tail(scene.work / 'log.txt')}")
    published = (catalog / "CURRENT").read_text() != (scene.catalog / "CURRENT").read_text()
    found.after_publishing += published
    expected = scene.new if published else scene.old
    faults = forked.call(partial(_faults_of, catalog, expected))
    found.left_over += len(list(catalog.rglob("*.tmp")))

    whole = _state(catalog)
    resumed = forked.wait(forked.start(arguments, scene.work / "log.txt"))
    if resumed != 0:
        faults.append(f"the run that follows ends with {resumed}: {_tail(scene.work / 'log.txt')}")
    else:
        different = forked.call(partial(_differences, catalog, scene.again if published else scene.new))
        faults += [f"after the run that follows table {one} differs" for one in different]
        found.resumed += not different
        now = _state(catalog)
        units = {Path(name).stem for name, was in whole.items() if now.get(name, was) != was}
        found.units_again[len(units)] += 1
        if len(units) > kill.workers:
            faults.append(f"{len(units)} units of work done twice: {sorted(units)}")
    found.faults += [f"{kill}: {one}" for one in faults]


def _faults_of(catalog: Path, expected: Mapping[str, pa.Table]) -> list[str]:
    """Open a catalog, verify it, ask it a question, and compare it with what it must hold."""
    faults = [f"{check.name}: {check.detail}" for check in verify(str(catalog)) if not check.passed]
    faults += [f"table {one} differs" for one in _differences(catalog, expected)]
    if faults:
        return faults
    with Catalog.open(str(catalog)) as opened:
        answer = opened.sql(TABLES_BY_LABEL)
        labels = expected["clusters"]["label"].to_pylist()
        if dict(zip(*(column.to_pylist() for column in answer.columns), strict=True)) != Counter(labels):
            faults.append(f"the clusters' labels are {answer.to_pylist()}")
    return faults


def _differences(catalog: Path, expected: Mapping[str, pa.Table]) -> Sequence[str]:
    try:
        return differences(expected, contents(catalog))
    except Exception as error:  # a catalog that cannot be read is a finding
        return [f"? ({error})"]


def _killed(arguments: list[str], kill: Kill, log: Path) -> int | None:
    """Run and kill; return the exit code of a run that had ended before."""
    if kill.step is None:
        child = forked.start(arguments, log)
        code = forked.wait(child, kill.seconds)
        if code is None:
            forked.kill(child)
        return code
    child = forked.start(arguments, log, partial(_die_at, kill.step, kill.when))
    code = forked.wait(child)
    forked.wait_for_group(child)
    return None if code == -signal.SIGKILL else code


def _die_at(step: int, when: When) -> None:
    """Make this process kill its group before or after it puts its `step`-th file in place."""

    def die(number: int, place: When, target: str) -> None:
        if (number, place) == (step, when):
            os.killpg(0, signal.SIGKILL)

    _watch_steps(die)


def _steps(arguments: list[str], work: Path) -> list[str]:
    """Run, and list what the run puts in place: the folder of a part, the name of another file."""
    told = work / "steps.txt"
    told.unlink(missing_ok=True)

    def tell(number: int, place: When, target: str) -> None:
        if place == "before":
            with told.open("a") as file:
                file.write(f"{target}\n")

    _finish(arguments, work / "log.txt", lambda: _watch_steps(tell))
    targets = told.read_text().splitlines()
    return [re.sub(r"[0-9a-f]{6,}", "ID", str(Path(*Path(one).parts[-2:]))) for one in targets]


def _watch_steps(tell: Callable[[int, When, str], object]) -> None:
    number = -1

    def watched(original: Callable) -> Callable:
        def put(source: object, target: object, *others: object, **options: object) -> object:
            nonlocal number
            number += 1
            mine = number
            tell(mine, "before", str(target))
            result = original(source, target, *others, **options)
            tell(mine, "after", str(target))
            return result

        return put

    os.replace, os.rename = watched(os.replace), watched(os.rename)


def _change(embedded: Path, library: Path, names: list[str]) -> None:
    """Let a library gain four clips and lose one, change one, and rename one."""
    for name in spread(embedded)[len(names) : len(names) + GAINED]:
        add_clip(embedded, library, name)
    (library / names[0]).unlink()
    other = spread(embedded)[len(names) + GAINED]
    add_clip(embedded, library, other, under=names[1])
    (library / names[2]).rename(library / "renamed.bvh")


def _finish(arguments: list[str], log: Path, before: Callable[[], object] = lambda: None) -> None:
    code = forked.wait(forked.start(arguments, log, before))
    if code != 0:
        raise RuntimeError(f"a run that nobody killed ended with {code}: {_tail(log)}")


def _copy(catalog: Path, to: Path) -> Path:
    shutil.rmtree(to, ignore_errors=True)
    return linked_copy(catalog, to)


def _state(catalog: Path) -> State:
    found = {}
    for path in catalog.glob("tables/*/*.parquet"):
        seen = path.stat()
        if path.parent.name not in RECORDS:
            found[str(path.relative_to(catalog))] = (seen.st_ino, seen.st_mtime_ns)
    return found


def _tail(log: Path) -> str:
    return log.read_text(errors="replace")[-1500:]
