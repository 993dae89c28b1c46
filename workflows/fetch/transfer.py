"""A file from the web, begun anew or resumed from where it stopped.

pooch decides whether a file is needed, checks its digest, and puts it in its place only when that is right;
what it has no downloader for is resumption. Ours keeps what has come in a file of its own, `NAME.part`, and
asks for the rest with `Range` (RFC 9110, 14.2). A part may be continued only by bytes of the same file:
`If-Range` (13.1.5) has the server send all of it where its entity tag or date is another by now; where a
server has given neither, a published digest must make sure of it, or the part is begun anew. So it is with a
server that knows no ranges, which sends everything.
"""

from __future__ import annotations

import errno
import json
import os
import re
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pooch
import requests

from motionary.workflows.fetch.meter import Meter
from motionary.workflows.fetch.registry import FetchError, SetFile

TIMEOUT = (10.0, 60.0)
"""Seconds to wait for a connection, and for the next bytes."""

# Seconds between attempts, and how often one that got further is followed by another.
_PAUSE, _ATTEMPTS = 1.0, 10
_CHUNK = 2**14  # what a broken connection can cost
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
        if file.digest and not _has_digest(place, *file.digest.split(":")):
            raise FetchError(f"{place} has not the published digest {file.digest}; {by_hand}")
        return place
    if place.exists() and file.digest and not _has_digest(place, *file.digest.split(":")):
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
                    return
                self.part.unlink()
                return self._receive(url)
            answer.raise_for_status()
            have = have if _continues(answer, have) else 0
            total = _total(answer, have)
            if self.file.bytes is not None and total not in (None, self.file.bytes):
                self.part.unlink(missing_ok=True)
                raise FetchError(
                    f"{url} is of {total:,} bytes, but {self.file.bytes:,} are documented: it was changed, "
                    "or the server answers with something else; look at it in a browser"
                )
            self.note.write_text(json.dumps({"url": url, "validator": _validator(answer)}))
            self.meter.begin(self.file.name, total or self.file.bytes, have)
            with self.part.open("ab" if have else "wb") as part:
                for chunk in answer.iter_content(_CHUNK):
                    part.write(chunk)
                    self.meter.advance(len(chunk))
        wanted = self.file.bytes or total
        if wanted is not None and self._size() < wanted:
            raise requests.ConnectionError(f"closed after {self._size():,} of {wanted:,} bytes")

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


def _has_digest(place: Path, algorithm: str, digits: str) -> bool:
    return bool(pooch.file_hash(str(place), algorithm) == digits)


def _continues(answer: requests.Response, have: int) -> bool:
    starts = re.match(r"bytes (\d+)-", answer.headers.get("Content-Range", ""))
    if answer.status_code == _PARTIAL and not (starts and int(starts[1]) == have):
        raise requests.RequestException("the server sent another part than was asked for")
    return answer.status_code == _PARTIAL


def _total(answer: requests.Response, have: int) -> int | None:
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
