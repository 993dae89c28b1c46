"""What a run will do: which clips are new, changed, renamed or gone, and what that costs."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import combinations_with_replacement

from motionary.catalog.snapshot import Snapshot
from motionary.catalog.store import Store
from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.task import Task
from motionary.workflows.costs.memory import Need
from motionary.workflows.costs.sizes import needed_text, time_text


@dataclass(frozen=True)
class Plan:
    """What there is to do.

    Parameters
    ----------
    new, changed, renamed, removed, unchanged : int
        Clips, against the published snapshot: of names that were not there, of other bytes under a name, of
        bytes under another name, of names that are gone, and the others.
    to_read : int
        Different contents that have to be read.
    to_compare, to_store : int
        Pairs that have to be computed, and those of them that are kept: by landmarks not all are.
    seconds : float, optional
        About how long that takes, judging by the catalog's last run that computed; None before there is one.
    memory : int
        Bytes that the run's processes hold at most, see `motionary.workflows.costs.memory`.
    memory_allowed : int, optional
        Bytes that they may hold; None where nobody knows.
    """

    new: int
    changed: int
    renamed: int
    removed: int
    unchanged: int
    to_read: int
    to_compare: int
    to_store: int
    seconds: float | None
    memory: int
    memory_allowed: int | None

    def __str__(self) -> str:
        counts = {
            "new": self.new, "changed": self.changed, "renamed": self.renamed, "removed": self.removed,
            "unchanged": self.unchanged,
        }  # fmt: skip
        clips = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
        took = "how long is not known before a first run"
        if self.seconds is not None:
            took = f"about {time_text(self.seconds)} and what starting takes"
        about = "" if self.to_store == self.to_compare else "about "
        todo = f"{self.to_read} to read, {about}{self.to_compare} pairs to compare"
        return f"clips: {clips}; {todo}; {took}; memory: {needed_text(self.memory, self.memory_allowed)}"


def plan_run(graph: LibraryGraph, store: Store, before: Snapshot | None, workers: int, need: Need) -> Plan:
    """See what a run would do.

    Parameters
    ----------
    graph : LibraryGraph
        The library and its results.
    store : Store
        The catalog.
    before : Snapshot, optional
        The published one.
    workers : int
        Among which the work is divided.
    need : Need
        The memory.
    """
    digests, earlier = graph.layout.digests, graph.earlier.digests
    names = graph.names
    renamed = sum(one not in earlier for one in names)
    changed = sum(one in earlier and earlier[one] != digest for one, digest in digests.items())
    to_read, to_store = _contents_to_read(graph), _pairs_to_store(graph)
    to_compare = to_store + graph.later_pairs()
    new = len(digests) - len(names)
    removed = len(earlier) - len(names)
    alike = graph.earlier.settings.get("cluster") == graph.settings["cluster"]
    touched = new + changed + removed if alike else len(digests)
    return Plan(
        new=new, changed=changed, renamed=renamed, removed=removed,
        unchanged=len(names) - renamed - changed,
        to_read=to_read, to_compare=to_compare, to_store=to_store,
        seconds=_seconds(store, before, touched, to_read, to_compare, workers),
        memory=need.bytes, memory_allowed=need.allowed,
    )  # fmt: skip


def _contents_to_read(graph: LibraryGraph) -> int:
    """Count the different contents that no stored result holds."""
    missing = [
        {clip.key for clip in batch}.difference(
            graph.layout.keys[one] for _, names in task.carries or () for one in names
        )
        for task, batch in zip(graph.ingested, graph.layout.batches, strict=True)
        if not graph.is_stored(task.key, task.makes)
    ]
    return sum(map(len, missing))


def _pairs_to_store(graph: LibraryGraph) -> int:
    """Count the pairs of tiles that no stored result holds, were every clip to be read."""
    tiles = combinations_with_replacement(graph.compared_sides, 2)
    count = 0
    for task, (first, second) in zip(graph.compared, tiles, strict=True):
        if not graph.is_stored(task.key, task.makes):
            pairs = len(first) * (len(first) - 1) // 2 if first is second else len(first) * len(second)
            count += pairs - _carried_count(task, within=first is second)
    return count


def _carried_count(task: Task, *, within: bool) -> int:
    """Count the pairs that blocks hold, none of a clip with itself; within one batch all are there twice."""
    count = 0
    for _, block in task.carries or ():
        one, other = Counter(block.first.values()), Counter(block.second.values())
        count += one.total() * other.total() - sum(one[there] * other[there] for there in one)
    return count // 2 if within else count


def _seconds(
    store: Store, before: Snapshot | None, touched: int, to_read: int, to_compare: int, workers: int
) -> float | None:
    """Scale the seconds of work that the last run took which read and compared clips."""
    runs = store.read(before.tables["runs"]).to_pylist() if before else []
    measured = [run for run in runs if run.get("clips_read") and run["pairs_computed"]]
    if not measured:
        return None
    last, work = measured[-1], dict(measured[-1]["stage_seconds"])
    compared = sum(work.get(stage, 0.0) for stage in ("compare", "assign", "refine"))
    clusters = max(last["clusters"], 1)
    # A clip that comes or goes has the others of its cluster aligned anew, as far as their reference changes.
    affected = min(touched * last["clips"] / clusters, last["clips"]) / max(last["clips"], 1)
    total = work["ingest"] * to_read / last["clips_read"] + compared * to_compare / last["pairs_computed"]
    if touched or to_compare:
        total += work["cluster"] + (work["represent"] + work["align"] + work["style"]) * affected
    return total / workers
