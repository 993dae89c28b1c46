"""Arrays out of an NPZ that anybody may have made: nothing is unpickled, and nothing is taken on trust.

NumPy allocates what a header declares before it reads it. Here a header is first held against the size of
its entry in the archive, and the entry against a bound, so that a file of some kilobytes that declares
terabytes is refused for what it is.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from motionary.pipeline.readers.errors import ReadError, opening
from motionary.pipeline.readers.text import shown

LARGEST_ARRAY = 1 << 29
"""Bytes of an array at most: an hour of SMPL-H at 100 frames a second is 450 million."""

_DAMAGE = (zipfile.BadZipFile, zlib.error, ValueError, EOFError, NotImplementedError, RuntimeError, KeyError)
_AGAIN = "copy the file again, or save it with numpy.savez"


def read_arrays(path: Path, needed: Sequence[str], wanted: Sequence[str] = ()) -> dict[str, np.ndarray]:
    """Read arrays of an NPZ by name.

    Parameters
    ----------
    path : Path
    needed : sequence of str
        Arrays that must be there.
    wanted : sequence of str
        Arrays that may be; those that hold Python objects are passed over.

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
        there = set(archive.namelist())
        missing = [name for name in needed if f"{name}.npy" not in there]
        if missing:
            names = ", ".join(sorted(one.removesuffix(".npy") for one in there)[:20]) or "none"
            what = f"the NPZ has no array {missing[0]!r}; its arrays are {shown(names, 200)}"
            raise ReadError(path, None, what, "an NPZ is read as AMASS writes it: see pipeline/readers")
        arrays = {name: _array(path, archive, name) for name in needed}
        for name in wanted:
            if f"{name}.npy" in there:
                array = _array(path, archive, name, objects_too=True)
                arrays |= {name: array} if not array.dtype.hasobject else {}
    return arrays


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with opening(path), zipfile.ZipFile(path) as archive:
            yield archive
    except _DAMAGE as error:
        raise ReadError(path, None, f"this is no whole NPZ ({shown(str(error), 80)})", _AGAIN) from error


def _array(path: Path, archive: zipfile.ZipFile, name: str, *, objects_too: bool = False) -> np.ndarray:
    entry = archive.getinfo(f"{name}.npy")
    with archive.open(entry) as file:
        shape, dtype = _header(file)
        room = entry.file_size - file.tell()
    if dtype.hasobject:
        if objects_too:
            return np.empty(0, dtype)
        what = f"{name!r} holds Python objects, which are not read: they may run any program"
        raise ReadError(path, None, what, "save plain arrays, with allow_pickle=False")
    declared = dtype.itemsize
    for length in shape:  # in Python's integers, which do not overflow
        declared *= int(length)
    if declared > LARGEST_ARRAY:
        what = f"{name!r} declares {declared / 1e6:.0f} MB, more than the {LARGEST_ARRAY / 1e6:.0f} MB read"
        raise ReadError(path, None, what, "cut it into takes")
    if declared != room:
        what = f"{name!r} declares {declared} bytes and holds {room}"
        raise ReadError(path, None, what, _AGAIN)
    with archive.open(entry) as file:
        return np.asarray(npy.read_array(file, allow_pickle=False))


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype]:
    """Read what an array declares."""
    version = npy.read_magic(file)
    readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    if version not in readers:
        raise ValueError(f"an array of NPY version {version[0]}.{version[1]}")
    try:
        shape, _, dtype = readers[version](file)
    except Exception as error:  # a header is parsed as Python, which fails in many ways
        raise ValueError(f"an array without a header: {error}") from error
    return shape, dtype
