"""What a run that did not compare all pairs leaves open: by landmarks, and where far pairs were left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow.compute as pc

from motionary.catalog.query import Catalog


@dataclass(frozen=True)
class Approximation:
    """What a run by landmarks compared.

    Parameters
    ----------
    landmarks : sequence of str
        The clips all pairs of which are there, which dendrograms, partitions and cuts are of; sorted.
    clips : int
    compared : int
        Pairs that were compared until the clusters were found.
    """

    landmarks: Sequence[str]
    clips: int
    compared: int

    def __str__(self) -> str:
        pairs = self.clips * (self.clips - 1) // 2
        return (
            f"Approximate: clusters from {len(self.landmarks):,} landmarks of {self.clips:,} clips; "
            f"{self.compared:,} of {pairs:,} pairs compared ({self.compared / max(pairs, 1):.1%}). "
            "Dendrograms, partitions and cuts are of the landmarks."
        )


def approximation(catalog: Catalog) -> Approximation | None:
    """Say what a run by landmarks compared; None of any other.

    Raises
    ------
    CatalogError
        The file that tells is damaged.
    """
    if route_of(catalog) != "landmarks":
        return None
    return catalog.keep("approximation", lambda: _read(catalog))


def route_note(catalog: Catalog) -> str | None:
    """Say what the run compared and what that leaves open; None where it compared all pairs, or none."""
    if not len(catalog.clips):
        return None
    if route_of(catalog) == "pruned":
        kept, clips, mu = len(catalog.pairs), len(catalog.clips), catalog.config.clusters.threshold
        return (
            f"Pruned: {kept:,} of {clips * (clips - 1) // 2:,} pairs are at most {mu:g} apart; the others "
            "are left out, and with them the other partitions"
        )
    found = approximation(catalog)
    return None if found is None else str(found)


def clustered_clips(catalog: Catalog) -> list[str]:
    """Return the clips that the dendrograms are of, sorted: all, or the landmarks."""
    found = approximation(catalog)
    if found is not None:
        return [*found.landmarks]
    return catalog.sql("select distinct clip_id from clips order by clip_id")["clip_id"].to_pylist()


def route_of(catalog: Catalog) -> str:
    """Say which pairs the run compared: "all", "pruned" or "landmarks"."""
    return route_in(catalog.settings)


def route_in(settings: Mapping[str, Any]) -> str:
    """Say the same of a run's settings."""
    return settings["distances"].get("pairs", "all")  # an older motionary had no choice


def _read(catalog: Catalog) -> Approximation:
    rows = catalog.store.read(catalog.files("regrouped"))
    landmarks = sorted(rows.filter(rows["landmark"])["clip_id"].to_pylist())
    together = len(landmarks) * (len(landmarks) - 1) // 2
    return Approximation(landmarks, len(rows), together + (pc.sum(rows["compared"]).as_py() or 0))
