"""The embedded library as files: BVH, the labels, and the ground truth of its warps."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from motionary.pipeline.synthetic.library import SyntheticTake, synthetic_library
from motionary.pipeline.writers import write_bvh


def write_library(folder: Path | str, seed: int = 0, takes: int = 2) -> list[SyntheticTake]:
    """Write the embedded library as BVH files with its labels and its ground truth.

    Parameters
    ----------
    folder : path
        Made where it does not exist; takes go to ``ACTION/ACTION_STYLE_SUBJECT_TAKE.bvh``. Beside them
        ``labels.csv`` (path, action, style, subject, take, description) and ``warps.csv`` (path, frame,
        template_frame).
    seed, takes : int
        As for `synthetic_library`.

    Returns
    -------
    list of SyntheticTake
        What was written.
    """
    root = Path(folder)
    library = synthetic_library(seed, takes)
    for one in library:
        path = root / one.path
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bvh(one.motion, path)
    _write_csv(
        root / "labels.csv",
        ("path", "action", "style", "subject", "take", "description"),
        ((t.path, t.action, t.style, t.subject, f"{t.take:02d}", t.description) for t in library),
    )
    _write_csv(
        root / "warps.csv",
        ("path", "frame", "template_frame"),
        ((t.path, frame, f"{time:.6f}") for t in library for frame, time in enumerate(t.warp)),
    )
    return library


def _write_csv(path: Path, header: tuple[str, ...], rows: Iterator[tuple[object, ...]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
