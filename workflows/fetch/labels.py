"""The labels file of a fetched set: a row a clip, as `motionary run --labels` reads it.

Columns are `path` (relative to the file), `dataset`, `licence`, which data cards carry on, and `action`,
`style`, `subject` and `take`, as far as the set's documented names of files tell them.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from motionary.pipeline.readers.library import FORMATS
from motionary.workflows.fetch.registry import LABELS, OWN_FILES, FetchError, PublicSet

NAME = OWN_FILES[0]
"""Of the labels file."""

_COLUMNS = ("path", "dataset", "licence", *LABELS)


def clips_among(paths: Iterable[str]) -> list[str]:
    """Return the clips among the paths of files, sorted."""
    return sorted(path for path in paths if PurePosixPath(path).suffix.lower() in FORMATS)


def write_labels(clips: Iterable[str], wanted: PublicSet, folder: Path) -> int:
    """Write the labels file of a set.

    Parameters
    ----------
    clips : iterable of str
        Paths relative to the folder.
    wanted : PublicSet
        The set, whose pattern is searched in the clips' names.
    folder : Path
        Where `labels.csv` goes.

    Returns
    -------
    int
        How many names do not fit the pattern; their clips have no labels.
    """
    pattern = re.compile(wanted.pattern, re.IGNORECASE) if wanted.pattern else None
    begun, untold = folder / f".{NAME}.part", 0
    with begun.open("w", encoding="utf-8", newline="") as out:
        rows = csv.DictWriter(out, _COLUMNS, lineterminator="\n")
        rows.writeheader()
        for path in clips:
            found = pattern.search(PurePosixPath(path).name) if pattern else None
            untold += pattern is not None and found is None
            told = found.groupdict() if found else {}
            rows.writerow({"path": path, "dataset": wanted.name, "licence": wanted.licence, **told})
    begun.replace(folder / NAME)
    return untold


def labelled_clips(folder: Path, wanted: PublicSet) -> list[str] | None:
    """Return the paths that a set's labels file names; None where there is none.

    Raises
    ------
    FetchError
        There is a labels file, but of something else.
    """
    file = folder / NAME
    try:
        with file.open(encoding="utf-8-sig", newline="") as text:
            rows = list(csv.DictReader(text))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, csv.Error) as error:
        raise FetchError(f"{file} cannot be read ({error}); name another folder") from None
    if not rows or any(row.get("dataset") != wanted.name or not row.get("path") for row in rows):
        raise FetchError(f"{file} is not of set {wanted.name}; name another folder")
    return [row["path"] for row in rows]
