"""Catalogs that several tests share, copied for one that changes them."""

import shutil
from pathlib import Path


def copied(catalog: str, folder: Path) -> str:
    """Copy a catalog into a folder; without the leases of who reads it meanwhile, which come and go."""
    return str(shutil.copytree(catalog, folder / "catalog", ignore=shutil.ignore_patterns("leases")))
