"""What a catalog holds, in a few figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.schema import SCHEMAS
from motionary.pipeline.tables import LABEL_COLUMNS

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


@dataclass(frozen=True, repr=False)
class Description:
    """A catalog in a few figures.

    Parameters
    ----------
    url, snapshot_id, published_at : str
    clips, clusters, quarantined : int
    seconds : float
        Of all clips together.
    names : mapping of str to int
        How many clips are called what, the most frequent first; those without a name are not counted.
    columns : mapping of str to int
        Of every supplied label that any clip has, how many values there are.
    formats, conventions : mapping of str to int
        How many clips were read from which format, and fit which joint-name convention.
    """

    url: str
    snapshot_id: str
    published_at: str
    clips: int
    clusters: int
    quarantined: int
    seconds: float
    names: Mapping[str, int]
    columns: Mapping[str, int]
    formats: Mapping[str, int]
    conventions: Mapping[str, int]

    def lines(self) -> list[tuple[str, str]]:
        """Write it as pairs of what and how many."""
        return [
            ("catalog", f"{self.url}, snapshot {self.snapshot_id} of {self.published_at}"),
            (
                "clips",
                f"{self.clips}, {duration(self.seconds)} in all; {self.quarantined} quarantined",
            ),
            ("clusters", f"{self.clusters}"),
            ("names", _counted(self.names, "clips have none")),
            ("supplied labels", _counted(self.columns, "none")),
            ("formats", _counted(self.formats, "none")),
            ("skeletons", _counted(self.conventions, "none")),
        ]

    def __repr__(self) -> str:
        return "\n".join(f"{what + ':':17}{value}" for what, value in self.lines())

    def _repr_html_(self) -> str:
        from motionary.catalog.views.notebook import facts_html

        return facts_html(self.lines())


def describe(catalog: Catalog) -> Description:
    """Sum up what a catalog holds."""
    clips, clusters = catalog.clips.to_arrow(), catalog.clusters.to_arrow()
    built_in = SCHEMAS["clips"].names
    supplied = [name for name in clips.column_names if name in LABEL_COLUMNS or name not in built_in]
    values = {name: len(pc.unique(clips[name].drop_null())) for name in supplied}
    return Description(
        url=catalog.store.url,
        snapshot_id=catalog.snapshot.snapshot_id,
        published_at=catalog.snapshot.created_at,
        clips=len(clips),
        clusters=len(catalog.references),
        quarantined=len(catalog.quarantine),
        seconds=pc.sum(clips["seconds"]).as_py() or 0.0,
        names=_counts(clusters["label"]),
        columns={name: count for name, count in values.items() if count},
        formats=_counts(clips["format"]),
        conventions=_counts(clips["convention"]),
    )


def _counts(column: pa.ChunkedArray) -> dict[str, int]:
    counted = {one["values"]: one["counts"] for one in pc.value_counts(column.drop_null()).to_pylist()}
    return {value: counted[value] for value in sorted(counted, key=lambda one: (-counted[one], one))}


def _counted(counts: Mapping[str, int], none: str, most: int = 12) -> str:
    listed = [f"{name} {count}" for name, count in [*counts.items()][:most]]
    more = [f"and {len(counts) - most} more"] if len(counts) > most else []
    return ", ".join(listed + more) or none


def duration(seconds: float) -> str:
    """Write a length as people read it."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.1f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
