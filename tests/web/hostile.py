"""A catalog whose clips, labels and folders are called what should never be believed."""

import csv
import shutil
from collections.abc import Callable
from pathlib import Path

from motionary.pipeline.config import PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

SCRIPT = "<script>alert(1)</script>"
NAMES = (
    f"{SCRIPT}.bvh",
    "'\"><img src=x onerror=alert(1)>.bvh",
    f"{'x' * 150}/{'y' * 146}.bvh",
    "\u202eright to left \u05e9\u05dc\u05d5\u05dd.bvh",
    "100% #1?&=+;a\\b.bvh",
    "{{ 7 * 7 }}{% raw %}&amp;.bvh",
)
LABELS = (SCRIPT, "\"'><b onclick=alert(1)>", "\u202e\u05e9\u05dc\u05d5\u05dd", "z" * 300, "plain", "plain")


def hostile_catalog(library: Path, folder: Path, progress: Callable) -> str:
    """Run the main job on six takes of the embedded library, renamed and relabelled; return its URL."""
    takes = sorted(library.glob("walk/*.bvh"))[:3] + sorted(library.glob("jump/*.bvh"))[:3]
    root = folder / "library"
    for take, name in zip(takes, NAMES, strict=True):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(take, root / name)
    (root / f"{SCRIPT}broken.bvh").parent.mkdir(parents=True, exist_ok=True)
    (root / f"{SCRIPT}broken.bvh").write_text("HIERARCHY\nROOT <b>nonsense</b>\n")
    with (root / "labels.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["clip_id", "action", "style", "description"])
        writer.writerows([name, label, label, label] for name, label in zip(NAMES, LABELS, strict=True))
    run(Job([str(root)], str(folder / "catalog"), PipelineConfig(), root / "labels.csv"), progress)
    return str(folder / "catalog")
