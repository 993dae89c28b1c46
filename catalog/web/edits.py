"""Labels that are set from the pages, and taken back: `POST /edit/relabel`, `POST /edit/undo`.

Every change is published at once, as `motionary label` does; on a large catalog that takes seconds. So
changes that come while one publication is under way go together in the next, and each still gets its own
answer and can be taken back on its own.

Taking back restores the row of table `labels` as it was, with who said so and when, or that there was none.
It is refused where the row is no longer the one that the change left: somebody else, or a run, has been
there. What can be taken back is what this server has changed since it was started.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Protocol

import pyarrow as pa
import pyarrow.compute as pc
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import Route

from motionary.catalog.errors import CatalogError, nearest
from motionary.catalog.labels import with_labels
from motionary.catalog.query import Catalog
from motionary.catalog.schema import SCHEMAS

READ_ONLY = "this server is read-only; to change labels, start it with: motionary browse CATALOG --edit"

_MOST_KEPT, _LONGEST_BODY, _LONGEST_LABEL = 10_000, 1 << 16, 300


class Editor(Protocol):
    """Publishes labels; who starts the application gives one, or none where it is read-only."""

    @property
    def user(self) -> str:
        """Who it is that sets them."""

    def publish(self, changed: Callable[[Catalog], pa.Table]) -> None:
        """Publish table `labels` as `changed` makes it of the published catalog; one at a time.

        Raises
        ------
        CatalogError
            Another process writes the catalog, with who; or it cannot be published.
        """


class Refused(Exception):
    """A change that is not made; the message says why."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


class Unpublished(Refused):
    """A change that is not made now, and may be another time."""


@dataclass(frozen=True)
class Relabel:
    """A wish: call a clip so, or forget what was said of it (None)."""

    clip_id: str
    label: str | None


@dataclass(frozen=True)
class Undo:
    """A wish: take the change of this number back."""

    edit: int


@dataclass(frozen=True)
class Edit:
    """A change of one clip, made or to be made.

    Parameters
    ----------
    clip_id : str
    before, after : mapping or None
        The clip's row of table `labels`; None where there is none.
    """

    clip_id: str
    before: Mapping[str, Any] | None
    after: Mapping[str, Any] | None

    def to_dict(self) -> dict[str, str | None]:
        """Say which clip, and the labels before and after."""
        before, after = ((row or {}).get("label") for row in (self.before, self.after))
        return {"clip": self.clip_id, "before": before, "label": after}


class Desk:
    """Where wishes are brought: one publication at a time, of all that have come since the last."""

    def __init__(self, editor: Editor) -> None:
        self._editor = editor
        self._waiting: list[tuple[Relabel | Undo, asyncio.Future]] = []
        self._at_work: asyncio.Task | None = None
        self._made: dict[int, Edit] = {}
        self._number = 0

    @property
    def last(self) -> dict[str, Any] | None:
        """The latest change that can be taken back, with its number."""
        number = next(reversed(self._made), None)
        return None if number is None else {"edit": number, **self._made[number].to_dict()}

    async def ask(self, wish: Relabel | Undo) -> Edit:
        """Have a wish fulfilled, and wait for that.

        Raises
        ------
        Refused
            It is not.
        """
        answer = asyncio.get_running_loop().create_future()
        self._waiting.append((wish, answer))
        if self._at_work is None or self._at_work.done():
            self._at_work = asyncio.create_task(self._work())
        made = await answer
        if isinstance(made, Refused):
            raise made
        return made

    async def _work(self) -> None:
        while self._waiting:
            taken, self._waiting = self._waiting, []
            wishes = [wish for wish, _ in taken]
            for wish, (_, answer), made in zip(
                wishes, taken, await run_in_threadpool(self._publish, wishes), strict=True
            ):
                self._note(wish, made)
                if not answer.done():  # who asked may be gone
                    answer.set_result(made)

    def _publish(self, wishes: list[Relabel | Undo]) -> list[Edit | Refused]:
        made: list[Edit | Refused] = []

        def changed(current: Catalog) -> pa.Table:
            labels, inputs = current.labels.to_arrow(), current.inputs.to_arrow()
            digests = dict(zip(inputs["clip_id"].to_pylist(), inputs["digest"].to_pylist(), strict=True))
            for wish in wishes:
                try:
                    edit = self._edit(wish, labels, digests)
                except Refused as refusal:
                    made.append(refusal)
                else:
                    made.append(edit)
                    labels = _with_row(labels, edit)
            return labels

        try:
            self._editor.publish(changed)
        except CatalogError as error:
            return [Unpublished(409, f"nothing was changed: {error}")] * len(wishes)
        except Exception as error:  # a disk that is full, a store that is away; whatever it is, it is told
            what = str(error) or type(error).__name__
            return [Unpublished(500, f"the change could not be published: {what}")] * len(wishes)
        return made

    def _edit(self, wish: Relabel | Undo, labels: pa.Table, digests: Mapping[str, str]) -> Edit:
        """Say what a wish changes of these labels."""
        if isinstance(wish, Undo):
            return _taken_back(wish, self._made.get(wish.edit), labels, digests)
        before = _row(labels, wish.clip_id)
        if wish.clip_id not in digests:
            raise Refused(
                404, f"there is no clip {wish.clip_id!r} any more{nearest(wish.clip_id, [*digests])}"
            )
        try:
            changes = {wish.clip_id: wish.label}
            after = with_labels(labels, changes, digests, datetime.now(UTC), self._editor.user)
        except ValueError as error:
            raise Refused(400, str(error)) from None
        return Edit(wish.clip_id, before, _row(after, wish.clip_id))

    def _note(self, wish: Relabel | Undo, made: Edit | Refused) -> None:
        if isinstance(wish, Undo):
            if not isinstance(made, Unpublished):  # one that is refused for good would hide those before it
                self._made.pop(wish.edit, None)
        elif isinstance(made, Edit) and made.before != made.after:
            self._number += 1
            self._made[self._number] = made
            if len(self._made) > _MOST_KEPT:
                del self._made[next(iter(self._made))]


def _taken_back(wish: Undo, edit: Edit | None, labels: pa.Table, digests: Mapping[str, str]) -> Edit:
    if edit is None:
        raise Refused(409, "that change was taken back already, or this server did not make it")
    now = _row(labels, edit.clip_id)
    if _said(now) != _said(edit.after):
        by = f"{now['label']!r} by {now['set_by']}" if now else "no label of a person's"
        raise Refused(409, f"not taken back: {edit.clip_id} was changed by somebody else since; it has {by}")
    # A label goes with the bytes that are there now: a run may have seen to that meanwhile.
    before = edit.before and {**edit.before, "digest": digests.get(edit.clip_id, edit.before["digest"])}
    return Edit(edit.clip_id, now, before)


def _said(row: Mapping[str, Any] | None) -> tuple | None:
    return None if row is None else (row["label"], row["set_at"], row["set_by"])


def _row(labels: pa.Table, clip_id: str) -> dict[str, Any] | None:
    found = labels.filter(pc.equal(labels["clip_id"], clip_id)).to_pylist()
    return found[0] if found else None


def _with_row(labels: pa.Table, edit: Edit) -> pa.Table:
    others = labels.filter(pc.not_equal(labels["clip_id"], edit.clip_id))
    own = pa.Table.from_pylist([edit.after] if edit.after else [], schema=SCHEMAS["labels"])
    return pa.concat_tables([others.cast(own.schema), own]).sort_by("clip_id").combine_chunks()


def desk_of(request: Request) -> Desk | None:
    """Return the application's desk; None where it is read-only."""
    state = request.app.state
    if state.editor is not None and not hasattr(state, "desk"):
        state.desk = Desk(state.editor)
    return getattr(state, "desk", None)


async def _relabel(request: Request) -> JSONResponse:
    """Answer {"clip": clip_id, "label": text or null}."""
    return await _answer(request, _wished_label)


async def _undo(request: Request) -> JSONResponse:
    """Answer {"edit": number}."""
    return await _answer(request, _wished_undo)


async def _answer(request: Request, wished: Callable[[dict[str, Any]], Relabel | Undo]) -> JSONResponse:
    desk = desk_of(request)
    try:
        if desk is None:
            raise Refused(403, READ_ONLY)
        made = await desk.ask(wished(await _json(request)))
    except Refused as refusal:
        last = None if desk is None else desk.last
        return JSONResponse({"error": str(refusal), "undo": last}, refusal.status)
    return JSONResponse({**made.to_dict(), "undo": desk.last})


def _wished_label(given: dict[str, Any]) -> Relabel:
    clip_id, label = given.get("clip"), given.get("label", "")
    if not isinstance(clip_id, str) or not (label is None or isinstance(label, str)):
        raise Refused(400, 'send {"clip": clip_id, "label": text, or null for none}')
    if label is not None and len(label) > _LONGEST_LABEL:
        raise Refused(400, f"the label has {len(label)} characters; give {_LONGEST_LABEL} at most")
    return Relabel(clip_id, label and label.strip())


def _wished_undo(given: dict[str, Any]) -> Undo:
    number = given.get("edit")
    if not isinstance(number, int):
        raise Refused(400, 'send {"edit": the number of the change}')
    return Undo(number)


async def _json(request: Request) -> dict[str, Any]:
    """Read a small JSON object; what a form of another page can send is none."""
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise Refused(415, "send JSON, as application/json")
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > _LONGEST_BODY:
            raise Refused(413, f"more than {_LONGEST_BODY} bytes were sent; that is no change of a label")
    try:
        given = json.loads(body)
    except ValueError:
        given = None
    if not isinstance(given, dict):
        raise Refused(400, "what was sent is no JSON object")
    return given


edit_routes = [
    Route("/edit/relabel", _relabel, methods=["POST"]),
    Route("/edit/undo", _undo, methods=["POST"]),
]
