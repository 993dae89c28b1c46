"""How the kernels of this package are compiled.

They take arrays and scalars, allocate nothing and return scalars, so they need not count references: for
each array taken out of a workspace Numba would otherwise add and subtract one, atomically, and on short clips
that took more time than the distances. Threads run them side by side, since they release the lock.
"""

from __future__ import annotations

from typing import Any

from numba import njit

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "_nrt": False}
kernel: Any = njit(**_OPTIONS)
