"""The seven dendrograms of many clips in one process: time, and peak memory with and without mapped files.

From the project's root: `python -m tests.benchmarks.dendrograms`, with `--clips 20000 --prune` for complete
linkage by the near pairs alone. The distances are those of made-up points, worked out as they are read, so
that the pairs need no disk; what is timed is the stage `cluster` with that.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence

import numpy as np
import pyarrow as pa
from rich.console import Console
from rich.table import Table

from motionary.pipeline.compilation import compile_kernels
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.cluster import cluster
from motionary.pipeline.stages.cluster_pruned import cluster_pruned
from motionary.pipeline.tables import TABLES
from tests.benchmarks.process_tree import watched
from tests.benchmarks.tables import WIDTH

CLIPS, KINDS = 20_000, 200
MU = 1.0  # about the width of a kind
ROWS = 50  # of the square, a part: a million pairs of 20,000 clips, as a tile has


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.dendrograms", description=__doc__)
    parser.add_argument("--clips", type=int, default=CLIPS)
    parser.add_argument("--prune", action="store_true", help=f"of the pairs up to {MU} alone")
    options = parser.parse_args(arguments)
    compile_kernels(lambda: print("compiling the kernels", file=sys.stderr))
    with watched(os.getpid()) as watch:
        watch.sample()
        before, start = watch.peak, time.perf_counter()
        dendrograms, pairs = clustered(options.clips, prune=options.prune)
        seconds = time.perf_counter() - start
        peak = watch.peak
    record = {
        "clips": options.clips, "pairs": pairs, "dendrograms": dendrograms, "seconds": seconds,
        "before": before.own, "own": peak.own, "total": peak.total,
    }  # fmt: skip
    print(json.dumps(record), file=sys.stderr)
    _print(record)
    return 0


def clustered(clips: int, *, prune: bool) -> tuple[int, int]:
    """Cluster made-up clips; return how many dendrograms were made, and of how many pairs."""
    ids = pa.array([f"{number:06d}" for number in range(clips)])
    rows = {
        name: ids if name == "clip_id" else pa.nulls(clips, type_)
        for name, type_ in zip(TABLES["ingested"].names, TABLES["ingested"].types, strict=True)
    }
    ingested = pa.table(rows)
    none = pa.table({"clip_id": pa.array([], pa.string()), "label": pa.array([], pa.string())})
    pairs = MadeUpPairs(ids, MU if prune else np.inf)
    parts = Parts(pairs.load, [str(first) for first in range(0, clips, ROWS)])
    if prune:
        config = ClusterConfig(primary="complete", threshold=MU)
        made = cluster_pruned(ingested, parts, none, none, config)
    else:
        made = cluster(ingested, parts, none, none, ClusterConfig())
    return len(made["cuts"]), pairs.most


class MadeUpPairs:
    """Pairs of points around as many centres as there are kinds, and their distances.

    Parameters
    ----------
    ids : array (N,) of text
    most : float
        The greatest distance that is given.
    """

    def __init__(self, ids: pa.Array, most: float) -> None:
        random = np.random.default_rng(0)
        centres = random.normal(size=(KINDS, 4)) * 4
        noise = random.normal(size=(len(ids), 4)) * 0.25
        self._points = (centres[random.integers(0, KINDS, len(ids))] + noise).astype(np.float32)
        self._ids, self._limit = ids, most
        self._counts: dict[str, int] = {}

    @property
    def most(self) -> int:
        """Pairs of all parts."""
        return sum(self._counts.values())

    def load(self, key: str, columns: Sequence[str] | None) -> pa.Table:
        """Work out the pairs of some clips with all later ones."""
        firsts = np.arange(int(key), min(int(key) + ROWS, len(self._ids)))
        seconds = [np.arange(one + 1, len(self._ids), dtype=np.int32) for one in firsts]
        distances = [np.linalg.norm(self._points[one + 1 :] - self._points[one], axis=1) for one in firsts]
        near = [found <= self._limit for found in distances]
        a = np.repeat(firsts.astype(np.int32), [np.count_nonzero(one) for one in near])
        b, values = (np.concatenate([one[kept] for one, kept in zip(of, near, strict=True)])
                     for of in (seconds, distances))  # fmt: skip
        self._counts[key] = len(values)
        names = {"clip_a": a, "clip_b": b}
        scale = {"dtw": 1.0, "b_dtw": 0.97, "weighted": 1.0, "fuzzy_low": 0.9, "fuzzy_high": 1.1}
        return pa.table(
            {
                column: pa.DictionaryArray.from_arrays(names[column], self._ids)
                if column in names
                else values * np.float32(scale[column])
                for column in columns or [*names, *scale]
            }
        )


def _print(record: dict[str, float]) -> None:
    table = Table(title=f"{record['clips']:,} clips, {record['pairs']:,} pairs")
    for name in ("dendrograms", "seconds", "own memory", "with mapped files"):
        table.add_column(name, justify="right")
    own, total = (f"{record[name] / 1e9:.2f} GB" for name in ("own", "total"))
    table.add_row(str(record["dendrograms"]), f"{record['seconds']:.0f}", own, total)
    Console(width=WIDTH).print(table)


if __name__ == "__main__":
    sys.exit(main())
