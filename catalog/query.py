"""A catalog as people use it: tables, SQL, motions, and the questions that are asked of it."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Self, TypeVar

import pyarrow as pa

from motionary.catalog.errors import CatalogError, UnknownClip, nearest
from motionary.catalog.leases import Lease
from motionary.catalog.motions import stream_motions
from motionary.catalog.opening import open_snapshot
from motionary.catalog.selection import Selection, Wanted
from motionary.catalog.snapshot import Snapshot, snapshot_ids
from motionary.catalog.sql import session_of
from motionary.catalog.store import Store
from motionary.catalog.table import CatalogTable
from motionary.pipeline.config import PipelineConfig, config_of
from motionary.pipeline.motion import Motion

if TYPE_CHECKING:
    from motionary.catalog.description import Description
    from motionary.catalog.example import ClipOrFile
    from motionary.catalog.explanation import Explanation
    from motionary.catalog.export import ExportedClip
    from motionary.catalog.export_plan import ExportFormat
    from motionary.catalog.given_files import Asked
    from motionary.catalog.neighbours import Rank, Similar
    from motionary.catalog.occurrences import Occurrences
    from motionary.catalog.sql import Parameters
    from motionary.pipeline.config import Metric

T = TypeVar("T")


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
    >>> for motion in catalog.filter(label="walk", min_seconds=3).motions():       # doctest: +SKIP
    ...     motion.positions()
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

    _kept: dict[str, Any]
    _keeping: AbstractContextManager[Any]
    _process: int

    def __init__(self, store: Store, snapshot: Snapshot, lease: Lease | None = None) -> None:
        self.store = store
        self.snapshot = snapshot
        self.lease = lease
        self._start_keeping()

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
        """Give the snapshot up, which vacuum may then remove, and what was kept in memory."""
        with self._keeping:
            self._kept = {}
        if self.lease is not None:
            self.lease.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __reduce__(self) -> tuple:
        return Catalog, (self.store, self.snapshot)  # a lease stays with the process that took it

    def keep(self, key: str, make: Callable[[], T]) -> T:
        """Return what is asked for again and again, made when it is first asked for, until `close`."""
        if self._process != os.getpid():  # threads and connections do not come along into a forked process
            self._left = self._kept  # nor can they be ended there
            self._start_keeping()
        with self._keeping:
            if key not in self._kept:
                self._kept[key] = make()
            return self._kept[key]

    def _start_keeping(self) -> None:
        self._kept = {}
        self._keeping, self._process = threading.RLock(), os.getpid()

    def snapshots(self) -> list[str]:
        """List the ids of the snapshots that are there, oldest first."""
        return snapshot_ids(self.store)

    def __repr__(self) -> str:
        return f"<Catalog {self.store.url}: {len(self.clips)} clips, snapshot {self.snapshot.snapshot_id}>"

    def _repr_html_(self) -> str:
        return self.describe()._repr_html_()

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of the run that made the snapshot, by stage."""
        return json.loads(self.last_run["settings"])

    @property
    def last_run(self) -> dict[str, Any]:
        """The row of `runs` of the run that made the snapshot."""
        return self.keep("last run", lambda: self.runs.to_arrow()[-1:].to_pylist()[0])

    @property
    def config(self) -> PipelineConfig:
        """Those settings as the pipeline takes them.

        Raises
        ------
        CatalogError
            Another version of motionary made the snapshot, which knew other settings.
        """
        return self.keep("config", self._read_config)

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

    def sql(self, query: str, parameters: Parameters | None = None) -> pa.Table:
        """Ask a question in DuckDB's SQL; every table of the catalog is a view of its name.

        View `takes` has the columns of `clips`, but for the skeletons, and of `clusters`, a row a clip. A
        query can read the catalog and nothing else: no other file, no address, no setting.

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
        return session_of(self).answer(query, parameters)

    def describe(self) -> Description:
        """Sum up what the catalog holds."""
        from motionary.catalog.description import describe

        return describe(self)

    def everything(self) -> Selection:
        """Choose every clip."""
        return Selection(self, sorted(self.clips.to_arrow()["clip_id"].to_pylist()))

    def filter(
        self, *, min_seconds: float | None = None, max_seconds: float | None = None, **columns: Wanted
    ) -> Selection:
        """Choose clips by what is known of them: `filter(label="walk", style="tired", min_seconds=3)`.

        See `Selection.filter`.
        """
        return self.everything().filter(min_seconds=min_seconds, max_seconds=max_seconds, **columns)

    def where(self, condition: str, parameters: Parameters | None = None) -> Selection:
        """Choose clips by a condition in SQL: `where("style = ? and seconds > 3", ["tired"])`.

        See `Selection.where`.
        """
        return self.everything().where(condition, parameters)

    def sample(self, n: int, seed: int = 0) -> Selection:
        """Draw some clips; see `Selection.sample`."""
        return self.everything().sample(n, seed)

    def motion(self, clip_id: str) -> Motion:
        """Read a clip's motion as it was captured.

        Raises
        ------
        CatalogError
            The catalog has no such clip.
        """
        return self._motion(clip_id, aligned=False)

    def aligned(self, clip_id: str) -> Motion:
        """Read a clip's motion aligned in time to its cluster's reference.

        Raises
        ------
        CatalogError
            The catalog has no such clip.
        """
        return self._motion(clip_id, aligned=True)

    def similar(
        self,
        clip_or_file: ClipOrFile,
        k: int = 10,
        *,
        metric: Metric | None = None,
        joints: str | Sequence[str] | None = None,
        rank: Rank = "distance",
    ) -> Similar:
        """Find the clips most like one of the catalog, or like a file; see `motionary.catalog.neighbours`."""
        from motionary.catalog.neighbours import similar

        return similar(self, clip_or_file, k, metric=metric, joints=joints, rank=rank)

    def occurrences(
        self,
        clip_or_file: str | os.PathLike[str],
        k: int = 10,
        *,
        takes: str | Sequence[str] | None = None,
        joints: str | Sequence[str] | None = None,
    ) -> Occurrences:
        """Find where a short motion occurs in longer takes; see `motionary.catalog.occurrences`."""
        from motionary.catalog.occurrences import occurrences

        return occurrences(self, clip_or_file, k, takes=takes, joints=joints)

    def assign(
        self, files: Asked | Sequence[Asked], *, advance: Callable[[], None] = lambda: None
    ) -> pa.Table:
        """Tell which clusters files, or motions, belong to; see `motionary.catalog.assign`."""
        from motionary.catalog.assign import assign

        return assign(self, files, advance=advance)

    def explain(self, a: ClipOrFile, b: ClipOrFile, metric: Metric | None = None) -> Explanation:
        """Tell why two motions are as far apart as they are; see `motionary.catalog.explain`."""
        from motionary.catalog.explain import explain

        return explain(self, a, b, metric)

    def export(
        self,
        folder: str | os.PathLike[str],
        format: ExportFormat = "bvh",
        *,
        clips: Sequence[str] | None = None,
        cluster: int | str | None = None,
        where: str | None = None,
        aligned: bool = False,
        split: Mapping[str, float] | None = None,
        group: str | Sequence[str] = (),
        seed: int = 0,
        shared_frames: bool = True,
        card: bool = False,
        overwrite: bool = False,
    ) -> list[ExportedClip]:
        """Write motions as files that other programs read, lengths in the source's units.

        Parameters
        ----------
        folder : path
            Made where it is missing.
        format : {"bvh", "npz", "csv", "parquet", "jsonl"}
            A file a clip, called by its clip_id with the suffix replaced: BVH, NPZ or CSV, see
            `motionary.pipeline.writers`. Or one for all: `frames.parquet` or `aligned.parquet`, beside
            `clips.parquet` with their skeletons; `frames.jsonl` or `aligned.jsonl`, a line a clip.
        clips : sequence of str, optional
            Only these clips.
        cluster : int or str, optional
            Only the clips of the cluster of this number, or else of all clusters of this name.
        where : str, optional
            Only clips that fulfil this condition in SQL, see `where`.
        aligned : bool
            In the time of the cluster's reference instead of as captured.
        split : mapping of str to float, optional
            Shares of the clips by part, such as `{"train": 0.8, "test": 0.2}`: each part gets a folder. Clips
            of one recording are never parted, see `motionary.catalog.kept_together`; parts come as near to
            their shares as that allows, see `motionary.catalog.splits`.
        group : str or sequence of str
            Label columns, such as `subject`: a split does not part clips that agree in one of them.
        seed : int
            Another one gives another split.
        shared_frames : bool
            Whether clips that share a frame are of one recording; not so where drawn animations begin with
            one rest pose.
        card : bool
            Write a data card beside the files, and a list of the clips, as is always done for a split:
            `README.md`, `card.json`, `clips.jsonl`.
        overwrite : bool
            Replace files that are there.

        Returns
        -------
        list of ExportedClip
            Each clip with its path, or with the `reason` why it could not be written.

        Raises
        ------
        CatalogError
            There is no such clip, cluster or column, nothing to export, a file that would be replaced, or the
            folder is part of the library or cannot be written; the condition or the split cannot be used.
        """
        from motionary.catalog.export import write_export
        from motionary.catalog.export_plan import plan_export

        plan = plan_export(
            self,
            folder,
            format,
            clips=clips,
            cluster=cluster,
            where=where,
            aligned=aligned,
            split=split,
            group=group,
            seed=seed,
            shared_frames=shared_frames,
            card=card,
            overwrite=overwrite,
        )
        return list(write_export(plan))

    def require(self, *clip_ids: str) -> None:
        """Check that there are such clips.

        Raises
        ------
        CatalogError
            There is none of a name; the message tells the nearest names.
        """
        known = self.keep("clips", lambda: dict.fromkeys(self.clips.to_arrow()["clip_id"].to_pylist()))
        for clip_id in clip_ids:
            if clip_id not in known:
                raise UnknownClip(f"no clip {clip_id!r} in {self.store.url}{nearest(clip_id, [*known])}")

    def _motion(self, clip_id: str, aligned: bool) -> Motion:
        self.require(clip_id)
        return next(stream_motions(self, [clip_id], aligned))

    def _read_config(self) -> PipelineConfig:
        try:
            return config_of(self.settings)
        except (TypeError, ValueError, KeyError) as error:
            raise CatalogError(
                f"the settings of {self.store.url} cannot be read by this motionary ({error}); make it with: "
                f"motionary run LIBRARY {self.store.url}"
            ) from error
