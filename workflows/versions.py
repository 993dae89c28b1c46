"""What computed a catalog: versions of motionary, of Python and of the libraries that do the arithmetic."""

from __future__ import annotations

import platform
from importlib.metadata import version

_LIBRARIES = ("motionary", "numpy", "scipy", "numba", "llvmlite", "pyarrow", "dask")


def versions() -> dict[str, str]:
    """Return them by name."""
    return {"python": platform.python_version()} | {name: version(name) for name in _LIBRARIES}
