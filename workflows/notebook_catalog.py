"""The catalog that a notebook is about: one that is there, or one that is made first of a library.

What `motionary run` and `motionary demo` do, without their options and without a word where nothing is left
to do: cells that are run again show the same.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from motionary.catalog import Catalog
from motionary.catalog.snapshot import current_id
from motionary.catalog.store import Store
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.distances.tiles import usable_processors
from motionary.pipeline.synthetic import write_library
from motionary.workflows.commands.options import COMPILING
from motionary.workflows.errors import UserError
from motionary.workflows.main_job import run
from motionary.workflows.plan import Plan
from motionary.workflows.preparation import Job
from motionary.workflows.settings import load_settings

DEMO = "motionary-demo"
"""Where `motionary demo` leaves the embedded library and its catalog."""


def catalog_of(place: str | os.PathLike[str] = "") -> Catalog:
    """Open a catalog, or make one first.

    Parameters
    ----------
    place : str or path
        A catalog, which is only read. Or a library: its catalog is `NAME-catalog` in the working folder, its
        labels those of `labels.csv` where the library holds one. Or nothing: the embedded library, whose
        catalog is `motionary-demo/catalog` in the working folder or one above it.

    Raises
    ------
    CatalogError
        There is neither a catalog nor a folder.
    UserError
        The folder is no library, or what would be its catalog is that of another.
    """
    if not str(place):
        return _demo()
    url = str(place) if "://" in str(place) else str(Path(place).expanduser())
    if current_id(Store(url)) is not None or not Path(url).is_dir():
        return Catalog.open(url)
    library = Path(url).resolve()
    _refuse_anothers(f"{library.name}-catalog", library)
    labels = library / "labels.csv"
    return make_catalog(
        [library],
        f"{library.name}-catalog",
        labels=labels if labels.exists() else None,
        workers=usable_processors(),
    )


def make_catalog(
    libraries: Sequence[str | os.PathLike[str]],
    catalog: str | os.PathLike[str],
    *,
    labels: Path | None = None,
    label_pattern: str | None = None,
    config: PipelineConfig | None = None,
    workers: int = 1,
) -> Catalog:
    """Run the main job and open what it published; one line says what there is to do, if anything.

    Parameters
    ----------
    libraries : sequence of path
        Folders of motion capture.
    catalog : path
        Made where there is none.
    labels : Path, optional
        CSV of supplied labels.
    label_pattern : str, optional
        Regular expression on clip_ids whose named groups are label columns.
    config : PipelineConfig, optional
        Settings; by default those of the environment.
    workers : int
        Processes; of a few hundred clips one is done before others have started.

    Raises
    ------
    CatalogError, UserError
        As `motionary.workflows.main_job.run`.
    """
    roots = [os.fspath(one) for one in libraries]
    settings = config or load_settings(None, {})
    job = Job(roots, os.fspath(catalog), settings, labels, workers, label_pattern=label_pattern)
    return run(job, _quiet, compiling=lambda: print(COMPILING), planned=_announcer(job)).catalog


def _demo() -> Catalog:
    here = Path.cwd()
    for folder in (here, *here.parents):
        if current_id(Store(str(folder / DEMO / "catalog"))) is not None:
            return Catalog.open(folder / DEMO / "catalog")
    library = Path(DEMO) / "library"
    write_library(library)
    return make_catalog([library], Path(DEMO) / "catalog", labels=library / "labels.csv")


def _refuse_anothers(url: str, library: Path) -> None:
    """Refuse to run over the catalog of a library that is only called alike."""
    if current_id(Store(url)) is None:
        return
    with Catalog.open(url) as catalog:
        of = catalog.last_run["library"]
    if of != [str(library)]:
        raise UserError(
            f"{Path(url).resolve()} is the catalog of {', '.join(of)}, not of {library}; "
            "work in another folder, or give that catalog itself"
        )


def _announcer(job: Job) -> Callable[[Plan], None]:
    def announce(plan: Plan) -> None:
        if plan.to_read:
            print(f"reading {plan.to_read} clips of {', '.join(job.libraries)} into {job.catalog}")

    return announce


@contextmanager
def _quiet(totals: Mapping[str, int]) -> Iterator[Callable[[str], None]]:
    yield lambda stage: None
