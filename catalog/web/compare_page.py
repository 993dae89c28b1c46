"""The page that compares two clips: both in one scene, and why they are as far apart as they are."""

from __future__ import annotations

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from motionary.catalog.explanation import Explanation
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.web.data import explanation, require
from motionary.catalog.web.render import render, shown_to
from motionary.catalog.web.search import clip_rows

_METRICS = {
    "dtw": "average cost along the best warping path",
    "b_dtw": "the same, with one of them forwards or backwards, whichever is the nearer",
    "weighted": "the DTW-Curve, summed up with weights",
    "fuzzy": "from the least to the greatest of the curve",
}


def compare(request: Request) -> Response:
    """Answer /compare?a=&b=; where one is missing or is no clip, the page asks for it."""
    shown = shown_to(request)
    a, b = request.query_params.get("a", ""), request.query_params.get("b", "")
    given = [one for one in (a, b) if one]
    try:
        require(shown, *given)
    except HTTPException as error:
        return _asked_again(request, a, b, error)
    why = explanation(shown, a, b) if len(given) == 2 else None
    return render(
        request,
        "compare.html",
        a=a,
        b=b,
        wrong=None,
        why=why,
        rows=clip_rows(shown.catalog, given),
        distances=_distances(why) if why else [],
        parts=why.parts(why.upper_end) if why else [],
        short=short_text,
    )


def _asked_again(request: Request, a: str, b: str, error: HTTPException) -> Response:
    return render(
        request, "compare.html", status=error.status_code, a=a, b=b, wrong=error.detail, why=None, rows=[]
    )


def _distances(why: Explanation) -> list[tuple[str, str, str, bool]]:
    """List every distance: name, figure, meaning, whether the clusters are made of it."""
    found = why.distances
    values = {name: f"{found[name]:.4f}" for name in _METRICS if name in found}
    values["fuzzy"] = f"{found['fuzzy_low']:.4f} to {found['fuzzy_high']:.4f}"
    return [(name, values[name], meaning, name == why.metric) for name, meaning in _METRICS.items()]
