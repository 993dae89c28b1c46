"""What a worker must find where it runs: the library, the catalog, this very software.

A worker on a machine that does not see the library would put every clip into quarantine, one that does not
share the catalog's folder would write where nobody reads, and one with other versions may compute other bits
under the same name. So nobody computes before it has looked, once in the life of its process; workers that
join in the middle look as well.
"""

from __future__ import annotations

import platform
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from hashlib import blake2b
from importlib import resources
from pathlib import Path
from uuid import uuid4

from motionary.catalog.store import Store
from motionary.pipeline.compilation import compile_kernels
from motionary.pipeline.readers.library import Source
from motionary.pipeline.task import TableStore, Task, TaskReport, run_task
from motionary.workflows.errors import UserError
from motionary.workflows.versions import versions


class UnfitWorkerError(UserError):
    """A worker lacks what the run needs; the message names it, what is missing, and the mend."""


@dataclass(frozen=True)
class Workplace:
    """What every worker of a run must find.

    Parameters
    ----------
    files : tuple of str
        One of every library.
    store : Store
        The catalog; its folder holds `token`.
    token : str
        A file that tells this catalog's folder from another of the same path.
    software : tuple of (str, str)
        What computes: versions, and the digest of the sources.
    """

    files: tuple[str, ...]
    store: Store
    token: str
    software: tuple[tuple[str, str], ...]

    @staticmethod
    def of(store: Store, sources: Iterable[Source]) -> Workplace:
        """Describe this process's own surroundings."""
        by_root: dict[str, str] = {}
        for source in sources:
            if source.root not in by_root and (file := _readable(source.files[0])):
                by_root[source.root] = file
        # As unfinished files are called: `vacuum` removes one that a run left when it was killed.
        token = f"tables/here.{uuid4().hex}.tmp"
        return Workplace(tuple(by_root.values()), store, token, software())

    def open(self) -> None:
        """Put the token into the catalog's folder."""
        self.store.write(self.token, b"workers of a run look for this file")

    def close(self) -> None:
        """Take it away."""
        self.store.delete(self.token)


def software() -> tuple[tuple[str, str], ...]:
    """Return the versions of what computes, and a digest of motionary's own sources."""
    found = versions() | {"python": ".".join(platform.python_version_tuple()[:2])}
    return (*found.items(), ("motionary's sources", _sources()))


@lru_cache(maxsize=8)
def look_around(workplace: Workplace, me: str) -> None:
    """See that everything is here, and compile the kernels where nobody has; later calls return at once.

    Parameters
    ----------
    workplace : Workplace
    me : str
        What this worker is called in a message.

    Raises
    ------
    UnfitWorkerError
        Something is not.
    KernelCacheError
        Compiled kernels cannot be kept here.
    """
    other = [(name, mine, dict(software()).get(name)) for name, mine in workplace.software]
    unlike = [f"{name} {found} instead of {mine}" for name, mine, found in other if found != mine]
    if unlike:
        raise UnfitWorkerError(
            f"{me} has {', '.join(unlike)}: its results would not be this installation's; install the same "
            "there (constraints.txt names the versions), restart it, and run again"
        )
    for file in workplace.files:
        try:
            Path(file).open("rb").close()
        except OSError as error:
            raise UnfitWorkerError(
                f"{me} cannot read the library: {file}: {error.strerror}; mount it there at the same path, "
                "and run again"
            ) from None
    _write_beside(workplace, me)
    compile_kernels(lambda: None)


def run_where_fit(
    workplace: Workplace, task: Task, store: TableStore, before: Sequence[TaskReport] = ()
) -> TaskReport:
    """Run a task, on a worker that has looked around."""
    look_around(workplace, worker_name())
    return run_task(task, store, before)


def worker_name() -> str:
    """Name the worker that this is called on."""
    from distributed import get_worker

    return f"worker {get_worker().address} on {platform.node()}"


def _write_beside(workplace: Workplace, me: str) -> None:
    store = workplace.store
    mine = f"{workplace.token}.{uuid4().hex}.tmp"
    try:
        if not store.filesystem.exists(store.path(workplace.token)):
            raise UnfitWorkerError(
                f"{me} does not see the catalog at {store.url}: its folder there is another one, or none; "
                "share it, at the same path on all machines, or keep the catalog in an object store"
            )
        try:
            store.write(mine, b"")
        finally:
            with suppress(OSError):
                store.delete(mine)
    except OSError as error:
        raise UnfitWorkerError(
            f"{me} cannot write the catalog at {store.url}: {error.strerror or error}; let its user write "
            "there, and run again"
        ) from None


def _readable(file: str) -> str | None:
    """Return a file that can be opened here, or the zip that it lies in; None for one that cannot."""
    for path in (Path(file), *Path(file).parents):
        try:
            path.open("rb").close()
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError:
            return None
        return str(path)
    return None


@lru_cache(maxsize=1)
def _sources() -> str:
    """Digest what makes the tables: between releases the version stays, and the sources do not."""
    pipeline, catalog = (Path(str(resources.files(f"motionary.{name}"))) for name in ("pipeline", "catalog"))
    digest = blake2b(digest_size=8)
    for path in (*sorted(pipeline.rglob("*.py")), catalog / "schema.py", catalog / "store.py"):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
