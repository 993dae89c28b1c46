"""How the kernels of this package are compiled.

They take arrays and scalars, allocate nothing and return scalars, so they need not count references: for
each array taken out of a workspace Numba would otherwise add and subtract one, atomically, and on short clips
that took more time than the distances. Threads run them side by side, since they release the lock.

Numba keeps machine code for as long as a kernel's own file is the same. Here kernels of one module are built
into those of another, so code is kept for as long as all modules of the package are the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.dispatcher import Dispatcher

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "_nrt": False}
_SOURCES = hashlib.blake2b(
    b"".join(file.read_bytes() for file in sorted(Path(__file__).parent.glob("*.py")))
).hexdigest()


def kernel(function: Callable) -> Any:
    """Compile a function when it is first called, or take the code kept from these very sources."""
    compiled = njit(**_OPTIONS)(function)
    if not isinstance(compiled, Dispatcher):
        raise RuntimeError("NUMBA_DISABLE_JIT is set, and the distances exist as machine code only; unset it")
    kept: Any = compiled
    kept._cache._cache_file._source_stamp = _SOURCES
    return kept
