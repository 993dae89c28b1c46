"""Arrays in temporary files, for what may not fit into memory.

The file has no name from the moment it is there, so nothing is left of it however the process ends. Its pages
are memory while there is some: the system writes them out and takes them back as it needs the space. They
count as the process's file-backed memory (RssFile), not as its own (RssAnon).
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from math import prod
from typing import IO, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

NewArray = Callable[[tuple[int, ...], DTypeLike], NDArray[Any]]
"""Makes an array whose contents do not matter yet: `numpy.empty` in memory, `mapped_array` in a file."""

_BLOCK = 1 << 24


def mapped_array(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Make an array of zeros in a temporary file; TMPDIR says where. The file goes with the array.

    Raises
    ------
    OSError
        The folder has no room for it. All of the file is reserved at once: a process that finds the disk full
        when it touches a page is killed.
    """
    size = prod(shape) * np.dtype(dtype).itemsize
    if size == 0:
        return np.empty(shape, dtype)
    with tempfile.TemporaryFile(prefix="motionary-") as file:
        try:
            _reserve(file, size)
        except OSError as error:
            folder = tempfile.gettempdir()
            raise OSError(
                error.errno,
                f"{folder} has no room for {size / 1e9:.3g} GB of temporary files ({error.strerror}); "
                "set TMPDIR to a folder of a larger disk",
            ) from error
        return np.asarray(np.memmap(file, dtype, "r+", shape=shape))


def _reserve(file: IO[bytes], size: int) -> None:
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, size)
        return
    for begin in range(0, size, _BLOCK):  # macOS, Windows: what has been written is there
        file.write(bytes(min(_BLOCK, size - begin)))
    file.flush()
