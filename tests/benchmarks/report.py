"""The record of a run: plain values, written as JSON and printed as tables (`tables.py`)."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from tests.benchmarks.agreement import Agreement
from tests.benchmarks.clips import ClipSet
from tests.benchmarks.contests import AEON, DTAIDISTANCE, OURS, PEERS, Timing, fastest
from tests.benchmarks.growth import Stage
from tests.benchmarks.limits import Limits
from tests.benchmarks.memory import Peak


@dataclass(frozen=True)
class Results:
    """Everything a run measured.

    Parameters
    ----------
    machine, settings : dict
        Where and how.
    peers : dict, optional
        The peers' versions; None where they took no part.
    library : str
        What was compared.
    sets : dict of ClipSet
        The clips, by kind of features.
    contests : dict of list of Timing
        By kind of features.
    threads : list of Timing
        One thread and two; empty on one core.
    limits : Limits
        Of one core.
    agreements, growth, peaks : lists
        As their modules describe them.
    """

    machine: dict[str, object]
    settings: dict[str, object]
    peers: dict[str, str] | None
    library: str
    sets: dict[str, ClipSet]
    contests: dict[str, list[Timing]]
    threads: list[Timing]
    limits: Limits
    agreements: list[Agreement]
    growth: list[Stage]
    peaks: list[Peak]


def as_record(results: Results) -> dict:
    """Return all results, their medians, ratios and shares, as values that JSON can hold."""
    return {
        "machine": results.machine,
        "settings": results.settings,
        "peers": results.peers,
        "what_peers_compute": PEERS,
        "library": results.library,
        "clips": {kind: clips.described() for kind, clips in results.sets.items()},
        "targets": _targets(results),
        "contests": {
            kind: [_timed(timing, results.sets[kind], timings, results.limits) for timing in timings]
            for kind, timings in results.contests.items()
        },
        "threads": [asdict(timing) | {"seconds": timing.seconds} for timing in results.threads],
        "limits": asdict(results.limits),
        "agreement": [asdict(one) | {"holds": one.holds} for one in results.agreements],
        "growth": [_grown(stage) for stage in results.growth],
        "memory": [asdict(peak) | {"beyond": peak.beyond} for peak in results.peaks],
    }


def _timed(timing: Timing, clips: ClipSet, timings: list[Timing], limits: Limits) -> dict:
    """One contestant: its samples, its median a pair, its ratio to ours, and our share of the limits."""
    row = asdict(timing) | _rates(timing, clips)
    row["ratio_to_ours"] = _ratio(timing, fastest(timings, timing.task, [OURS]))
    if timing.who == OURS:
        directions = 1 if timing.task == "dtw" else 2
        product = limits.product_seconds(clips.cells, clips.dimensions)
        recurrence = limits.recurrence_seconds(clips.cells, directions)
        row["product_share"] = product / timing.seconds
        row["recurrence_share"] = recurrence / timing.seconds
    return row


def _rates(timing: Timing, clips: ClipSet) -> dict[str, float]:
    return {
        "seconds": timing.seconds,
        "microseconds_a_pair": 1e6 * timing.seconds / clips.pairs,
        "nanoseconds_a_cell": 1e9 * timing.seconds / clips.cells,
        "cells_a_second": clips.cells / timing.seconds,
    }


def _grown(stage: Stage) -> dict:
    return {
        "varied": stage.varied,
        "value": stage.value,
        **stage.clips.described(),
        "timings": [asdict(timing) | _rates(timing, stage.clips) for timing in stage.timings],
    }


def _targets(results: Results) -> list[dict]:
    """What the distances must reach, beside what was measured; `measured` is None where it could not be."""
    unmerged, merged = results.contests["unmerged"], results.contests["merged"]
    ours, plain = fastest(unmerged, "dtw", [OURS]), fastest(unmerged, "dtw", DTAIDISTANCE)
    aeon = fastest(unmerged, "dtw", AEON)
    share = _ratio(fastest(unmerged, "curve", [OURS]), plain)
    rows = [
        _target("DTW, unmerged: times faster than dtaidistance", _ratio(plain, ours), 8.0, 12.0),
        _target("DTW, unmerged: times faster than aeon", _ratio(aeon, ours), 14.0, None),
        _target("DTW-Curve, unmerged: share of dtaidistance's plain DTW", share, 0.65, 0.4, at_least=False),
    ]
    curve = fastest(merged, "curve", [OURS])
    each = None if curve is None else 1e6 * curve.seconds / results.sets["merged"].pairs
    rows.append(_target("DTW-Curve, merged: microseconds a pair", each, 15.0, None, at_least=False))
    for task, name in (("dtw", "DTW"), ("curve", "DTW-Curve")):
        one, two = (fastest(results.threads, task, [who]) for who in ("1 thread", "2 threads"))
        rows.append(_target(f"{name}, unmerged: two threads against one", _ratio(one, two), 1.6, None))
    return rows


def _target(
    what: str, measured: float | None, required: float, goal: float | None, at_least: bool = True
) -> dict:
    met = None if measured is None else (measured >= required if at_least else measured <= required)
    return {
        "what": what,
        "measured": measured,
        "required": required,
        "goal": goal,
        "at_least": at_least,
        "met": met,
    }


def _ratio(one: Timing | None, other: Timing | None) -> float | None:
    return None if one is None or other is None else one.seconds / other.seconds
