"""Clips in a zip, which stands in a library for a folder: `takes.zip/walk/01.bvh` is a path like any other.

A member is unpacked to a temporary folder when it is read, with the ASF it belongs to, and goes afterwards.
A zip may come from anybody, so some members are refused, each with its reason: encrypted ones; links; names
that are no plain relative path (absolute, with `..` or a backslash), of which nothing is ever written to
disk; names that stand twice; and those that unpack to more than a clip can be. A member never gives more
bytes than it declares, and one that gives fewer, or others than its checksum says, is damaged. A zip in a zip
is passed over.
"""

from __future__ import annotations

import os
import re
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import IO
from urllib.parse import quote

from motionary.pipeline.readers.errors import ReadError, opening
from motionary.pipeline.readers.text import shown

LARGEST_MEMBER = 1 << 30
"""Bytes of a member at most."""
LARGE_MEMBER, MOST_PACKED = 1 << 24, 100
"""Bytes from which on a member may not unpack to more than so many times its packed size: the numbers of a
take pack to a fifth or a tenth, a bomb to a thousandth."""

_PIECE = 1 << 20
_DAMAGE = (zipfile.BadZipFile, zlib.error, ValueError, EOFError, NotImplementedError, RuntimeError)
_AGAIN = "copy the archive again, or pack it again"


@dataclass(frozen=True)
class Member:
    """A file in a zip.

    Parameters
    ----------
    name : str
        What it is called in paths: its name in the zip, percent-encoded where that is refused.
    info : ZipInfo
    what, mend : str
        Why it is refused, and what to do about it; empty where it is not.
    """

    name: str
    info: zipfile.ZipInfo
    what: str = ""
    mend: str = ""


@dataclass(frozen=True)
class _Archive:
    file: zipfile.ZipFile
    members: dict[str, Member]


def archive_of(path: str | os.PathLike[str]) -> tuple[Path, str] | None:
    """Split a path that leads into a zip into the zip and the member's name; None for other paths."""
    text = os.fspath(path)
    for found in re.finditer(r"\.zip(?=/)", text, re.IGNORECASE):
        if Path(text[: found.end()]).is_file():
            return Path(text[: found.end()]), text[found.end() + 1 :]
    return None


def members_of(archive: Path) -> dict[str, Member]:
    """List the files in a zip by the names they have in paths.

    Raises
    ------
    ReadError
        It cannot be opened or is no whole zip.
    """
    return _opened(archive).members


def pieces_of(archive: Path, name: str) -> Iterator[bytes]:
    """Unpack a member piece by piece, each of about a megabyte.

    Raises
    ------
    ReadError
        There is no such member, it is refused (see the module) or damaged, or the zip is.
    """
    opened, path = _opened(archive), f"{archive}/{name}"
    member = opened.members.get(name)
    if member is None:
        raise ReadError(path, None, "the archive holds no such file", "check the name, or its capitals")
    if member.what:
        raise ReadError(path, None, member.what, member.mend)
    try:
        with opening(archive), opened.file.open(member.info) as file:
            yield from _pieces(file, member.info.file_size)
    except _DAMAGE as error:
        what = f"it cannot be unpacked ({shown(str(error), 80)})"
        raise ReadError(path, None, what, _AGAIN) from error


def stamp_of(archive: Path, name: str) -> bytes:
    """Tell a member that cannot be unpacked from any other, by what the zip says of it."""
    info = members_of(archive)[name].info
    said = (info.orig_filename, info.CRC, info.file_size, info.compress_size, info.flag_bits)
    return repr(said).encode("utf-8", "backslashreplace")


def packing_fault(info: zipfile.ZipInfo) -> str:
    """Say to how much a member unpacks, where that is more than a clip can be; else nothing."""
    packed_well = info.file_size > LARGE_MEMBER and info.file_size > MOST_PACKED * info.compress_size
    if info.file_size <= LARGEST_MEMBER and not packed_well:
        return ""
    return f"it unpacks from {info.compress_size / 1e6:.3g} MB to {info.file_size / 1e6:.0f} MB"


@contextmanager
def as_files(path: Path, skeleton: Path | None) -> Iterator[tuple[Path, Path | None]]:
    """Give paths that can be opened: themselves, or, of members of a zip, unpacked copies that go afterwards.

    Raises
    ------
    ReadError
        A member cannot be unpacked. What is raised of a copy meanwhile names the member.
    """
    inside = archive_of(path)
    if inside is None:
        yield path, skeleton
        return
    originals: dict[str, Path] = {}
    try:
        with tempfile.TemporaryDirectory(prefix="motionary-", ignore_cleanup_errors=True) as folder:
            copies = [
                None if one is None else _copy(one, Path(folder, str(number)), originals)
                for number, one in enumerate((path, skeleton))
            ]
            yield copies[0] or path, copies[1]
    except ReadError as error:
        place = originals.get(error.path, Path(error.path))
        raise ReadError(place, error.line, error.what, error.mend) from error.__cause__


def _copy(path: Path, folder: Path, originals: dict[str, Path]) -> Path:
    """Unpack a member into a folder; a path that leads into no zip is its own copy."""
    inside = archive_of(path)
    if inside is None:
        return path
    copy = folder / f"{path.stem[-40:]}{path.suffix}"  # a name in a zip may be longer than a file's
    originals[str(copy)] = path
    try:
        folder.mkdir()
        with copy.open("wb") as file:
            for piece in pieces_of(*inside):
                file.write(piece)
    except OSError as error:
        what = f"it cannot be unpacked to {folder.parent.parent} ({error.strerror})"
        raise ReadError(path, None, what, "make room there, or name another folder by TMPDIR") from error
    return copy


def _opened(archive: Path) -> _Archive:
    try:
        with opening(archive):
            seen = archive.stat()
            return _directory(str(archive), (seen.st_size, seen.st_mtime_ns, seen.st_ino), os.getpid())
    except _DAMAGE as error:
        what = f"this is no whole zip ({shown(str(error), 80)})"
        raise ReadError(archive, None, what, _AGAIN) from error


@lru_cache(maxsize=4)
def _directory(path: str, state: tuple[int, ...], process: int) -> _Archive:
    """Open a zip and list it, once as long as it stays as it is; a forked process opens its own."""
    archive = zipfile.ZipFile(path)
    members: dict[str, Member] = {}
    for info in archive.infolist():
        if info.is_dir():
            continue
        member = _judged(info)
        if member.name in members:
            mend = "pack the archive again, with names that differ"
            member = Member(member.name, info, "its name stands more than once in the archive", mend)
        members[member.name] = member
    return _Archive(archive, members)


def _judged(info: zipfile.ZipInfo) -> Member:
    """Decide whether a member is refused."""
    raw = info.orig_filename
    parts = PurePosixPath(raw).parts
    plain = info.filename == raw and raw == "/".join(parts) and not {"..", "."} & set(parts)
    if not plain or "\\" in raw or raw.startswith("/") or re.match(r"[A-Za-z]:", raw):
        what = f"its name in the archive, {shown(raw, 80)}, is no plain relative path"
        return Member(quote(raw, safe=""), info, what, "pack the archive again, from inside its folder")
    if info.flag_bits & 0x1:
        return Member(raw, info, "it is encrypted", "unpack the archive, or pack it without a password")
    if stat.S_ISLNK(info.external_attr >> 16):
        return Member(raw, info, "it is a link", "pack the file itself")
    if what := packing_fault(info):
        return Member(raw, info, what, "no take is like that; if this is one, unpack the archive")
    return Member(raw, info)


def _pieces(file: IO[bytes], size: int) -> Iterator[bytes]:
    given = 0
    while piece := file.read(_PIECE):
        given += len(piece)
        yield piece
    if given != size:
        raise ValueError(f"it declares {size} bytes and has {given}")
