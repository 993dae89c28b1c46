"""`python -m tests.torture readers`: processes that query without pause while runs publish and vacuum.

Each reader opens the catalog, asks how many clips, clusters, pairs and frames there are, by SQL and by
Arrow, and holds the answers against each other: of one snapshot they agree, whatever is published meanwhile.
Now and then one keeps its catalog open over many publications and vacuums, and must get the same answers at
the end. The library changes by one clip before each run; each vacuum keeps one snapshot, without grace, so
that only a reader's lease protects what it reads.
"""

from __future__ import annotations

import os
import pickle
import shutil
import time
import traceback
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from motionary.catalog import Catalog
from motionary.catalog.store import Store
from motionary.catalog.vacuum import vacuum
from motionary.catalog.writer_lock import the_only_writer
from tests.torture import forked
from tests.torture.world import add_clip, embedded_library, run_arguments, spread, take_clips

CLIPS = 8
HELD_EVERY, HELD_SECONDS = 6, 4.0
"""Every so many queries a reader keeps its catalog open for so long."""
QUESTIONS = {
    "clips": "select count(*) from clips",
    "clusters": "select count(*) from clusters",
    "aligned": "select count(*) from alignments",
    "pairs": "select count(*) from pairs",
    "named": "select count(*) from clusters join clips using (clip_id)",
    "compared": "select count(*) from (select clip_a from pairs union select clip_b from pairs)",
    "in_frames": "select count(distinct clip_id) from frames",
    "in_the_last_run": "select clips from runs order by run_id desc limit 1",
}


@dataclass
class Reading:
    """What readers saw."""

    queries: int = 0
    held: int = 0
    snapshots: set[str] = field(default_factory=set)
    errors: list[str] = field(default_factory=list)


@dataclass
class Writing:
    """What the writer did meanwhile, and what readers saw."""

    runs: int = 0
    vacuums: int = 0
    snapshots_removed: int = 0
    snapshots_held: int = 0
    reading: Reading = field(default_factory=Reading)
    faults: list[str] = field(default_factory=list)


def readers_under_writing(work: Path, readers: int, runs: int) -> Writing:
    """Start the readers, run and vacuum, stop the readers."""
    forked.warm_up(work)
    embedded, library, catalog = embedded_library(work / "embedded"), work / "library", work / "catalog"
    for folder in (library, catalog):
        shutil.rmtree(folder, ignore_errors=True)
    names = take_clips(embedded, library, CLIPS)
    arguments, log, stop = run_arguments(library, catalog), work / "log.txt", work / "stop"
    stop.unlink(missing_ok=True)
    found = Writing()
    if not _run(arguments, log, found):
        return found
    children = [_start_reader(number, catalog, stop, work) for number in range(readers)]
    try:
        for number in range(runs):
            if number % 2:
                (library / names[number // 2 % CLIPS]).unlink(missing_ok=True)
            else:
                add_clip(embedded, library, spread(embedded)[CLIPS + number])
            found.runs += _run(arguments, log, found)
            _vacuum(catalog, found)
    finally:
        stop.touch()
        for number, child in enumerate(children):
            _collect(number, child, work, found)
    return found


def print_readers(found: Writing) -> None:
    """Print the counts."""
    print(f"runs published                  {found.runs}")
    print(f"vacuums                         {found.vacuums}")
    print(f"  snapshots removed             {found.snapshots_removed}")
    print(f"  times one was held by readers {found.snapshots_held}")
    print(f"queries answered                {found.reading.queries}")
    print(f"  of catalogs kept open         {found.reading.held}")
    print(f"different snapshots seen        {len(found.reading.snapshots)}")
    print(f"errors of readers               {len(found.reading.errors)}")
    print(f"faults of the writer            {len(found.faults)}")
    for fault in [*found.reading.errors, *found.faults][:20]:
        print(f"\nFAULT readers {fault}")


def _run(arguments: list[str], log: Path, found: Writing) -> bool:
    code = forked.wait(forked.start(arguments, log))
    if code != 0:
        found.faults.append(f"a run ended with {code}: {log.read_text(errors='replace')[-1500:]}")
    return code == 0


def _vacuum(catalog: Path, found: Writing) -> None:
    try:
        removed, held = forked.call(partial(_vacuum_here, catalog))
    except RuntimeError as error:
        found.faults.append(f"vacuum: {error}")
        return
    found.vacuums += 1
    found.snapshots_removed += removed
    found.snapshots_held += held


def _vacuum_here(catalog: Path) -> tuple[int, int]:
    store = Store(str(catalog))
    with the_only_writer(store, lambda dead: None):
        done = vacuum(store, keep=1, grace_hours=0)
    return len(done.snapshots), len(done.held)


def _start_reader(number: int, catalog: Path, stop: Path, work: Path) -> int:
    child = os.fork()
    if child == 0:
        reading = Reading()
        try:
            _read(catalog, stop, number, reading)
        except BaseException:
            reading.errors.append(traceback.format_exc(limit=-4))
        finally:
            (work / f"reader{number}").write_bytes(pickle.dumps(reading))
            os._exit(0)
    return child


def _read(catalog: Path, stop: Path, number: int, reading: Reading) -> None:
    turn = number
    while not stop.exists():
        turn += 1
        try:
            with Catalog.open(str(catalog)) as opened:
                answers = _ask(opened, reading)
                if turn % HELD_EVERY == 0:
                    time.sleep(HELD_SECONDS)
                    if _ask(opened, reading) != answers:
                        reading.errors.append(f"a catalog kept open answers otherwise than before: {answers}")
                    reading.held += len(QUESTIONS)
        except Exception:
            reading.errors.append(traceback.format_exc(limit=-4))


def _ask(opened: Catalog, reading: Reading) -> dict[str, int]:
    answers = {name: opened.sql(question).column(0)[0].as_py() for name, question in QUESTIONS.items()}
    reading.queries += len(QUESTIONS)
    reading.snapshots.add(opened.snapshot.snapshot_id)
    clips = answers["clips"]
    table = opened.clips.to_arrow()
    expected = {name: clips * (clips - 1) // 2 if name == "pairs" else clips for name in QUESTIONS}
    if answers != expected or len(table) != clips:
        reading.errors.append(
            f"snapshot {opened.snapshot.snapshot_id} disagrees with itself: {answers}, {len(table)} clips"
        )
    return answers


def _collect(number: int, child: int, work: Path, found: Writing) -> None:
    code = forked.wait(child, 60.0)
    file = work / f"reader{number}"
    if code != 0 or not file.exists():
        found.faults.append(f"reader {number} ended with {code}")
        return
    reading = pickle.loads(file.read_bytes())
    file.unlink()
    found.reading.queries += reading.queries
    found.reading.held += reading.held
    found.reading.snapshots |= reading.snapshots
    found.reading.errors += [f"{number}: {error}" for error in reading.errors]
