"""A public set brought into a folder: downloaded, unpacked, labelled.

The labels file is written last, so that a set is complete where it is there with all the clips that it names.
What is downloaded stays in the hidden folder `.fetch`, which no run reads; it may be removed when the set is
complete.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from motionary.pipeline.readers.amc import find_skeleton, skeletons_in
from motionary.workflows.fetch.labels import NAME, clips_among, labelled_clips, write_labels
from motionary.workflows.fetch.meter import Meter
from motionary.workflows.fetch.registry import DOWNLOADS, OWN_FILES, FetchError, PublicSet
from motionary.workflows.fetch.transfer import download
from motionary.workflows.fetch.unpack import ARCHIVES, unpack


@dataclass(frozen=True)
class Fetched:
    """What fetching a set came to.

    Parameters
    ----------
    clips : int
        How many the labels file names.
    labels : Path
        The labels file.
    was_complete : bool
        Nothing was to do.
    kept_labels : bool
        The labels file was there before, and is left as it was.
    untold : int
        Clips whose names do not tell their labels, though the set has a pattern.
    """

    clips: int
    labels: Path
    was_complete: bool = False
    kept_labels: bool = False
    untold: int = 0


def fetch_set(
    wanted: PublicSet,
    folder: Path,
    show_download: Callable[[], AbstractContextManager[Meter]],
    show_progress: Callable[..., AbstractContextManager],
) -> Fetched:
    """Bring a set into a folder; what is there is not downloaded again.

    Parameters
    ----------
    wanted : PublicSet
        The set; that its licence is accepted is the caller's to see to.
    folder : Path
        New, empty, or one that this was called for before.
    show_download : callable
        As `motionary.workflows.fetch.meter.download_meter`.
    show_progress : callable
        As `motionary.workflows.progress.progress`.

    Raises
    ------
    FetchError
        The folder holds something else, a file cannot be had, or an archive cannot be unpacked.
    """
    known = labelled_clips(folder, wanted)
    if known is not None and all((folder / path).is_file() for path in known):
        return Fetched(len(known), folder / NAME, was_complete=True)
    downloads = _begin(wanted, folder)
    try:
        with FileLock(downloads / ".lock", timeout=0):
            paths = _downloaded_and_unpacked(wanted, folder, downloads, show_download, show_progress)
            clips = clips_among(paths)
            if not clips:
                raise FetchError(
                    f"{wanted.name} holds no motion files that a run reads; tell who keeps the registry"
                )
            _place_skeletons(folder, paths)
            if known is not None:  # somebody may have added to it
                return Fetched(len(known), folder / NAME, kept_labels=True)
            (folder / OWN_FILES[1]).write_text(source_text(wanted), encoding="utf-8")
            return Fetched(len(clips), folder / NAME, untold=write_labels(clips, wanted, folder))
    except Timeout:
        raise FetchError(f"another process fetches into {folder}; wait for it") from None


def source_text(wanted: PublicSet) -> str:
    """Say where a set is from, under which licence, and how to name its source."""
    lines = {
        "Set": f"{wanted.name}: {wanted.title}",
        "Source": wanted.source,
        "Licence": wanted.licence,
        "Terms": wanted.terms,
        "Attribution": wanted.attribution,
        "Notes": wanted.notes,
    }
    return "".join(f"{name}: {text}\n" for name, text in lines.items() if text)


def _begin(wanted: PublicSet, folder: Path) -> Path:
    """Make the folder of downloads, if the set may go here."""
    downloads = folder / DOWNLOADS / wanted.name
    try:
        there = [path.name for path in folder.iterdir()] if folder.exists() else []
        if there and not downloads.is_dir():
            raise FetchError(f"{folder} is not empty ({', '.join(sorted(there)[:3])}); name a new folder")
        downloads.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FetchError(f"{folder} cannot be written: {error.strerror}; name another folder") from None
    return downloads


def _downloaded_and_unpacked(
    wanted: PublicSet,
    folder: Path,
    downloads: Path,
    show_download: Callable[[], AbstractContextManager[Meter]],
    show_progress: Callable[..., AbstractContextManager],
) -> list[str]:
    """Return the paths of the set's files in the folder."""
    _refuse_without_room(wanted, downloads)
    with show_download() as meter:
        files = [download(file, downloads, wanted.source, meter) for file in wanted.files]
    archives = [file for file in files if file.name.lower().endswith(ARCHIVES)]
    paths = unpack(archives, folder, wanted.keeps, show_progress)
    for file in files:
        if file not in archives:
            shutil.copyfile(file, folder / file.name)
            paths.append(file.name)
    return paths


def _refuse_without_room(wanted: PublicSet, downloads: Path) -> None:
    needed = sum(file.bytes or 0 for file in wanted.files if not (downloads / file.name).exists())
    there = sum(part.stat().st_size for part in downloads.glob("*.part"))
    free = shutil.disk_usage(downloads).free
    if needed - there > free:
        raise FetchError(
            f"no room in {downloads}: {needed - there:,} bytes are to come and {free:,} are free; "
            "name a folder on a larger disk"
        )


def _place_skeletons(folder: Path, paths: list[str]) -> None:
    """Put the set's ASF beside every AMC that has none in its folder, where readers look for it."""
    skeletons = [folder / path for path in paths if path.lower().endswith(".asf")]
    for path in (folder / path for path in paths if path.lower().endswith(".amc")):
        if find_skeleton(path.stem, skeletons_in(path.parent)) is None:
            found = find_skeleton(path.stem, skeletons)
            if found is not None:
                shutil.copyfile(found, path.parent / found.name)
