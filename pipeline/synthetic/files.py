"""The embedded library as files: BVH, the labels, and the ground truth of its warps.

Takes are performed and written one after the other, so a library may have any size. A file that is there
already with equal bytes is left as it is: a run finds it unchanged.
"""

from __future__ import annotations

import csv
import filecmp
import re
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from uuid import uuid4

from motionary.pipeline.motion import FloatArray
from motionary.pipeline.synthetic.actions import ACTIONS
from motionary.pipeline.synthetic.bodies import BODIES
from motionary.pipeline.synthetic.library import CLIPS, least_clips, numbered_take, take_numbers
from motionary.pipeline.synthetic.styles import STYLES
from motionary.pipeline.writers import write_bvh

_WORTH_A_PROCESS = 500
"""Clips that are written while a process starts, and more."""
_AT_ONCE = 20
"""Takes that a process is sent to write."""
_LABELS = ("path", "action", "style", "subject", "take", "description")
_WARPS = ("path", "frame", "template_frame")
_TAKE = re.compile(
    rf"(?P<action>{'|'.join(ACTIONS)})/(\d+/)?(?P=action)_(?P<style>{'|'.join(STYLES)})"
    rf"_({'|'.join(BODIES)})_(?P<take>\d+)\.bvh"
)


def write_library(
    folder: Path | str,
    seed: int = 0,
    clips: int = CLIPS,
    *,
    processes: int = 1,
    written: Callable[[], object] = lambda: None,
) -> None:
    """Write the embedded library as BVH files with its labels and its ground truth.

    Parameters
    ----------
    folder : path
        Made where it does not exist; takes go to ``ACTION/ACTION_STYLE_SUBJECT_TAKE.bvh``, from take 100 on
        to ``ACTION/100/``, ``ACTION/200/`` and so on. Beside them ``labels.csv`` (path, action, style,
        subject, take, description) and ``warps.csv`` (path, frame, template_frame), both once all takes are
        there. A smaller library of the same seed grows.
    seed : int
        As for `synthetic_library`.
    clips : int
        As many, spread evenly over actions and styles; see `take_numbers`.
    processes : int
        That write, at most; fewer where there is little to write. The files are the same.
    written : callable
        Called after every take.

    Raises
    ------
    ValueError
        `clips` is below 1, or the folder holds takes of a larger library.
    """
    root = Path(folder)
    takes = list(take_numbers(clips))
    _refuse_larger(root, clips)
    root.mkdir(parents=True, exist_ok=True)
    with (
        _table(root / "labels.csv", _LABELS) as labels,
        _table(root / "warps.csv", _WARPS) as warps,
        _mapped(min(processes, clips // _WORTH_A_PROCESS)) as mapped,
    ):
        for label, warp in mapped(partial(_write_take, root, seed), takes):
            labels.writerow(label)
            warps.writerows((label[0], frame, f"{time:.6f}") for frame, time in enumerate(warp))
            written()


def _refuse_larger(root: Path, clips: int) -> None:
    """Refuse to leave a larger library's takes among those of this one, without labels."""
    there = (_TAKE.fullmatch(path.relative_to(root).as_posix()) for path in root.rglob("*.bvh"))
    sizes = {
        match.string: size
        for match in there
        if match and (size := least_clips(match["action"], match["style"], int(match["take"]))) > clips
    }
    if sizes:
        raise ValueError(
            f"{root} holds {len(sizes)} takes that a library of {clips} clips has not ({min(sizes)}, ...): "
            f"name another folder, remove this one, or ask for {max(sizes.values())} clips"
        )


def _write_take(root: Path, seed: int, numbers: tuple[str, str, int]) -> tuple[tuple[str, ...], FloatArray]:
    """Perform and write one take; return its row of labels and its warp."""
    take = numbered_take(seed, *numbers)
    path = root / take.path
    path.parent.mkdir(parents=True, exist_ok=True)
    with _unless_equal(path) as new:
        write_bvh(take.motion, new)
    label = (take.path, take.action, take.style, take.subject, f"{take.take:02d}", take.description)
    return label, take.warp


@contextmanager
def _mapped(processes: int) -> Iterator[Callable[..., Iterator[Any]]]:
    """Give a `map`, of this process or of several; what it has not begun is dropped where the block fails."""
    if processes <= 1:
        yield map
        return
    # A process that is told of Ctrl-C would print where it was; this one hears it, and ends them.
    pool = ProcessPoolExecutor(
        processes, get_context("spawn"), initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)
    )
    try:
        yield partial(pool.map, chunksize=_AT_ONCE)
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def _table(path: Path, header: tuple[str, ...]) -> Iterator[Any]:
    """Give a CSV writer; the file appears whole, at the end of the block."""
    with _unless_equal(path) as new, new.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        yield writer


@contextmanager
def _unless_equal(path: Path) -> Iterator[Path]:
    """Give a place to write a file to, which goes under its own name unless its equal is there."""
    new = path.with_name(f".{uuid4().hex}.part")
    try:
        yield new
        if not (path.is_file() and filecmp.cmp(new, path, shallow=False)):
            new.replace(path)
    finally:
        new.unlink(missing_ok=True)
