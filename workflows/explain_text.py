"""Why two clips are together or apart, in a terminal: who, how far, by which joints, where, at what pace."""

from __future__ import annotations

from itertools import groupby

from rich.console import Console, Group, RenderableType

from motionary.catalog.explanation import CurvePoint, ExplainedClip, Explanation, Span, Zone
from motionary.catalog.warp_pieces import PairWarp, WarpPiece
from motionary.workflows.summary import counted
from motionary.workflows.tables import text_table

_BAR = 30  # characters of the longest
_MOST_PARTS = 10
_MOST_ZONES = 5  # of a threshold; the rest are summed up
_SAME_PACE, _WAITS = 1.1, 4.0  # times as fast


def print_explanation(explanation: Explanation, console: Console) -> None:
    """Print what the distances of two clips are made of."""
    mark = "#" if console.options.ascii_only else "█"
    tables: list[RenderableType] = [_clips(explanation), _distances(explanation), _curve(explanation)]
    if any(explanation.distances.values()):
        tables += _contributions(explanation, mark)
    else:
        tables.append("The two show the same frames: nothing sets them apart.")
    tables += [_zones(explanation), _warp(explanation.warp)]
    console.print(Group(*(one for table in tables for one in (table, ""))))


def _clips(explanation: Explanation) -> RenderableType:
    rows = [
        [letter, clip.name, f"{clip.seconds:.2f}", str(len(clip.first_frame)), _cluster(clip)]
        for letter, clip in (("a", explanation.a), ("b", explanation.b))
    ]
    return text_table(["", "clip", "seconds", "frames compared", "cluster"], rows)


def _cluster(clip: ExplainedClip) -> str:
    if clip.cluster_id is None:
        return "none: not in the catalog"
    return f"{clip.cluster_id} ({clip.label or 'unnamed'})"


def _distances(explanation: Explanation) -> RenderableType:
    found = explanation.distances
    names = ["dtw", "b_dtw", "weighted", "fuzzy"]
    values = [f"{found[name]:.4f}" for name in names[:-1]]
    values.append(f"{found['fuzzy_low']:.4f} to {found['fuzzy_high']:.4f}")
    return text_table(names, [values], "Distances")


def _contributions(explanation: Explanation, mark: str) -> list[RenderableType]:
    """Tables of the parts of the metric; of both ends, where it is fuzzy."""
    if explanation.metric != "fuzzy":
        return [_bars(explanation, explanation.metric, mark)]
    return [_bars(explanation, end, mark) for end in ("fuzzy_low", "fuzzy_high")]


def _bars(explanation: Explanation, distance: str, mark: str) -> RenderableType:
    total = explanation.distances[distance]
    parts = explanation.parts(distance)
    rows = [
        [*_added(one.name, one.adds, total), mark * round(_BAR * one.of_most)] for one in parts[:_MOST_PARTS]
    ]
    others = [one.adds for one in parts[_MOST_PARTS:]]
    rows.append([*_added(f"{len(others)} others", sum(others), total), ""])
    title = f"What makes the distance: {distance} {total:.4f}"
    return text_table(["joint", "adds", "share, %", ""], rows, title)


def _added(name: str, value: float, total: float) -> list[str]:
    return [name, f"{value:.4f}", f"{100 * value / total:.1f}" if total else ""]


def _curve(explanation: Explanation) -> RenderableType:
    lambdas = [f"{point.threshold:.2f}" for point in explanation.curve]
    rows = [
        ["S-DTW", *(f"{point.distance:.4f}" for point in explanation.curve)],
        ["weight", *(f"{point.weight:.4f}" for point in explanation.curve)],
    ]
    return text_table(["lambda", *lambdas], rows, "DTW-Curve")


def _zones(explanation: Explanation) -> RenderableType:
    """List the chosen zones; thresholds in a row that keep the same zones stand together."""
    alike = groupby(explanation.curve, key=lambda point: (point.zones, point.distance))
    rows = [row for _, points in alike for row in _rows_of(list(points))]
    columns = ["lambda", "segments", "zones", "chosen", "a, s", "b, s", "distance", "way"]
    return text_table(columns, rows, "Similar zones, and those chosen to cover all segments of both clips")


def _rows_of(points: list[CurvePoint]) -> list[list[str]]:
    """One row a chosen zone, the costliest first; what all zones share stands in the first."""
    one, ends = points[0], [f"{point.threshold:.2f}" for point in (points[0], points[-1])]
    chosen = sorted((zone for zone in one.zones if zone.chosen), key=lambda zone: -zone.distance)
    shared = [
        " to ".join(dict.fromkeys(ends)),
        f"{len(one.segments_a)} + {len(one.segments_b)}",
        str(len(one.zones)),
        str(len(chosen)),
    ]
    rows = [_zone_cells(zone) for zone in chosen[:_MOST_ZONES]]
    if left := chosen[_MOST_ZONES:]:
        rows.append([f"and {len(left)} more", "", f"{sum(zone.distance for zone in left):.4f}", ""])
    return [[*(shared if not index else [""] * len(shared)), *row] for index, row in enumerate(rows)]


def _zone_cells(zone: Zone) -> list[str]:
    return [
        _seconds(zone.a),
        _seconds(zone.b),
        f"{zone.distance:.4f}",
        "backward" if zone.backward else "forward",
    ]


def _seconds(span: Span) -> str:
    return f"{span.start_seconds:.2f} - {span.end_seconds:.2f}"


def _warp(warp: PairWarp) -> RenderableType:
    rows = [
        [
            f"{piece.start_a:.2f} - {piece.end_a:.2f}",
            f"{piece.start_b:.2f} - {piece.end_b:.2f}",
            pace(piece),
        ]
        for piece in warp.pieces
    ]
    title = (
        f"Warp: all of b, played {'backward' if warp.backward else 'forward'}, on all of a; "
        f"mean cost {warp.distance:.4f}, in {counted(len(rows), 'piece')}"
    )
    return text_table(["a, s", "b, s", "pace"], rows, title)


def pace(piece: WarpPiece) -> str:
    """Say which of two clips is faster in a piece of their warp, or which waits for the other."""
    of_a, of_b = piece.end_a - piece.start_a, abs(piece.end_b - piece.start_b)
    (longer, slow), (shorter, fast) = sorted([(of_a, "a"), (of_b, "b")], reverse=True)
    if longer <= _SAME_PACE * shorter:
        return "at one pace"
    if longer > _WAITS * shorter:
        return f"{slow} waits: it takes {longer:.2f} s where {fast} takes {shorter:.2f} s"
    return f"{fast} is {longer / shorter:.1f} times as fast"
