"""Where wishes for labels are brought, and every change so that it can be taken back.

Every change is published at once, as `motionary label` does; on a large catalog that takes seconds. So
changes that come while one publication is under way go together in the next, and each still gets its own
answer and can be taken back on its own.

Taking back restores the row of table `labels` as it was, with who said so and when, or that there was none.
It is refused where the row is no longer the one that the change left: somebody else, or a run, has been
there. What can be taken back is what this server has changed since it was started.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Protocol

import pyarrow as pa
import pyarrow.compute as pc
from starlette.concurrency import run_in_threadpool

from motionary.catalog.errors import CatalogError, nearest
from motionary.catalog.labels import with_labels
from motionary.catalog.query import Catalog
from motionary.catalog.schema import SCHEMAS

_MOST_KEPT = 10_000


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
    """Where wishes are brought: one publication at a time, of all that have come since the last.

    Parameters
    ----------
    editor : Editor
    look : callable
        Called when something was published, before that is answered: what is asked next finds it.

    Attributes
    ----------
    last : dict or None
        The latest change that can be taken back, with its number; other threads may read it at any time.
    """

    def __init__(self, editor: Editor, look: Callable[[], object] = lambda: None) -> None:
        self._editor, self._look = editor, look
        self._waiting: list[tuple[Relabel | Undo, asyncio.Future]] = []
        self._at_work: asyncio.Task | None = None
        self._made: dict[int, Edit] = {}
        self._number = 0
        self.last: dict[str, Any] | None = None

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
            for (wish, answer), made in zip(
                taken, await self._published([wish for wish, _ in taken]), strict=True
            ):
                self._note(wish, made)
                if not answer.done():  # who asked may be gone
                    answer.set_result(made)

    async def _published(self, wishes: list[Relabel | Undo]) -> list[Edit | Refused]:
        """Publish what is wished; whatever happens, there is an answer to every wish."""
        try:
            return await run_in_threadpool(self._publish, wishes)
        except CatalogError as error:
            refused = Unpublished(409, f"nothing was changed: {error}")
        except (OSError, pa.ArrowException) as error:  # a disk that is full, a store that is away
            what = str(error) or type(error).__name__
            refused = Unpublished(500, f"the change could not be published: {what}")
        except Exception as error:
            logging.getLogger(__name__).exception("a change of labels failed")
            what = f"motionary failed: {type(error).__name__}; the terminal it was started in tells more"
            refused = Unpublished(500, what)
        return [refused] * len(wishes)

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

        self._editor.publish(changed)
        with suppress(CatalogError, OSError):  # it is published; the next who asks looks again, and is told
            self._look()
        return made

    def _edit(self, wish: Relabel | Undo, labels: pa.Table, digests: Mapping[str, str]) -> Edit:
        """Say what a wish changes of these labels."""
        if isinstance(wish, Undo):
            edit = self._made.get(wish.edit)
            if edit and any(
                one > wish.edit and self._made[one].clip_id == edit.clip_id for one in self._made
            ):
                raise Unpublished(409, f"{edit.clip_id} was changed here again since; take that back first")
            return _taken_back(edit, labels, digests)
        if wish.clip_id not in digests:
            raise Refused(
                404, f"there is no clip {wish.clip_id!r} any more{nearest(wish.clip_id, [*digests])}"
            )
        before = _row(labels, wish.clip_id)
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
        latest = next(reversed(self._made.items()), None)
        self.last = None if latest is None else {"edit": latest[0], **latest[1].to_dict()}


def _taken_back(edit: Edit | None, labels: pa.Table, digests: Mapping[str, str]) -> Edit:
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
