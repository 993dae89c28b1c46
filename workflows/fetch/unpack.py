"""Zips and tars from the web, unpacked such that they can do no harm.

All members are looked at before anything is written. An archive is refused whole, by the name of the member,
where one would leave the folder (`..`, an absolute path, a drive), or lie among the downloads or under a
file, or is a link or a device, or where the members are together more than a hundred times the archive.
Python's own ways are milder: `tarfile`'s filter "data" lets links inside the folder pass, and `zipfile`
renames what it does not like.
"""

from __future__ import annotations

import errno
import lzma
import re
import shutil
import stat
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO

from motionary.workflows.fetch.registry import DOWNLOADS, FetchError

ARCHIVES = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")

_LARGEST_RATIO, _ALLOWANCE = 100, 2**20  # of small archives headers alone may be more
_MOST_MEMBERS = 10**6
_DAMAGED = (zipfile.BadZipFile, tarfile.TarError, zlib.error, lzma.LZMAError, EOFError, NotImplementedError)
_IN_THE_WAY = "remove what is in the way (a file for a folder, or the reverse)"
_MENDS = {
    errno.ENOSPC: "make room",
    errno.EDQUOT: "make room",
    errno.ENAMETOOLONG: "name a folder whose disk takes such names",
    errno.EEXIST: _IN_THE_WAY,
    errno.ENOTDIR: _IN_THE_WAY,
    errno.EISDIR: _IN_THE_WAY,
    errno.ENOTEMPTY: _IN_THE_WAY,
}


@dataclass(frozen=True)
class _Member:
    archive: Path
    name: str
    size: int
    odd: str | None  # why it may not be unpacked, where it is neither file nor folder
    is_file: bool
    open: Callable[[], AbstractContextManager[IO[bytes]]]


def unpack(
    archives: Sequence[Path],
    folder: Path,
    keeps: Callable[[str], bool],
    show_progress: Callable[..., AbstractContextManager],
) -> list[str]:
    """Unpack those files of archives that are wanted, once all members of all of them have been looked at.

    Parameters
    ----------
    archives : sequence of Path
        Zip, or tar packed in any way.
    folder : Path
        Where they go, with their folders; files that are there are replaced.
    keeps : callable
        Given a path inside an archive, whether it is wanted.
    show_progress : callable
        As `motionary.workflows.progress.progress`.

    Returns
    -------
    list of str
        Paths of what was unpacked, relative to the folder, with `/`.

    Raises
    ------
    FetchError
        One is damaged (and is then removed) or unsafe, or there is no room for them.
    """
    with ExitStack() as opened:
        wanted: list[_Member] = []
        for archive in archives:
            with _damage_told(archive):
                members = opened.enter_context(_members(archive))
                wanted += [one for one in _safe(members, archive) if keeps(one.name)]
        _refuse_clashes(wanted)
        _refuse_without_room(sum(one.size for one in wanted), folder)
        with show_progress({"unpack": len(wanted)}) as done:
            for one in wanted:
                with _damage_told(one.archive):
                    _write(one, folder)
                done("unpack")
    return [one.name for one in wanted]


@contextmanager
def _damage_told(archive: Path) -> Iterator[None]:
    try:
        yield
    except (*_DAMAGED, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:  # the disk's; gzip and bz2 give no number
            raise
        archive.unlink()
        raise FetchError(
            f"{archive} is damaged or no archive ({error}) and was removed; run this again for a new one"
        ) from None


@contextmanager
def _members(archive: Path) -> Iterator[Iterator[_Member]]:
    if archive.suffix.lower() == ".zip":
        with zipfile.ZipFile(archive) as packed:
            yield (_of_zip(archive, packed, one) for one in packed.infolist())
    else:
        with tarfile.open(archive) as packed_tar:
            yield (_of_tar(archive, packed_tar, one) for one in packed_tar)


def _of_zip(archive: Path, packed: zipfile.ZipFile, one: zipfile.ZipInfo) -> _Member:
    kind = stat.S_IFMT(one.external_attr >> 16)
    odd = None if kind in (0, stat.S_IFREG, stat.S_IFDIR) else "a link or a device"
    if one.flag_bits & 1:
        odd = "encrypted"
    return _Member(
        archive, _tidy(one.filename), one.file_size, odd, not one.is_dir(), lambda: packed.open(one)
    )


def _of_tar(archive: Path, packed: tarfile.TarFile, one: tarfile.TarInfo) -> _Member:
    odd = None if one.isreg() or one.isdir() else "a link or a device"

    @contextmanager
    def opened() -> Iterator[IO[bytes]]:
        with packed.extractfile(one) as content:  # type: ignore[union-attr]
            yield content

    return _Member(archive, _tidy(one.name), one.size, odd, one.isreg(), opened)


def _tidy(name: str) -> str:
    return str(PurePosixPath(name))  # tar writes ./ before names


def _safe(members: Iterator[_Member], archive: Path) -> list[_Member]:
    """Return the files among the members, having looked at all of them."""
    files = []
    room = archive.stat().st_size * _LARGEST_RATIO + _ALLOWANCE
    for count, one in enumerate(members, 1):
        reason = one.odd or _misplaced(one.name)
        room -= one.size
        if reason:
            raise FetchError(
                f"{archive} is not unpacked: its member {one.name!r} is {reason}; nothing was written"
            )
        if room < 0 or count > _MOST_MEMBERS:
            raise FetchError(
                f"{archive} is not unpacked: up to {one.name!r} its members are more than {_LARGEST_RATIO} "
                f"times its size, or more than {_MOST_MEMBERS:,}; nothing was written"
            )
        if one.is_file:
            files.append(one)
    return files


def _misplaced(name: str) -> str | None:
    """Say why nothing may go to a path; a backslash parts names too, as it does on Windows."""
    path = PurePosixPath(name.replace("\\", "/"))
    if path.is_absolute() or re.match("[A-Za-z]:", name):
        return "an absolute path"
    if ".." in path.parts:
        return "a path out of its folder"
    if "\0" in name:
        return "no name of a file"
    return f"in {DOWNLOADS}, where downloads lie" if path.parts[:1] == (DOWNLOADS,) else None


def _refuse_clashes(wanted: list[_Member]) -> None:
    """Refuse a file under a file."""
    files = {PurePosixPath(one.name) for one in wanted}
    for one in wanted:
        for above in PurePosixPath(one.name).parents:
            if above in files:
                raise FetchError(
                    f"{one.archive} is not unpacked: its member {one.name!r} is under {str(above)!r}, which "
                    "is a file of the set too; nothing was written"
                )


def _refuse_without_room(needed: int, folder: Path) -> None:
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise FetchError(
            f"no room to unpack into {folder}: {needed:,} bytes are needed and {free:,} are free; "
            "make room and run this again"
        )


def _write(one: _Member, folder: Path) -> None:
    place = folder / one.name
    if not place.parent.resolve().is_relative_to(folder.resolve()):
        raise FetchError(f"{place} leads out of {folder} through a link that is there; name an empty folder")
    begun = place.with_name(f".{place.name}.part")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with one.open() as content, begun.open("wb") as out:
            shutil.copyfileobj(content, out, 2**20)
        begun.replace(place)
    except OSError as error:
        if error.errno is None:
            raise
        mend = _MENDS.get(error.errno, "let this user write there")
        raise FetchError(
            f"{one.archive}: its member {one.name!r} cannot be written into {folder}: "
            f"{error.strerror or error}; {mend} and run this again"
        ) from None
    finally:
        with suppress(OSError):  # where it could not be begun, it cannot be removed
            begun.unlink(missing_ok=True)
