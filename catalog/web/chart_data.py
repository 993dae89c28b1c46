"""Charts as JSON that a page's script draws, each made once a snapshot.

Plotly reads some HTML in its texts; the charts escape what comes from data.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from motionary.catalog.views.charts import CONFIG
from motionary.catalog.views.cluster_map import cluster_map_figure
from motionary.catalog.views.cost_matrix import cost_matrix_figure
from motionary.catalog.views.curve_chart import curve_figure
from motionary.catalog.views.library_map import map_places
from motionary.catalog.views.style_chart import style_figure
from motionary.catalog.views.trajectory_chart import trajectory_figure
from motionary.catalog.views.warp_chart import warp_figure
from motionary.catalog.web.caching import cached_response
from motionary.catalog.web.data import explanation, wanted_clip
from motionary.catalog.web.opened import Shown
from motionary.catalog.web.render import shown_to
from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.distances import THRESHOLDS

if TYPE_CHECKING:
    import plotly.graph_objects as go

MAP = ("map",)
"""What the map is kept under, and the places of its clips."""

# A picture would be made from a blob:, which the content security policy does not let an image come from.
_CONFIG = CONFIG | {"modeBarButtonsToRemove": ["toImage", "select2d", "lasso2d"]}


def send_chart(request: Request) -> Response:
    """Answer /data/chart?name=, with what the chart is of."""
    name = request.query_params.get("name", "")
    if name not in _CHARTS:
        raise HTTPException(404, f"there is no chart {name[:40]!r}; there are {', '.join(_CHARTS)}")
    shown = shown_to(request)
    key, make = _CHARTS[name](request, shown)

    def made() -> bytes:
        return shown.keep("chart", key, lambda: _json(make()))

    return cached_response(request, shown.edition, "application/json", made)


_Chart = tuple[tuple, Callable[[], "go.Figure"]]


def _map(request: Request, shown: Shown) -> _Chart:
    def make() -> go.Figure:
        places = shown.keep("places", MAP, lambda: map_places(shown.catalog))
        return cluster_map_figure(shown.catalog, places)

    return MAP, make


def _style(request: Request, shown: Shown) -> _Chart:
    cluster_id = wanted_cluster(request, "cluster")
    return ("style", cluster_id), lambda: style_figure(shown.catalog, cluster_id)


def _warp(request: Request, shown: Shown) -> _Chart:
    clip_id = wanted_clip(request, "clip")
    return ("warp", clip_id), lambda: warp_figure(shown.catalog, [clip_id])


def _trajectory(request: Request, shown: Shown) -> _Chart:
    clip_id, joint = wanted_clip(request, "clip"), request.query_params.get("joint", "")
    if joint not in CANONICAL_JOINTS:
        raise HTTPException(
            400, f"there is no joint {joint[:40]!r}; it is one of {', '.join(CANONICAL_JOINTS)}"
        )
    return ("trajectory", clip_id, joint), lambda: trajectory_figure(shown.catalog, clip_id, joint)


def _curve(request: Request, shown: Shown) -> _Chart:
    a, b = wanted_clip(request, "a"), wanted_clip(request, "b")
    return ("curve", a, b), lambda: curve_figure([explanation(shown, a, b)])


def _costs(request: Request, shown: Shown) -> _Chart:
    a, b = wanted_clip(request, "a"), wanted_clip(request, "b")
    asked = request.query_params.get("threshold", "1")
    known = {f"{one:g}": one for one in THRESHOLDS}
    if asked not in known:
        raise HTTPException(400, f"threshold is {asked[:40]!r}; it is one of {', '.join(known)}")
    key = ("costs", a, b, asked)
    return key, lambda: cost_matrix_figure(shown.catalog, explanation(shown, a, b), known[asked])


def wanted_cluster(request: Request, name: str) -> int:
    """Read a cluster's number from the query."""
    asked = request.query_params.get(name, "")
    known = shown_to(request).keep("answer", "cluster numbers", lambda: _numbers(request))
    number = int(asked) if asked.isascii() and asked.isdigit() and len(asked) < 20 else None
    if number is None or number not in known:
        raise HTTPException(404, f"there is no cluster {asked[:40]!r}; /clusters lists them")
    return number


def _numbers(request: Request) -> frozenset[int]:
    return frozenset(shown_to(request).catalog.references.to_arrow()["cluster_id"].to_pylist())


def _json(figure: go.Figure) -> bytes:
    drawn = json.loads(figure.to_json())
    drawn["config"] = _CONFIG
    return json.dumps(drawn, separators=(",", ":")).encode()


_CHARTS: dict[str, Callable[[Request, Shown], _Chart]] = {
    "map": _map,
    "style": _style,
    "warp": _warp,
    "trajectory": _trajectory,
    "curve": _curve,
    "costs": _costs,
}
