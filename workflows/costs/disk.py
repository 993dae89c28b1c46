"""The disk that a run fills, and what is free there: too small a disk is told before hours of work."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.store import Store
from motionary.pipeline.clustering.landmark_steps import landmark_count
from motionary.workflows.costs.amounts import Amounts
from motionary.workflows.costs.memory import Need
from motionary.workflows.costs.sizes import size_text
from motionary.workflows.errors import UserError
from motionary.workflows.plan import Plan

# Bytes: `motionary demo --clips 300` writes 1.7 MB of 44,850 pairs and 14 MB of 22 MB of BVH.
_OF_PAIR, _OF_BYTE = 40.0, 0.65

PAGE = 5e6
"""Bytes of the overview page, which every run writes anew: nearly all of it are plotly's scripts."""


def needed_bytes(amounts: Amounts, plan: Plan) -> int:
    """Say about how much a run writes: of the clips that are read, of the pairs that are kept, the page."""
    read = amounts.library * plan.to_read / max(amounts.clips, 1)
    return round(_OF_BYTE * read + _OF_PAIR * plan.to_store * (not amounts.pruned) + PAGE)


def refuse_small_disks(store: Store, amounts: Amounts, plan: Plan, need: Need) -> None:
    """Refuse a run for which the catalog's disk is too small, or that of the temporary files.

    Raises
    ------
    UserError
        With both numbers and what to do about it.
    """
    needed, free = needed_bytes(amounts, plan), free_bytes(store)
    if free is not None and needed > free:
        raise UserError(
            f"the run writes about {size_text(needed)} and {size_text(free)} is free at {store.url}; make "
            f"room there, or name a catalog on a larger disk{_fewer_pairs(amounts)}"
        )
    folder = tempfile.gettempdir()
    free = shutil.disk_usage(folder).free
    if plan.to_store and need.scratch > free:
        raise UserError(
            f"clustering takes {size_text(need.scratch)} of temporary files and {size_text(free)} is free at "
            f"{folder}; make room there, or set TMPDIR to a folder of a larger disk{_fewer_pairs(amounts)}"
        )


def _fewer_pairs(amounts: Amounts) -> str:
    if amounts.landmarks is not None or landmark_count(amounts.clips) >= amounts.clips:
        return ""
    return ", or compare fewer pairs: --landmarks auto"


def free_bytes(store: Store) -> int | None:
    """Return what is free where a catalog lies, or will lie; None where that is no disk of this machine."""
    if not isinstance(store.filesystem, LocalFileSystem):
        return None
    home = Path(store.path(""))
    return shutil.disk_usage(next(one for one in (home, *home.parents) if one.exists())).free
