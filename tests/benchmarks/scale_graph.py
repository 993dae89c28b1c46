"""The graph of a library of any size without the library: how many tasks, and what goes to the scheduler."""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import dataclass

from motionary.catalog.schema import SCHEMAS
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.layout import Earlier, lay_out, side_for
from motionary.pipeline.readers.library import Source
from motionary.pipeline.stage_settings import reading_settings
from motionary.workflows.labels_file import NO_LABELS


@dataclass(frozen=True)
class GraphSize:
    """What the tasks that lead from files to clusters come to.

    Parameters
    ----------
    side : int
        Clips of a tile's side, about.
    tasks : dict of int
        By stage.
    bytes : int
        Of all of them, pickled one by one: what the scheduler is sent.
    """

    side: int
    tasks: dict[str, int]
    bytes: int


def graph_of(clips: int) -> GraphSize:
    """Lay out a library of made-up names and wire its tasks; no file is looked at."""

    def source(number: int) -> Source:
        name = f"library/{number // 500:04}/take_{number:06}.bvh"
        digest = hashlib.blake2b(name.encode(), digest_size=16).hexdigest()
        return Source(name, name, "/shared/library", (f"/shared/library/{name}",), digest, "bvh")

    config, earlier = PipelineConfig(), Earlier()
    side = side_for(clips, earlier)
    layout = lay_out([source(number) for number in range(clips)], reading_settings(config), side, earlier)
    nothing = SCHEMAS["labels"].empty_table()
    graph = LibraryGraph(layout, NO_LABELS.table, nothing, config, earlier, lambda key, tables: False)
    tasks = graph.comparison()
    return GraphSize(side, graph.tasks_by_stage(), sum(len(pickle.dumps(task)) for task in tasks))
