"""A stored table as its parts: what would not fit into memory whole is read one part after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import pyarrow as pa

Load = Callable[[str, Sequence[str] | None], pa.Table]
"""Given a part's key and columns (None for all), the part."""


class Parts:
    """The parts of a stored table, read one after the other, as often as they are asked for.

    Parameters
    ----------
    load : callable
        Reads a part by its key, or some of its columns.
    keys : sequence of str
        The parts, in order.
    """

    def __init__(self, load: Load, keys: Sequence[str]) -> None:
        self._load, self._keys = load, keys

    @staticmethod
    def of(*tables: pa.Table) -> Parts:
        """Take tables in memory for the parts."""
        by_key = {str(place): table for place, table in enumerate(tables)}
        return Parts(
            lambda key, columns: by_key[key] if columns is None else by_key[key].select(columns), [*by_key]
        )

    def read(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Read part after part; of named columns, text may come as dictionaries, which take less memory."""
        return (self._load(key, columns) for key in self._keys)

    def __len__(self) -> int:
        return len(self._keys)
