"""The rows of any one clip: its part of the catalog is read and no other, and the last few parts are kept."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from motionary.catalog.damage import named_if_damaged
from motionary.catalog.places import batch_of
from motionary.pipeline.stages.columns import per_clip

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


class ClipParts:
    """One table's rows, clip by clip, in any order.

    A part holds some 32 clips; clips that are asked for near one another should be of one part. It travels
    to other processes without what it keeps in memory. The catalog's lease stays with the process that opened
    it, and holds as long as this object lives there.

    Parameters
    ----------
    catalog : Catalog
    table : str
        One that has a part a batch: frames, aligned, features or resampled.
    clip_ids : collection of str
        The clips that may be asked for.
    columns : sequence of str
        What is read beside `clip_id`.
    kept_parts : int
        How many parts stay in memory, those used last.
    """

    def __init__(
        self,
        catalog: Catalog,
        table: str,
        clip_ids: Collection[str],
        columns: Sequence[str],
        kept_parts: int,
    ) -> None:
        if kept_parts < 1:
            raise ValueError(f"kept_parts is {kept_parts}; at least 1 part is read at a time")
        batch, files = batch_of(catalog), catalog.files(table)
        self.file_of = {clip_id: files[batch[clip_id]] for clip_id in clip_ids}
        self._columns = ["clip_id", *columns]
        self.kept_parts = kept_parts
        self._kept: OrderedDict[str, dict[str, pa.Table]] = OrderedDict()
        self._store, self._lease = catalog.store, catalog.lease

    def __getitem__(self, clip_id: str) -> pa.Table:
        """Return a clip's rows.

        Raises
        ------
        KeyError
            It is none of the clips that may be asked for.
        CatalogError
            The part that holds it is damaged or gone.
        """
        file = self.file_of[clip_id]
        if file not in self._kept:
            while len(self._kept) >= self.kept_parts:
                self._kept.popitem(last=False)
            self._kept[file] = self._read(file)
        self._kept.move_to_end(file)
        return self._kept[file][clip_id]

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_kept": OrderedDict(), "_lease": None}

    def _read(self, file: str) -> dict[str, pa.Table]:
        store = self._store
        with named_if_damaged(store.full_path(file)):
            # One thread: those who ask for clips one by one do so in several processes.
            part = pq.read_table(
                store.path(file), filesystem=store.filesystem, columns=self._columns, use_threads=False
            )
            return per_clip(part)
