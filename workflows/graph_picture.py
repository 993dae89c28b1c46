"""A picture of the task graph: stages as columns, tasks as boxes, and what reads from what."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from html import escape
from pathlib import Path

import pyarrow as pa

from motionary.pipeline.config import DistanceConfig, PipelineConfig
from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.layout import Earlier, lay_out, side_for
from motionary.pipeline.readers.library import Source
from motionary.pipeline.stage_settings import reading_settings
from motionary.pipeline.tables import TABLES
from motionary.pipeline.task import Task
from motionary.workflows.errors import UserError
from motionary.workflows.labels_file import NO_LABELS
from motionary.workflows.preparation import library_sources

_BOX, _GAP, _COLUMN = (150, 26), 10, 250
_MOST_IN_COLUMN = 40
_COLOURS = {
    "ingest": "#0072b2",
    "resample": "#999933",
    "compare": "#d55e00",
    "cluster": "#009e73",
    "identify": "#666666",
    "represent": "#cc79a7",
    "align": "#56b4e9",
    "style": "#e69f00",
    "name": "#333333",
}


def draw_graph(out: Path, library: Path | None) -> None:
    """Write the graph of a library as a picture or as text.

    Parameters
    ----------
    out : Path
        Ending in .svg or .txt.
    library : Path, optional
        Left out, a library of three clips in batches of one.

    Raises
    ------
    UserError
        Another ending, or no such library.
    """
    if out.suffix not in (".svg", ".txt"):
        raise UserError(f"{out} ends in {out.suffix or 'nothing'!r}; a graph is written as .svg or .txt")
    if library is None:
        sources = [Source(f"clip-{n}.bvh", f"clip-{n}.bvh", "", (), str(n), "bvh") for n in range(3)]
        config = PipelineConfig(distances=DistanceConfig(tile=1))
    else:
        sources, config = library_sources([str(library)]), PipelineConfig()
    tasks = _tasks(sources, config)
    out.write_text(_text(tasks) if out.suffix == ".txt" else _svg(tasks), encoding="utf-8")


def _tasks(sources: Sequence[Source], config: PipelineConfig) -> list[Task]:
    """List all tasks, as if every clip could be read and all were one cluster."""
    side = config.distances.tile or side_for(len(sources), Earlier())
    layout = lay_out(sources, reading_settings(config), side, Earlier())
    empty = TABLES["labels"].empty_table()
    graph = LibraryGraph(layout, NO_LABELS.table, empty, config, Earlier(), lambda key, tables: False)
    members = [{"clip_id": clip.clip_id, "cluster_id": 1} for clip in layout]
    references = [
        one | {"is_reference": number == 0, "distance_to_reference": 0.0}
        for number, one in enumerate(members)
    ]
    before = TABLES["represented"].empty_table()
    represented = graph.representation(pa.Table.from_pylist(members, TABLES["members"]), before)
    aligned = graph.alignment(represented, pa.Table.from_pylist(references, TABLES["represented"]), before)
    return [*graph.comparison(), represented, *aligned]


def _text(tasks: Sequence[Task]) -> str:
    names = _names(tasks)
    lines = []
    for task in tasks:
        before = [names[key] for key in task.after]
        lines.append(f"{names[task.key]}" + (f" <- {', '.join(before)}" if before else ""))
    return "\n".join(lines) + "\n"


def _svg(tasks: Sequence[Task]) -> str:
    names, columns = _names(tasks), _by_stage(tasks)
    places, boxes = {}, []
    height = _GAP + (_BOX[1] + _GAP) * (min(_MOST_IN_COLUMN, max(map(len, columns.values()))) + 2)
    for column, (stage, members) in enumerate(columns.items()):
        shown = members[:_MOST_IN_COLUMN]
        left = _GAP + column * _COLUMN
        top = (height - len(shown) * (_BOX[1] + _GAP)) / 2
        title = f"{stage}: {len(members)} task{'s' if len(members) > 1 else ''}"
        boxes.append(f'<text x="{left}" y="20" font-weight="bold">{title}</text>')
        for row, task in enumerate(shown):
            y = top + row * (_BOX[1] + _GAP)
            places[task.key] = (left, y)
            boxes.append(
                f'<rect x="{left}" y="{y}" width="{_BOX[0]}" height="{_BOX[1]}" rx="5" '
                f'fill="{_COLOURS[stage]}"/>'
                f'<text x="{left + 8}" y="{y + 17}" fill="white">{escape(names[task.key])}</text>'
            )
        if len(members) > len(shown):
            y = top + len(shown) * (_BOX[1] + _GAP) + 14
            boxes.append(f'<text x="{left}" y="{y}">and {len(members) - len(shown)} more</text>')
    lines = [
        _line(places[key], places[task.key])
        for task in tasks
        if task.key in places
        for key in task.after
        if key in places
    ]
    width = _GAP * 2 + _COLUMN * (len(columns) - 1) + _BOX[0]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'font-family="sans-serif" font-size="12">\n<rect width="100%" height="100%" fill="white"/>\n'
        + "\n".join([*lines, *boxes])
        + "\n</svg>\n"
    )


def _line(start: tuple[float, float], end: tuple[float, float]) -> str:
    x1, y1, x2, y2 = start[0] + _BOX[0], start[1] + _BOX[1] / 2, end[0], end[1] + _BOX[1] / 2
    bend = (x1 + x2) / 2
    curve = f"M{x1} {y1} C{bend} {y1} {bend} {y2} {x2} {y2}"
    return f'<path d="{curve}" fill="none" stroke="#999" stroke-width=".7"/>'


def _names(tasks: Sequence[Task]) -> dict[str, str]:
    """Call tasks by stage and number: their keys are digests, which say nothing to a reader."""
    return {
        task.key: f"{stage} {number}"
        for stage, members in _by_stage(tasks).items()
        for number, task in enumerate(members, start=1)
    }


def _by_stage(tasks: Sequence[Task]) -> dict[str, list[Task]]:
    columns: dict[str, list[Task]] = defaultdict(list)
    for task in tasks:
        columns[task.stage].append(task)
    return columns
