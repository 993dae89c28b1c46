"""One table of an opened catalog."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pyarrow as pa

from motionary.catalog.damage import named_if_damaged
from motionary.catalog.leases import Lease
from motionary.catalog.schema import SCHEMAS
from motionary.catalog.store import Store

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class CatalogTable:
    """One table of an opened catalog, read when asked for."""

    name: str
    store: Store
    files: Sequence[str]
    lease: Lease | None = field(default=None, repr=False, compare=False)

    def to_arrow(self) -> pa.Table:
        """Read the table with its units in the field metadata."""
        with named_if_damaged(f"a file of table {self.name} of {self.store.url}"):
            return self.store.read(self.files)

    def to_pandas(self) -> pd.DataFrame:
        """Read the table as a data frame."""
        return self.to_arrow().to_pandas()

    def __len__(self) -> int:
        return self.store.rows(self.files)

    def _repr_html_(self) -> str:
        from motionary.catalog.views.notebook import table_html

        return table_html(repr(self), self.to_arrow())

    def __repr__(self) -> str:
        return f"<{self.name}: {len(self)} rows, {', '.join(SCHEMAS[self.name].names)}>"
