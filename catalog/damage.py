"""What a damaged file of a catalog makes of a question: one error that names the file and the mend."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import pyarrow as pa

from motionary.catalog.errors import CatalogError
from motionary.catalog.snapshot import Snapshot
from motionary.catalog.store import Store


@contextmanager
def named_if_damaged(place: str) -> Iterator[None]:
    """Raise what pyarrow raises over a damaged file as an error that names it.

    Raises
    ------
    CatalogError
        The file cannot be read as what it is.
    """
    try:
        yield
    except (FileNotFoundError, CatalogError):
        raise
    except (pa.ArrowException, OSError, ValueError, TypeError) as error:
        raise CatalogError(_told(place, str(error))) from error


def damaged_file(store: Store, snapshot: Snapshot, tables: Iterable[str]) -> str | None:
    """Tell of the first part of some tables that is not as the snapshot's manifest knows it."""
    for table in tables:
        for file in snapshot.tables.get(table, ()):
            try:
                if store.facts(file) == snapshot.parts.get(file):
                    continue
                why = "its content is not what was written"
            except Exception as error:  # whatever damage makes of it
                why = str(error)
            return _told(store.full_path(file), why)
    return None


def _told(place: str, why: str) -> str:
    why = " ".join(why.split())[:300]
    return (
        f"{place} is damaged or gone ({why}); remove what is left of it and run again, which computes it "
        "anew, or open an earlier snapshot; `motionary verify` finds what else is damaged"
    )
