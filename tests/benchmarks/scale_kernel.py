"""How fast the kernel alone compares clips of a catalog, in a process of its own with one thread.

`python -m tests.benchmarks.scale_kernel CATALOG` is one such process; it prints JSON. As many run at once as
the run had workers, for cores that share memory and clock are each slower than one alone.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import mean, median

from motionary.catalog import Catalog
from motionary.pipeline.distances import pairwise_distances
from tests.benchmarks.machine import one_thread

CLIPS = 400
"""Of the sample; all of a smaller catalog."""
ROUNDS = 3
ROOT = Path(__file__).resolve().parents[2]


def kernel_seconds_a_pair(catalog: Path, processes: int) -> float:
    """Time the kernel on a sample of a catalog's clips, in processes side by side.

    Parameters
    ----------
    catalog : Path
    processes : int
        At once.

    Returns
    -------
    float
        Mean over the processes, for a pair of as many cells as the catalog's pairs have on average.
    """
    command = [sys.executable, "-m", "tests.benchmarks.scale_kernel", str(catalog.resolve())]
    started = [
        subprocess.Popen(command, cwd=ROOT, env=one_thread(os.environ), stdout=subprocess.PIPE, text=True)
        for _ in range(processes)
    ]
    told = [one.communicate()[0] for one in started]
    if any(one.returncode for one in started):
        raise RuntimeError(f"the kernel could not be timed: {' '.join(command)}")
    return mean(json.loads(one)["seconds_a_pair"] for one in told)


def timed_here(catalog: str) -> dict[str, float]:
    """Time all pairs of a sample, in this process."""
    with Catalog.open(catalog) as opened:
        lengths = opened.sql("select count(*) as frames from resampled group by clip_id order by clip_id")
        sample = [rows for _, rows in opened.sample(CLIPS).features(merged=True)]
    pairwise_distances(sample[:8], n_jobs=1)  # compiled, or read from where compiled kernels are kept
    seconds = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        pairwise_distances(sample, n_jobs=1)
        seconds.append(time.perf_counter() - start)
    cells = cells_of_all_pairs([len(rows) for rows in sample])
    frames = lengths["frames"].to_pylist()
    pairs = len(frames) * (len(frames) - 1) / 2
    return {"seconds_a_pair": median(seconds) / cells * cells_of_all_pairs(frames) / pairs}


def cells_of_all_pairs(frames: list[int]) -> float:
    """Add up the cells of the cost matrices of all pairs of clips with so many frames."""
    return (sum(frames) ** 2 - sum(one**2 for one in frames)) / 2


if __name__ == "__main__":
    print(json.dumps(timed_here(sys.argv[1])))
