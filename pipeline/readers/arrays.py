"""Arrays out of an NPZ that anybody may have made: nothing is unpickled, and nothing is taken on trust.

NumPy allocates what a header declares before it reads it, also for the header itself. Here an entry may not
unpack to more than a clip can be (see `zipped.py`), no more is read of a header than one has, and what it
declares is held against the size of its entry and against a bound, so that a file of some kilobytes that
declares terabytes is refused for what it is. `declared_arrays` tells what there would be to read, before any
of it is.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from motionary.pipeline.readers.errors import ReadError, opening
from motionary.pipeline.readers.text import shown
from motionary.pipeline.readers.zipped import packing_fault

LARGEST_ARRAY = 1 << 29
"""Bytes of an array at most, as float64: an hour of SMPL-H at 100 frames a second is 450 million."""

_LONGEST_HEADER = 1 << 16  # bytes; NumPy itself reads no more than 10,000 characters
_DAMAGE = (zipfile.BadZipFile, zlib.error, ValueError, EOFError, NotImplementedError, RuntimeError, KeyError)
_AGAIN = "copy the file again, or save it with numpy.savez"


@dataclass(frozen=True)
class Declared:
    """What the header of an array declares."""

    shape: tuple[int, ...]
    dtype: np.dtype


def declared_arrays(path: Path, needed: Sequence[str]) -> dict[str, Declared]:
    """Tell what arrays of an NPZ are, by their headers alone.

    Raises
    ------
    ReadError
        What `read_arrays` raises, but for damage after the header.
    """
    with _opened(path) as archive:
        _check_there(path, archive, needed)
        return {name: _declared(path, archive, name) for name in needed}


def read_arrays(
    path: Path, needed: Sequence[str], wanted: Sequence[str] = (), *, largest: int = LARGEST_ARRAY
) -> dict[str, np.ndarray]:
    """Read arrays of an NPZ by name.

    Parameters
    ----------
    path : Path
    needed : sequence of str
        Arrays that must be there.
    wanted : sequence of str
        Arrays that may be; those that hold Python objects are passed over.
    largest : int
        Bytes of an array at most, as float64 where its values are smaller.

    Returns
    -------
    dict of str to array
        Those that are there.

    Raises
    ------
    ReadError
        The file cannot be opened or is no NPZ; an array is missing, damaged, too large or of Python objects.
    """
    with _opened(path) as archive:
        _check_there(path, archive, needed)
        there = [name for name in wanted if f"{name}.npy" in archive.namelist()]
        arrays = {}
        for name in (*needed, *there):
            declared = _declared(path, archive, name, largest, objects_too=name in there)
            if not declared.dtype.hasobject:
                with archive.open(f"{name}.npy") as file:
                    arrays[name] = np.asarray(npy.read_array(file, allow_pickle=False))
    return arrays


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with opening(path), zipfile.ZipFile(path) as archive:
            yield archive
    except _DAMAGE as error:
        raise ReadError(path, None, f"this is no whole NPZ ({shown(str(error), 80)})", _AGAIN) from error


def _check_there(path: Path, archive: zipfile.ZipFile, needed: Sequence[str]) -> None:
    there = set(archive.namelist())
    missing = [name for name in needed if f"{name}.npy" not in there]
    if missing:
        names = ", ".join(sorted(one.removesuffix(".npy") for one in there)[:20]) or "none"
        what = f"the NPZ has no array {missing[0]!r}; its arrays are {shown(names, 200)}"
        raise ReadError(path, None, what, "an NPZ is read as AMASS writes it: see pipeline/readers")


def _declared(
    path: Path,
    archive: zipfile.ZipFile,
    name: str,
    largest: int = LARGEST_ARRAY,
    *,
    objects_too: bool = False,
) -> Declared:
    """Read what an array declares, and refuse what may not be read."""
    entry = archive.getinfo(f"{name}.npy")
    if fault := packing_fault(entry):
        mend = "no take is like that; if this is one, save it with numpy.savez"
        raise ReadError(path, None, f"{name!r}: {fault}", mend)
    with archive.open(entry) as file:
        declared, begin = _header(file)
    if declared.dtype.hasobject:
        if objects_too:
            return declared
        what = f"{name!r} holds Python objects, which are not read: they may run any program"
        raise ReadError(path, None, what, "save plain arrays, with allow_pickle=False")
    values = 1
    for length in declared.shape:  # in Python's integers, which do not overflow
        values *= int(length)
    size = values * max(declared.dtype.itemsize, np.dtype(np.float64).itemsize)
    if size > largest:
        what = f"{name!r} declares {size / 1e6:.3g} MB of numbers, more than the {largest / 1e6:.3g} MB read"
        raise ReadError(path, None, what, "cut it into takes")
    held, room = values * declared.dtype.itemsize, entry.file_size - begin
    if held != room:
        raise ReadError(path, None, f"{name!r} declares {held} bytes and holds {room}", _AGAIN)
    return declared


def _header(file: IO[bytes]) -> tuple[Declared, int]:
    """Read a header, and tell where it ends."""
    start = io.BytesIO(file.read(_LONGEST_HEADER))
    version = npy.read_magic(start)
    readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    if version not in readers:
        raise ValueError(f"an array of NPY version {version[0]}.{version[1]}")
    try:
        shape, _, dtype = readers[version](start)
    except Exception as error:  # a header is parsed as Python, which fails in many ways
        raise ValueError(f"an array without a header: {error}") from error
    return Declared(shape, dtype), start.tell()
