"""A file that the catalog does not hold, dropped on a page: what it looks like, and what it is like.

The file is never written into the catalog. It goes to a temporary folder, under a name made here, and that
goes when the answer is made, also where it cannot be. What a file may cost is bounded: its bytes, its time on
the way, the seconds of its motion, the number of files looked at together (one, while a few wait), and what
an archive may unpack to (`motionary.pipeline.readers.arrays`).

`POST /drop` takes the files' bytes one after another as its body, and their names and sizes in the header
`X-Motionary-Files` as JSON, percent-encoded: `[{"name": "take.amc", "size": 51}, {"name": "take.asf", "size":
7}]`. It answers with a part of a page.
"""

from __future__ import annotations

import asyncio
import json
import re
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any
from urllib.parse import unquote

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import Route

from motionary.catalog.errors import NoClips
from motionary.catalog.example import example_from_motion
from motionary.catalog.given_files import Given
from motionary.catalog.query import Catalog
from motionary.catalog.views.figures import figure_of, scene
from motionary.catalog.web.data import figure
from motionary.catalog.web.opened import Shown
from motionary.catalog.web.render import render, shown_to
from motionary.catalog.web.search import near_rows
from motionary.pipeline.canonical import SkeletonError
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import FORMATS, ReadError, read_motion

LARGEST = 32_000_000
"""Bytes of the files of one drop at most."""

LONGEST = 300.0
"""Seconds of a motion at most: a longer one is no clip, and compared with every clip."""

SLOWEST = 120.0
"""Seconds that files may be on their way."""

_MOST_WAITING = 4
_NEIGHBOURS = 8
_PARTS = 8
_LONGEST_NAME = 300
SUFFIXES = tuple(sorted(suffix for suffix in FORMATS if suffix != ".zip"))


class CannotLook(Exception):
    """Files that are not looked at: why, and what to do about it."""

    def __init__(self, status: int, what: str, mend: str) -> None:
        super().__init__(what, mend)
        self.status, self.what, self.mend = status, what, mend


@dataclass(frozen=True)
class Sent:
    """A file as it was named, with its bytes."""

    name: str
    size: int

    @property
    def suffix(self) -> str:
        """With its point, in small letters."""
        return PurePosixPath(self.name).suffix.lower()


def drop_page(request: Request) -> Response:
    """Answer GET /drop."""
    shown_to(request)
    return render(request, "drop.html", suffixes=SUFFIXES, largest=LARGEST, longest=LONGEST)


async def look(request: Request) -> Response:
    """Answer POST /drop."""
    tables: Tables = request.app.state.drop_tables
    try:
        with tables.place(), tempfile.TemporaryDirectory(prefix="motionary-drop-") as folder:
            sent = _sent(request)
            motion, named = _named(sent)
            files = {one: Path(folder, named[one]) for one in sent}
            await _receive(request, files)
            async with tables.turn:
                found = await run_in_threadpool(_looked_at, request, files[motion], motion.name)
    except CannotLook as error:
        return render(request, "dropped.html", status=error.status, error=error)
    return render(request, "dropped.html", error=None, **found)


drop_routes = [Route("/drop", drop_page), Route("/drop", look, methods=["POST"])]


class Tables:
    """How many files are looked at: one at a time, while a few more arrive or wait."""

    def __init__(self) -> None:
        self.turn = asyncio.Lock()
        self._taken = 0

    def place(self) -> Tables:
        """Return what holds a place as long as it is entered; where there is none, refuse."""
        if self._taken >= _MOST_WAITING:
            raise CannotLook(503, f"{self._taken} files are being looked at", "try again in a moment")
        return self

    def __enter__(self) -> None:
        self._taken += 1

    def __exit__(self, *exception: object) -> None:
        self._taken -= 1


def _sent(request: Request) -> list[Sent]:
    """Read what is on its way, and refuse what is too much before it comes."""
    header = request.headers.get("x-motionary-files", "")
    try:
        listed = json.loads(unquote(header, errors="strict"))
        sent = [Sent(_last_part(one["name"]), int(one["size"])) for one in listed]
    except (ValueError, TypeError, KeyError, RecursionError, OverflowError):
        sent = []
    declared = request.headers.get("content-length", "")
    total = sum(one.size for one in sent)
    if not sent or min(one.size for one in sent) < 0 or declared != str(total):
        raise CannotLook(
            400, "names and sizes of the files do not come with them", "drop them on the page /drop"
        )
    if total > LARGEST:
        what = f"{total / 1e6:.1f} MB were given, and {LARGEST / 1e6:.0f} MB are looked at"
        raise CannotLook(413, what, "cut the take, or ask in a terminal: motionary similar CATALOG FILE")
    return sent


def _last_part(name: object) -> str:
    """Return a file's own name, of a path of any system, as text that can be shown."""
    own = PurePosixPath(str(name).replace("\\", "/")).name[-_LONGEST_NAME:]
    return own.encode("utf-8", "replace").decode()


def _named(sent: Sequence[Sent]) -> tuple[Sent, dict[Sent, str]]:
    """Find which file is the motion, and name all for the disk: no part of a given name but plain letters."""
    motions = [one for one in sent if one.suffix in SUFFIXES]
    bodies = [one for one in sent if one.suffix == ".asf"]
    if len(motions) != 1 or len(motions) + len(bodies) != len(sent) or len(bodies) > 1:
        kinds = ", ".join(SUFFIXES)
        if len(sent) == 1:
            what, mend = f"{sent[0].suffix or 'such a file'} is not read here", f"give one of {kinds}"
        else:
            what = f"{len(sent)} files were given, of which {len(motions)} are motions ({kinds})"
            mend = "give one motion, and with an AMC its ASF"
        raise CannotLook(415, what, mend)
    motion = motions[0]
    if (motion.suffix == ".amc") != bool(bodies):
        what = (
            "an AMC came without its ASF" if not bodies else f"an ASF came with a {motion.suffix[1:].upper()}"
        )
        raise CannotLook(415, what, "choose an AMC and its ASF together")
    # The stem of an AMC tells its rate, and an ASF belongs to it whose stem begins it.
    stem = re.sub(r"[^A-Za-z0-9_-]", "_", PurePosixPath(motion.name).stem)[-40:] or "take"
    return motion, {one: stem + one.suffix for one in sent}


async def _receive(request: Request, files: dict[Sent, Path]) -> None:
    """Write what comes to the files, in order, for no longer than it may take."""
    try:
        with ExitStack() as opened:
            rest: list[tuple[IO[bytes], int]]
            rest = [(opened.enter_context(path.open("xb")), one.size) for one, path in files.items()]
            async with asyncio.timeout(SLOWEST):
                async for piece in request.stream():
                    rest = _written(piece, rest)
    except TimeoutError:
        raise CannotLook(408, f"it took longer than {SLOWEST:.0f} s on its way", "try again") from None
    except ClientDisconnect:
        raise CannotLook(400, "it broke off on its way", "try again") from None


def _written(piece: bytes, rest: list[tuple[IO[bytes], int]]) -> list[tuple[IO[bytes], int]]:
    """Write a piece to the files that are not complete; return those that still lack bytes, and how many."""
    while piece and rest:
        (file, left), *others = rest
        file.write(piece[:left])
        rest = [(file, left - len(piece)), *others] if left > len(piece) else others
        piece = piece[left:]
    return rest


def _looked_at(request: Request, path: Path, name: str) -> dict[str, Any]:
    """Read a motion and tell all that is shown of it; in a thread."""
    shown = shown_to(request)
    try:
        motion = _read(shown.catalog, path)
    except ReadError as error:
        line = f"line {error.line}: " if error.line else ""
        raise CannotLook(422, f"{line}{error.what}", error.mend) from None
    drawn = figure_of(motion, name=name)
    found: dict[str, Any] = {"name": name, "motion": motion, "cannot": None, "rows": []}
    try:
        found |= _compared(shown, motion, name)
    except SkeletonError as error:
        found["cannot"] = f"{error.what}; {error.mend}"
    except NoClips as error:
        found["cannot"] = str(error)
    beside = [figure(shown, row["clip_id"]) for row in found["rows"][:1]]
    return found | {"scene": scene([drawn, *beside])}


def _read(catalog: Catalog, path: Path) -> Motion:
    config = catalog.config
    motion = read_motion(path, conventions=config.features.conventions, **asdict(config.read))
    if motion.seconds > LONGEST:
        what = f"it lasts {motion.seconds:.0f} s, and {LONGEST:.0f} s are looked at"
        raise CannotLook(413, what, "cut it into takes")
    return motion


def _compared(shown: Shown, motion: Motion, name: str) -> dict[str, Any]:
    catalog = shown.catalog
    example = example_from_motion(catalog, motion, name)
    near = catalog.similar(example, _NEIGHBOURS)
    rows = near_rows(catalog, near)
    why = catalog.explain(example, rows[0]["clip_id"])
    return {
        "how": near.how,
        "rows": rows,
        "assigned": catalog.assign(Given(motion.name, motion)).to_pylist()[0],
        "why": why,
        "parts_of_it": why.parts(why.upper_end)[:_PARTS],
    }
