"""The review, one clip at a time: the clip beside its cluster's reference, why it is listed, what to call it.

`/review` shows the first clip that nobody has decided about, `/review?clip=` any clip, listed or not.
Accepting sets the proposed name as what a person says: what the list suggests, and where that is nothing, or
the clip is listed as a copy only, its name as it is. Keeping sets its name as it is.
"""

from __future__ import annotations

from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from motionary.catalog.review import REASONS, left_open
from motionary.catalog.web.opened import Shown
from motionary.catalog.web.render import link, render, shown_to

_MOST_KNOWN = 2000


def review_page(request: Request) -> Response:
    """Answer /review."""
    shown, state = shown_to(request), request.app.state
    listed = state.review_queue.listed(shown.catalog, again="again" in request.query_params)
    wanted = request.query_params.get("clip")
    if listed is None and wanted is None:
        return render(request, "review_wait.html")
    rows = {row["clip_id"]: row for row in (listed.rows if listed else ())}
    names = shown.keep("answer", ("review", *rows), lambda: _names(shown, [*rows]))
    there = [clip_id for clip_id in rows if clip_id in names]  # a run may have dropped some
    clip_id = wanted or next((one for one in there if not names[one]["decided"]), next(iter(there), None))
    now = None if clip_id is None else names.get(clip_id) or _names(shown, [clip_id]).get(clip_id)
    if clip_id is not None and now is None:
        raise HTTPException(404, f"there is no clip {clip_id!r}")
    return render(
        request,
        "review.html",
        clip_id=clip_id,
        item=None if now is None else _item(rows.get(clip_id or ""), now),
        known=shown.keep("answer", "known labels", lambda: _known(shown)),
        last=state.desk and state.desk.last,
        outdated=listed is not None and listed.snapshot != shown.catalog.snapshot.snapshot_id,
        less=shown.keep("answer", "left open", lambda: left_open(shown.catalog)),
        total=len(there),
        decided=sum(names[one]["decided"] for one in there),
        **_neighbours(there, names, clip_id),
    )


review_routes = [Route("/review", review_page)]


def _item(row: dict[str, Any] | None, now: dict[str, Any]) -> dict[str, Any]:
    """Put together what is shown of a clip: the list's row, where it is listed, and what it is called now."""
    row = row or {"reason": None, "suggested": None, "other": None, "urgency": None, "distance": None}
    other_name = row["suggested"] if row["reason"] != "duplicate" else None
    beside = now["reference"] if not now["is_reference"] else row["other"]
    return {
        **row,
        **now,
        "why": REASONS.get(row["reason"] or "", ""),
        "proposed": other_name or now["label"],
        "beside": beside,
        "scene": link("/data/scene", clip=[one for one in (beside, now["clip_id"]) if one]),
    }


def _neighbours(there: list[str], names: dict[str, Any], clip_id: str | None) -> dict[str, Any]:
    """Find the clips before and after one in the list, and the next that nobody has decided about."""
    place = there.index(clip_id) if clip_id in names and clip_id in there else None
    if place is None:
        ways: dict[str, Any] = {"previous": None, "after": there[0] if there else None, "place": None}
        onward = there
    else:
        ways = {
            "previous": there[place - 1] if place else None,
            "after": there[place + 1] if place + 1 < len(there) else None,
            "place": place + 1,
        }
        onward = there[place + 1 :] + there[:place]
    waiting = [one for one in onward if not names[one]["decided"]]
    return {**ways, "waiting": waiting[0] if waiting else None}


def _names(shown: Shown, clip_ids: list[str]) -> dict[str, dict[str, Any]]:
    """Look up what clips are called now, and the references of their clusters."""
    found = shown.catalog.sql(
        "select c.clip_id, c.cluster_id, c.label, c.label_source, c.confidence, c.is_reference, "
        "c.label_source = 'override' as decided, r.clip_id as reference, r.label as cluster_name "
        'from clusters c join "references" r using (cluster_id) where list_contains(?, c.clip_id)',
        [clip_ids],
    )
    return {row["clip_id"]: row for row in found.to_pylist()}


def _known(shown: Shown) -> list[str]:
    """List the labels that are there, the most frequent first."""
    found = shown.catalog.sql(
        "select label from clusters where label is not null group by label "
        "order by count(*) desc, label limit ?",
        [_MOST_KNOWN],
    )
    return found["label"].to_pylist()
