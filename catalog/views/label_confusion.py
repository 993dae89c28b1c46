"""Labels against clusters: which labels share a cluster, and which are spread over several.

Only a clip's own label counts, from a person or supplied: a name that came from the cluster says nothing of
how well labels and clusters agree. Rows are labels, columns clusters with their names; columns stand in the
order of the label that most of their clips have, so that agreement lies along the diagonal. A cell's shade is
the share of the label's clips; the text is the count, for shades alone are hard to compare.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motionary.catalog.query import Catalog
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART
from motionary.pipeline.clustering import OWN_LABEL_SOURCES

if TYPE_CHECKING:
    import plotly.graph_objects as go

MOST_ROWS, MOST_COLUMNS = 40, 50
_SHADES = [[0.0, "rgba(128,128,128,0.06)"], [1e-9, "rgba(0,114,178,0.12)"], [1.0, "rgba(0,114,178,0.60)"]]
_WITH_SHARES = 14  # columns at most: more leave no room for the share under the count

_COUNTS = """
select c.label, c.cluster_id, r.label as name, count(*) as clips
from clusters c join "references" r using (cluster_id)
where list_contains($own, c.label_source) group by all
"""


@dataclass(frozen=True, eq=False)
class LabelCounts:
    """How many clips with a label of their own lie in each cluster.

    Parameters
    ----------
    labels : list of str
        The rows as they are shown, the most frequent first; beyond `MOST_ROWS` they share the last.
    clusters : list of str
        The columns as they are shown; beyond `MOST_COLUMNS` the smallest share the last.
    counts : array (rows, columns) of int
    """

    labels: list[str]
    clusters: list[str]
    counts: NDArray[np.int64]


def confusion_figure(catalog: Catalog) -> go.Figure | None:
    """Draw how the clips' own labels and the clusters agree.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.

    Returns
    -------
    plotly Figure or None
        None where no clip has a label of its own.
    """
    import plotly.graph_objects as go

    table = label_counts(catalog)
    if table is None:
        return None
    shares = table.counts / table.counts.sum(axis=1, keepdims=True)
    figure = go.Figure(
        go.Heatmap(
            z=shares,
            x=list(range(len(table.clusters))),
            y=list(range(len(table.labels))),
            zmin=0,
            zmax=1,
            colorscale=_SHADES,
            showscale=False,
            xgap=1,
            ygap=1,
            text=_texts(table.counts, shares),
            texttemplate="%{text}",
            hoverinfo="text",
            hovertext=_hovers(table, shares),
        )
    )
    _arrange(figure, table)
    return figure


def label_counts(catalog: Catalog) -> LabelCounts | None:
    """Count the clips with a label of their own by label and cluster; None where there are none."""
    found = catalog.sql(_COUNTS, {"own": list(OWN_LABEL_SOURCES)}).to_pylist()
    if not found:
        return None
    names = {row["cluster_id"]: row["name"] for row in found}
    of_label: Counter[str] = Counter()
    of_cluster: Counter[int] = Counter()
    for row in found:
        of_label[row["label"]] += row["clips"]
        of_cluster[row["cluster_id"]] += row["clips"]
    labels = _places(sorted(of_label, key=lambda one: (-of_label[one], one)), MOST_ROWS)
    columns = _places(_diagonal(found, labels, of_cluster), MOST_COLUMNS)
    counts = np.zeros((max(labels.values()) + 1, max(columns.values()) + 1), np.int64)
    for row in found:
        counts[labels[row["label"]], columns[row["cluster_id"]]] += row["clips"]
    shown = {one: f"{one} {short_text(names[one] or 'unnamed', 22)}" for one in columns}
    return LabelCounts(
        _named({one: short_text(one, 28) for one in labels}, labels, "other labels"),
        _named(shown, columns, "other clusters"),
        counts,
    )


def _places(keys: list, most: int) -> dict:
    """Give keys their places; where there are more than `most`, those at the end share the last."""
    last = len(keys) - 1 if len(keys) <= most else most - 1
    return {key: min(place, last) for place, key in enumerate(keys)}


def _diagonal(found: list[dict], labels: dict[str, int], size: Counter[int]) -> list[int]:
    """Order clusters by the label that most of their clips have; the smallest of too many come last."""
    most: dict[int, tuple[int, int]] = {}
    for row in found:
        place = labels[row["label"]]
        most[row["cluster_id"]] = max(most.get(row["cluster_id"], (0, 0)), (row["clips"], -place))
    large = sorted(size, key=lambda one: (-size[one], one))
    shown = large if len(large) <= MOST_COLUMNS else large[: MOST_COLUMNS - 1]
    in_order = sorted(shown, key=lambda one: (-most[one][1], -size[one], one))
    return in_order + large[len(shown) :]


def _named(shown: dict, places: dict, others: str) -> list[str]:
    last = max(places.values())
    together = sum(place == last for place in places.values())
    names = [shown[key] for key, place in places.items() if place < last or together == 1]
    return [*names, f"{together} {others}"] if together > 1 else names


def _texts(counts: NDArray[np.int64], shares: NDArray[np.float64]) -> list[list[str]]:
    roomy = counts.shape[1] <= _WITH_SHARES
    return [
        ["" if not n else f"{n}<br>{share:.0%}" if roomy else str(n) for n, share in zip(*row, strict=True)]
        for row in zip(counts.tolist(), shares.tolist(), strict=True)
    ]


def _hovers(table: LabelCounts, shares: NDArray[np.float64]) -> list[list[str]]:
    return [
        [
            f"{label}: {table.counts[row, column]} of {table.counts[row].sum()} clips"
            f" ({shares[row, column]:.0%})<br>in cluster {cluster}"
            for column, cluster in enumerate(table.clusters)
        ]
        for row, label in enumerate(table.labels)
    ]


def _arrange(figure: go.Figure, table: LabelCounts) -> None:
    rows, columns = table.counts.shape
    names = 5.0 * max(len(one) for one in table.clusters)  # pixels that they take, aslant
    figure.update_layout(
        **CHART,
        height=90 + names + rows * (34 if columns <= _WITH_SHARES else 22),
        margin={"l": 20, "r": 20, "t": 20, "b": 40},
        hovermode="closest",
    )
    plain = {**AXIS, "showgrid": False, "automargin": True}
    figure.update_xaxes(
        **plain,
        title="clusters",
        tickvals=list(range(columns)),
        ticktext=table.clusters,
        tickangle=-45,
        range=[-0.5, columns - 0.5],
    )
    figure.update_yaxes(
        **plain,
        title="own labels",
        tickvals=list(range(rows)),
        ticktext=table.labels,
        range=[rows - 0.5, -0.5],
    )
