"""A file from the web, begun anew or resumed from where it stopped.

pooch decides whether a file is needed, checks its digest, and puts it in its place only when that is right;
what it has no downloader for is resumption. Ours keeps what has come in a file of its own, `NAME.part`, and
asks for the rest with `Range` (RFC 9110, 14.2). A part may be continued only by bytes of the same file:
`If-Range` (13.1.5) has the server send all of it where its entity tag or date is another by now; where a
server has given neither, a published digest must make sure of it, or the part is begun anew. So it is with a
server that knows no ranges, which sends everything.

What a server says is not trusted: of a documented size no more is written than that, and a file of another is
refused; of an undocumented one no more than the disk has room for, less a reserve. A body that the server has
packed though it was asked not to (Content-Encoding, 8.4) is refused too: a small one may unpack to any size.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import pooch
import requests

from motionary.workflows.fetch.meter import Meter
from motionary.workflows.fetch.registry import FetchError, SetFile

TIMEOUT = (10.0, 60.0)
"""Seconds to wait for a connection, and for the next bytes."""

# Seconds between attempts, and how often one that got further is followed by another.
_PAUSE, _ATTEMPTS = 1.0, 10
_CHUNK = 2**14  # what a broken connection can cost
_RESERVE = 2**28  # bytes that a file of undocumented size leaves free on the disk
_BROKEN = (requests.ConnectionError, requests.exceptions.ChunkedEncodingError)
_MISSING, _BEYOND, _PARTIAL = 404, 416, 206  # HTTP


def download(file: SetFile, folder: Path, source: str, meter: Meter) -> Path:
    """Bring a file of a set into a folder, unless it is there.

    Parameters
    ----------
    file : SetFile
        What is wanted.
    folder : Path
        Where it goes, and its part until it is complete.
    source : str
        Page that people get it from, for messages.
    meter : Meter
        Told how far it is.

    Returns
    -------
    Path
        The complete file; its digest is right, where one is published.

    Raises
    ------
    FetchError
        It cannot be had: no network, no such file, refused, of another size or digest, no room. What has come
        of it stays for the next time, unless it is wrong.
    """
    place = folder / file.name
    by_hand = f"or get it in a browser from {source} and put it at {place}, then run this again"
    if file.url is None:
        if not place.exists():
            raise FetchError(f"the address of {file.name} is not documented; {by_hand.removeprefix('or ')}")
        if _has_other_digest(file, place):
            raise FetchError(f"{place} has not the published digest {file.digest}; {by_hand}")
        _refuse_other_size(file, place)
        return place
    if file.digest is None and place.exists():  # pooch would take it as it is
        _refuse_other_size(file, place)
    if place.exists() and _has_other_digest(file, place):
        by_hand += (
            f"; what is there now, {place.stat().st_size:,} bytes, has not the published digest {file.digest}"
        )
    pooch.get_logger().setLevel("WARNING")  # what it would say, the meter shows
    again = f"run this again to go on with it, {by_hand}"
    try:
        pooch.retrieve(file.url, file.digest, file.name, folder, downloader=Resuming(file, folder, meter))
    except requests.HTTPError as error:
        raise FetchError(f"{_refusal(error, file.url)}; {by_hand}") from None
    except requests.Timeout:
        raise FetchError(f"{file.url} does not answer; {again}") from None
    except _BROKEN as error:
        raise FetchError(f"{_unreachable(error, file.url)}; {again}") from None
    except requests.RequestException as error:
        raise FetchError(f"{file.url}: the download stopped ({error}); {again}") from None
    except OSError as error:
        raise FetchError(_no_room(error, place)) from None
    except ValueError as error:  # pooch's, of the digest; it has removed the file
        raise FetchError(
            f"{file.url}: {error} Fetch it again; if it comes out the same, {source} has another"
        ) from None
    return place


@dataclass(frozen=True)
class Resuming:
    """A downloader for pooch that goes on from what came before.

    Parameters
    ----------
    file : SetFile
        What is wanted.
    folder : Path
        Where `NAME.part` lies, and beside it `NAME.part.json`: which address and version it is of.
    meter : Meter
        Told how far it is.
    """

    file: SetFile
    folder: Path
    meter: Meter

    @property
    def part(self) -> Path:
        """What has come so far."""
        return self.folder / f"{self.file.name}.part"

    @property
    def note(self) -> Path:
        """What the part is of."""
        return self.folder / f"{self.file.name}.part.json"

    def __call__(self, url: str, output_file: str, _: Any) -> None:
        """Download to a file, for pooch; as long as it gets further, go on after a broken connection."""
        for attempt in range(_ATTEMPTS):
            before = self._size()
            try:
                self._receive(url)
                break
            except (requests.Timeout, *_BROKEN):
                if self._size() <= before or attempt == _ATTEMPTS - 1:
                    raise
            time.sleep(_PAUSE)
        os.replace(self.part, output_file)  # noqa: PTH105 - pooch gives text
        self.note.unlink(missing_ok=True)

    def _receive(self, url: str) -> None:
        """Ask for what is missing, and write it as it comes."""
        have, validator = self._resumable(url)
        headers = {"Accept-Encoding": "identity"}  # ranges are of the bytes as they are
        if have:
            headers["Range"] = f"bytes={have}-"
            if validator:
                headers["If-Range"] = validator
        with requests.get(url, headers=headers, stream=True, timeout=TIMEOUT) as answer:
            if have and answer.status_code == _BEYOND:
                if answer.headers.get("Content-Range") == f"bytes */{have}":
                    return self._check_size(url, have)
                self.part.unlink()
                return self._receive(url)
            answer.raise_for_status()
            _refuse_packed(answer, url)
            have = have if _continues(answer, have) else 0
            total = _total(answer, have)
            most = self._most()
            if total is not None:
                self._check_size(url, total)
                if total > most:
                    self._refuse_beyond(url, most)
            self.note.write_text(json.dumps({"url": url, "validator": _validator(answer)}))
            self.meter.begin(self.file.name, total or self.file.bytes, have)
            come = have
            with self.part.open("ab" if have else "wb") as part:
                for chunk in answer.iter_content(_CHUNK):
                    come += len(chunk)
                    if come > most:
                        break
                    part.write(chunk)
                    self.meter.advance(len(chunk))
        if come > most:
            self._refuse_beyond(url, most)
        wanted = self.file.bytes or total
        tells_its_end = total is None and answer.headers.get("Transfer-Encoding") == "chunked"
        if wanted is not None and come < wanted and not tells_its_end:
            raise requests.ConnectionError(f"closed after {come:,} of {wanted:,} bytes")
        self._check_size(url, come)

    def _most(self) -> int:
        """Return how many bytes the file may have: the documented size, or what the disk has room for."""
        room = self._size() + shutil.disk_usage(self.folder).free - _RESERVE
        return self.file.bytes or max(room, 0)

    def _refuse_beyond(self, url: str, most: int) -> NoReturn:
        if self.file.bytes is not None:
            self._refuse_size(url, f"more than {most:,}")
        raise FetchError(
            f"no room for {url}: its size is not documented, it is of more than {most:,} bytes, and then "
            f"less than {_RESERVE:,} would be free in {self.folder}; make room and run this again to go on "
            f"with it, or remove {self.part} if it cannot be that large"
        )

    def _check_size(self, url: str, size: int) -> None:
        if self.file.bytes not in (None, size):
            self._refuse_size(url, f"{size:,}")

    def _refuse_size(self, url: str, size: str) -> NoReturn:
        """Refuse a file of another size than is documented, and what came of it."""
        self.part.unlink(missing_ok=True)
        self.note.unlink(missing_ok=True)
        raise FetchError(
            f"{url} is of {size} bytes, but {self.file.bytes:,} are documented: it was changed, "
            "or the server answers with something else; look at it in a browser"
        )

    def _resumable(self, url: str) -> tuple[int, str | None]:
        """Return how much of this very file is there, and what tells that it is of it."""
        try:
            note = json.loads(self.note.read_text())
            if note["url"] == url and (note["validator"] or self.file.digest):
                return self._size(), note["validator"]
        except (OSError, ValueError, TypeError, KeyError):
            pass  # no part, or none that can be trusted
        return 0, None

    def _size(self) -> int:
        return self.part.stat().st_size if self.part.exists() else 0


def _has_other_digest(file: SetFile, place: Path) -> bool:
    if file.digest is None:
        return False
    algorithm, digits = file.digest.split(":")
    return bool(pooch.file_hash(str(place), algorithm) != digits)


def _refuse_other_size(file: SetFile, place: Path) -> None:
    size = place.stat().st_size
    if file.bytes not in (None, size):
        raise FetchError(
            f"{place} is of {size:,} bytes, but {file.bytes:,} are documented; remove it and run this again"
        )


def _refuse_packed(answer: requests.Response, url: str) -> None:
    packed = answer.headers.get("Content-Encoding", "identity")
    if packed.strip().lower() not in ("", "identity"):
        raise FetchError(
            f"{url}: the server sends it packed ({packed}) though it was asked not to, so that its size "
            "cannot be known; get it in a browser"
        )


def _continues(answer: requests.Response, have: int) -> bool:
    starts = re.match(r"bytes (\d+)-", answer.headers.get("Content-Range", ""))
    if answer.status_code == _PARTIAL and not (starts and int(starts[1]) == have):
        raise requests.RequestException("the server sent another part than was asked for")
    return answer.status_code == _PARTIAL


def _total(answer: requests.Response, have: int) -> int | None:
    of = re.fullmatch(r"bytes \d+-\d+/(\d+)", answer.headers.get("Content-Range", ""))
    if answer.status_code == _PARTIAL and of:  # less may come than was asked for
        return int(of[1])
    length = answer.headers.get("Content-Length", "")
    return have + int(length) if length.isdigit() else None


def _validator(answer: requests.Response) -> str | None:
    """Return what tells this version of the file: its entity tag, unless it is a weak one, or its date."""
    tag = answer.headers.get("ETag", "")
    return tag if tag.startswith('"') else answer.headers.get("Last-Modified")


def _refusal(error: requests.HTTPError, url: str) -> str:
    if error.response is not None and error.response.status_code == _MISSING:
        return f"there is nothing at {url} (404)"
    return f"the server refuses it: {error}"


def _unreachable(error: requests.RequestException, url: str) -> str:
    words = str(error)
    if isinstance(error, requests.exceptions.SSLError):
        return f"{url} cannot be trusted: its certificate is not valid here"
    if "NameResolutionError" in words or "getaddrinfo" in words:
        return f"no network, or no such server: the name in {url} is not known here"
    if "NewConnectionError" in words:
        return f"no network, or the server is down: no connection to {url}"
    return f"the connection to {url} broke off"


def _no_room(error: OSError, place: Path) -> str:
    why = error.strerror or str(error)
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"no room for {place} ({why.lower()}); make room and run this again to go on with it"
    return f"{place} cannot be written: {why}; let this user write there, or name another folder"
