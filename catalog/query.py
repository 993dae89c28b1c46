"""A catalog as people use it: tables, SQL, motions."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.damage import damaged_file, named_if_damaged
from motionary.catalog.errors import CatalogError
from motionary.catalog.leases import Lease
from motionary.catalog.opening import open_snapshot
from motionary.catalog.schema import PUBLISHED, SCHEMAS
from motionary.catalog.snapshot import Snapshot, snapshot_ids
from motionary.catalog.store import Store
from motionary.pipeline.motion import Motion
from motionary.pipeline.stages.motions import read_motion_rows

if TYPE_CHECKING:
    import duckdb
    import pandas as pd

    from motionary.catalog.export import ExportedClip
    from motionary.catalog.export_plan import ExportFormat


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

    def __repr__(self) -> str:
        return f"<{self.name}: {len(self)} rows, {', '.join(SCHEMAS[self.name].names)}>"


class _Table:
    """Attribute of a catalog that gives a table: that of its own name, or the one named."""

    def __init__(self, name: str = "") -> None:
        self.name = name

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def __get__(self, catalog: Catalog | None, owner: type) -> CatalogTable:
        if catalog is None:
            raise AttributeError(
                f"{self.name} is a table of an opened catalog: Catalog.open(url).{self.name}"
            )
        return CatalogTable(self.name, catalog.store, catalog.files(self.name), catalog.lease)


class Catalog:
    """A published catalog, opened for reading.

    It keeps the snapshot it was opened at: a run that publishes meanwhile changes nothing it shows, and
    vacuum leaves it alone until it is closed. One made directly, of a snapshot not yet published perhaps, is
    not protected so.

    Examples
    --------
    >>> from motionary.catalog import Catalog
    >>> catalog = Catalog.open("takes.catalog")                                    # doctest: +SKIP
    >>> earlier = Catalog.open("takes.catalog", snapshot=3)                        # doctest: +SKIP
    >>> catalog.sql("select label, count(*) from clusters group by label")         # doctest: +SKIP
    """

    clips = _Table()
    frames = _Table()
    features = _Table()
    resampled = _Table()
    pairs = _Table()
    linkage = _Table()
    partitions = _Table()
    cuts = _Table()
    clusters = _Table()
    references = _Table()
    alignments = _Table()
    aligned_frames = _Table("aligned")
    styles = _Table()
    lineage = _Table()
    labels = _Table()
    inputs = _Table()
    quarantine = _Table()
    runs = _Table()

    def __init__(self, store: Store, snapshot: Snapshot, lease: Lease | None = None) -> None:
        self.store = store
        self.snapshot = snapshot
        self.lease = lease

    @classmethod
    def open(cls, url: str | os.PathLike[str], snapshot: int | str | None = None) -> Catalog:
        """Open a catalog as it is, or as it was.

        Parameters
        ----------
        url : str or path
            A folder, or any fsspec URL.
        snapshot : int or str, optional
            A snapshot's number, or the id of the run that published it, instead of the current one.

        Raises
        ------
        CatalogError
            Nothing is published there, or there is no such snapshot: it was never, or is vacuumed.
        """
        store = Store(str(url))
        return cls(store, *open_snapshot(store, snapshot))

    def close(self) -> None:
        """Give the snapshot up: vacuum may remove it."""
        if self.lease is not None:
            self.lease.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __reduce__(self) -> tuple:
        return Catalog, (self.store, self.snapshot)  # a lease stays with the process that took it

    def snapshots(self) -> list[str]:
        """List the ids of the snapshots that are there, oldest first."""
        return snapshot_ids(self.store)

    def __repr__(self) -> str:
        return f"<Catalog {self.store.url}: {len(self.clips)} clips, snapshot {self.snapshot.snapshot_id}>"

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of the run that made the snapshot, by stage."""
        return json.loads(self.runs.to_arrow()["settings"][-1].as_py())

    def files(self, table: str) -> Sequence[str]:
        """List the Parquet files of a table, relative to the catalog.

        Raises
        ------
        CatalogError
            The catalog was published by a motionary that did not make this table yet.
        """
        try:
            return self.snapshot.tables[table]
        except KeyError:
            raise CatalogError(
                f"{self.store.url} has no table {table!r}; an older motionary published it; make it with: "
                f"motionary run LIBRARY {self.store.url}"
            ) from None

    def sql(self, query: str, parameters: Sequence[object] | Mapping[str, object] | None = None) -> pa.Table:
        """Ask a question in DuckDB's SQL; every table of the catalog is a view of its name.

        A query can read the catalog and nothing else: no other file, no address, no setting.

        Parameters
        ----------
        query : str
            One statement; `?` or `$name` stand for parameters.
        parameters : sequence or mapping, optional
            Values of the parameters.

        Raises
        ------
        CatalogError
            The query is not valid, with DuckDB's message; or a file of the catalog is damaged.
        """
        import duckdb

        with duckdb.connect() as connection:
            try:
                self._create_views(connection)
                statements = connection.extract_statements(query)
                if [one.type for one in statements] != [duckdb.StatementType.SELECT]:
                    raise CatalogError("a catalog is only read: give one statement that selects")
                return connection.sql(query, params=parameters).to_arrow_table()
            # RuntimeError: what DuckDB says of a damaged file can be no text.
            except (duckdb.Error, UnicodeDecodeError, RuntimeError) as error:
                wrong = (duckdb.ParserException, duckdb.CatalogException)  # the query is, and no file
                damage = (
                    None if isinstance(error, wrong) else damaged_file(self.store, self.snapshot, PUBLISHED)
                )
                raise CatalogError(damage or f"the query cannot be answered: {error}") from error

    def motion(self, clip_id: str) -> Motion:
        """Read a clip's motion as it was captured.

        Raises
        ------
        CatalogError
            The catalog has no such clip.
        """
        clip = self._clip(clip_id)
        return self._motion(clip, "frames", clip["fps"])

    def aligned(self, clip_id: str) -> Motion:
        """Read a clip's motion aligned in time to its cluster's reference.

        Raises
        ------
        CatalogError
            The catalog has no such clip.
        """
        alignments = self.alignments.to_arrow()
        clip = self._clip(clip_id)
        row = alignments.filter(pc.equal(alignments["clip_id"], clip_id))
        return self._motion(clip, "aligned", row["frame_rate"][0].as_py())

    def export(
        self,
        folder: str | os.PathLike[str],
        format: ExportFormat = "bvh",
        *,
        clips: Sequence[str] | None = None,
        cluster: int | str | None = None,
        aligned: bool = False,
        overwrite: bool = False,
    ) -> list[ExportedClip]:
        """Write motions as files that other programs read, lengths in the source's units.

        Parameters
        ----------
        folder : path
            Made where it is missing.
        format : {"bvh", "npz", "parquet"}
            A BVH a clip; an NPZ a clip, see `motionary.pipeline.writers.npz`; or `frames.parquet` or
            `aligned.parquet` for all, beside `clips.parquet` with their skeletons. A clip's file is
            called by its clip_id, with the suffix replaced.
        clips : sequence of str, optional
            Only these clips.
        cluster : int or str, optional
            Only the clips of the cluster of this number, or else of all clusters of this name.
        aligned : bool
            In the time of the cluster's reference instead of as captured.
        overwrite : bool
            Replace files that are there.

        Returns
        -------
        list of ExportedClip
            Each clip with its path, or with the `reason` why it could not be written.

        Raises
        ------
        CatalogError
            There is no such clip or cluster, nothing to export, a file that would be replaced, or the folder
            is part of the library or cannot be written.
        """
        from motionary.catalog.export import write_export
        from motionary.catalog.export_plan import plan_export

        plan = plan_export(
            self, folder, format, clips=clips, cluster=cluster, aligned=aligned, overwrite=overwrite
        )
        return list(write_export(plan))

    def _create_views(self, connection: duckdb.DuckDBPyConnection) -> None:
        filesystem = self.store.filesystem
        if not isinstance(filesystem, LocalFileSystem):
            connection.register_filesystem(filesystem)
        for name in PUBLISHED:
            if name not in self.snapshot.tables:
                continue  # an older motionary published it
            files = self.snapshot.tables[name]
            listed = ", ".join(_sql_text(self.store.full_path(file)) for file in files)
            connection.execute(f'create view "{name}" as from read_parquet([{listed}], union_by_name = true)')
        # A query reads this catalog's files and nothing else, writes nowhere and loads nothing.
        home = _sql_text(self.store.full_path("").rstrip("/") + "/")
        connection.execute(f"set allowed_directories = [{home}]")
        connection.execute("set enable_external_access = false")
        connection.execute("set lock_configuration = true")

    def _clip(self, clip_id: str) -> dict:
        table = self.clips.to_arrow()
        rows = table.filter(pc.equal(table["clip_id"], clip_id)).to_pylist()
        if not rows:
            raise CatalogError(
                f"no clip {clip_id!r} in {self.store.url}{nearest(clip_id, table['clip_id'].to_pylist())}"
            )
        return rows[0]

    def _motion(self, clip: dict, table: str, fps: float) -> Motion:
        filesystem = self.store.filesystem
        with named_if_damaged(f"a file of table {table} of {self.store.url}"):
            rows = pa.concat_tables(
                pq.read_table(
                    self.store.path(file), filesystem=filesystem, filters=[("clip_id", "=", clip["clip_id"])]
                )
                for file in self.files(table)
            )
            return read_motion_rows(clip, rows, fps)


def nearest(name: str, known: Sequence[str]) -> str:
    """Ask whether one of the names most like an unknown one was meant; empty where none is like it."""
    from difflib import get_close_matches

    close = get_close_matches(name, known, n=3, cutoff=0.5)
    return f"; did you mean {', '.join(close)}?" if close else ""


def _sql_text(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
