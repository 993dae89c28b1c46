"""The dendrogram whose clusters are published: merges, their heights, the cut, and the threshold strips.

Leaves stand one below the other and mu runs to the right, as it does in the mu-kappa chart. The places of
the merges are worked out here: SciPy's `dendrogram` calls itself for every merge on the way down, and a
chain of a thousand clips is deeper than Python's stack.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import leaves_list

from motionary.catalog.landmarks import approximation
from motionary.catalog.query import Catalog
from motionary.catalog.views.chart_text import full_text, short_text
from motionary.catalog.views.colours import AXIS, CHART, COLOURS, GREY, cluster_colour, cluster_symbol
from motionary.catalog.views.linkages import KeptLinkage, primary_linkage
from motionary.catalog.views.threshold_band import band_trace, strip_bars

if TYPE_CHECKING:
    import plotly.graph_objects as go

MOST_LEAF_NAMES = 150
_NAME_PIXELS = 13
_LEAF_PIXELS = 14
_TALLEST = 1000
_BAND_PIXELS = 26
_MARGIN = {"l": 20, "r": 20, "t": 40, "b": 50}
_STRIPS = "κ of the strip"


@dataclass(frozen=True, eq=False)
class Tree:
    """Where a dendrogram's clips and merges are drawn; the first N nodes are the clips.

    Parameters
    ----------
    children : array (N - 1, 2)
        The nodes that each merge joins.
    height, place : array (2N - 1,)
        Merge key, 0 for a clip; and place among the leaves, 0 to N - 1.
    cluster_id : array (2N - 1,)
        The cluster that all clips below the node share; 0 where they are of several.
    """

    children: NDArray[np.int64]
    height: NDArray[np.float64]
    place: NDArray[np.float64]
    cluster_id: NDArray[np.int64]


def dendrogram_figure(catalog: Catalog) -> go.Figure | None:
    """Draw the dendrogram of the published clusters, where it is cut, and the threshold strips above it.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.

    Returns
    -------
    plotly Figure or None
        None where there is nothing to draw: fewer than two clips.
    """
    import plotly.graph_objects as go

    kept = primary_linkage(catalog)
    if kept is None or len(kept.Z) == 0:
        return None
    clusters = catalog.clusters.to_arrow().sort_by("clip_id").to_pylist()
    found = approximation(catalog)
    if found is not None:
        clusters = [one for one in clusters if one["clip_id"] in set(found.landmarks)]
    names = {one["cluster_id"]: one["label"] for one in catalog.references.to_arrow().to_pylist()}
    tree = lay_out(kept.Z, np.array([one["cluster_id"] for one in clusters]))

    figure = go.Figure([*_merges(tree), _leaves(tree, clusters), _cluster_names(tree, names)])
    figure.add_trace(band_trace(strip_bars(kept.Z, _last_mu(tree)), _STRIPS, unit=1.0, yaxis="y2"))
    threshold = kept.cut["published_threshold"]
    line = {"color": GREY, "dash": "dash", "width": 1.5}
    figure.add_shape(type="line", x0=threshold, x1=threshold, yref="paper", y0=0, y1=1, line=line)
    figure.add_annotation(
        text=f"cut at μ = {threshold:.4g}: {kept.cut['published_clusters']} clusters",
        x=threshold,
        xanchor="right" if threshold > 0.8 * _last_mu(tree) else "left",
        yref="paper",
        y=1,
        yanchor="bottom",
        showarrow=False,
    )
    _arrange(figure, tree, kept, [one["clip_id"] for one in clusters])
    return figure


def lay_out(Z: NDArray[np.float64], cluster_id: NDArray[np.int64]) -> Tree:
    """Place the clips and merges of a dendrogram.

    Parameters
    ----------
    Z : array (N - 1, 4)
        SciPy linkage matrix.
    cluster_id : array (N,)
        Cluster of every clip, from 1.

    Returns
    -------
    Tree
        A merge stands midway between what it joins.
    """
    clips = len(Z) + 1
    children = Z[:, :2].astype(np.int64)
    place = np.empty(2 * clips - 1)
    place[leaves_list(Z)] = np.arange(clips)
    shared = np.concatenate([cluster_id, np.zeros(clips - 1, np.int64)])
    for node, (left, right) in enumerate(children.tolist(), start=clips):
        place[node] = (place[left] + place[right]) / 2
        shared[node] = shared[left] if shared[left] == shared[right] else 0
    return Tree(children, np.concatenate([np.zeros(clips), Z[:, 2]]), place, shared)


def _merges(tree: Tree) -> list[go.Scatter]:
    """Draw the brackets, one trace a colour."""
    import plotly.graph_objects as go

    clips = len(tree.children) + 1
    left, right = tree.children.T
    top = tree.height[clips:]
    gap = np.full(clips - 1, np.nan)
    x = np.stack([tree.height[left], top, top, tree.height[right], gap], axis=1)
    y = np.stack([tree.place[left], tree.place[left], tree.place[right], tree.place[right], gap], axis=1)
    shared = tree.cluster_id[clips:]
    colour = np.where(shared > 0, (shared - 1) % len(COLOURS), -1)
    return [
        go.Scatter(
            x=x[colour == one].ravel().astype(np.float32),
            y=y[colour == one].ravel().astype(np.float32),
            mode="lines",
            line={"color": COLOURS[one] if one >= 0 else GREY, "width": 1.6},
            hoverinfo="skip",
        )
        for one in np.unique(colour).tolist()
    ]


def _leaves(tree: Tree, clusters: list[dict]) -> go.Scatter:
    import plotly.graph_objects as go

    ids = [one["cluster_id"] for one in clusters]
    return go.Scatter(
        x=np.zeros(len(clusters), np.float32),
        y=tree.place[: len(clusters)].astype(np.float32),
        mode="markers",
        marker={
            "color": [cluster_colour(one) for one in ids],
            "symbol": [cluster_symbol(one) for one in ids],
            "size": 7,
        },
        cliponaxis=False,
        hoverinfo="text",
        hovertext=[
            f"{full_text(one['clip_id'])}<br>"
            f"cluster {one['cluster_id']}, {short_text(one['label'] or 'no label')}"
            for one in clusters
        ],
    )


def _cluster_names(tree: Tree, names: dict[int, str | None]) -> go.Scatter:
    """Write clusters' numbers and names where their last merges end; of those that crowd the largest."""
    import plotly.graph_objects as go

    clips = len(tree.children) + 1
    sizes = Counter(tree.cluster_id[:clips].tolist())
    every = {one: node for node, one in enumerate(tree.cluster_id.tolist()) if one > 0}
    apart = _NAME_PIXELS * clips / (_height(clips) - _BAND_PIXELS - _MARGIN["t"] - _MARGIN["b"])
    tops: dict[int, int] = {}
    for one in sorted(every, key=lambda one: (-sizes[one], one)):
        if all(abs(tree.place[every[one]] - tree.place[node]) >= apart for node in tops.values()):
            tops[one] = every[one]
    nodes = np.array(list(tops.values()), dtype=np.int64)
    return go.Scatter(
        x=tree.height[nodes],
        y=tree.place[nodes],
        mode="text",
        text=[f"  {one} {short_text(names[one] or 'unnamed')}" for one in tops],
        textposition=[
            "top left" if high else "top right" for high in tree.height[nodes] > 0.9 * tree.height[-1]
        ],
        cliponaxis=False,
        hoverinfo="skip",
    )


def _arrange(figure: go.Figure, tree: Tree, kept: KeptLinkage, clip_ids: list[str]) -> None:
    clips = len(clip_ids)
    named = clips <= MOST_LEAF_NAMES
    height = _height(clips)
    pixel = 1 / (height - _MARGIN["t"] - _MARGIN["b"])
    title = f"merge height μ ({kept.cut['method']} linkage, {kept.cut['metric']} distance)"
    figure.update_layout(
        **CHART,
        showlegend=False,
        height=height,
        margin=_MARGIN,
    )
    figure.update_xaxes(**AXIS, title=title, range=[0, _last_mu(tree)], showline=True)
    figure.update_yaxes(
        **{**AXIS, "gridcolor": "rgba(0,0,0,0)"},
        range=[clips - 0.3, -1.2],
        showticklabels=named,
        tickvals=tree.place[:clips] if named else [],
        ticktext=[short_text(one) for one in clip_ids] if named else [],
        tickfont={"size": 10},
        ticklabelstandoff=8,
        automargin=True,
        domain=[0, 1 - (_BAND_PIXELS - 4) * pixel],
    )
    figure.update_layout(
        yaxis2={
            "domain": [1 - (_BAND_PIXELS - 8) * pixel, 1],
            "fixedrange": True,
            "tickfont": {"size": 10},
            "automargin": True,
        }
    )


def _height(clips: int) -> int:
    named = 130 + _LEAF_PIXELS * clips
    return _BAND_PIXELS + (named if clips <= MOST_LEAF_NAMES else min(_TALLEST, 120 + 8 * clips))


def _last_mu(tree: Tree) -> float:
    return float(1.05 * tree.height[-1]) or 1.0
