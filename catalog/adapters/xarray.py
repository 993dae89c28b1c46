"""Clips as xarray datasets in the layout of the movement package, one dataset a clip.

A poses dataset of movement 0.17 has `position` (time, space, keypoint, individual) and `confidence` (time,
keypoint, individual), coordinates that name the axes, `time` in seconds, and the attributes `fps`,
`time_unit`, `ds_type`, `source_software` and `source_file`. Up to 0.16 two dimensions had plural names:
`dataset.rename(keypoint="keypoints", individual="individuals")` is that. Here

- positions are in the world, Y up, in source units; attribute `unit` says how many metres one is, where the
  source does. movement knows no unit and no axis that is up
- the individual is the label `subject`, or movement's `id_0` where there is none
- confidence is NaN, movement's value for what was not estimated
- attributes also tell what the catalog knows of the clip: `clip_id`, `cluster_id`, `label` and the supplied
  labels; what is not known is left out, since netCDF has no value for it

movement has no layout for several takes of different lengths (its further dimension is for camera views of
one take), so there is none here: a stack padded with NaN would pass for tracking that was lost.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from motionary.catalog.errors import CatalogError
from motionary.catalog.selection import Selection
from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, canonical_indices, find_convention
from motionary.pipeline.motion import Motion
from motionary.pipeline.tables import LABEL_COLUMNS

if TYPE_CHECKING:
    import xarray as xr

_TOLD = ("cluster_id", "label", *LABEL_COLUMNS)


def clip_datasets(
    selection: Selection, *, aligned: bool = False, canonical: bool = False
) -> Iterator[xr.Dataset]:
    """Read clips one after another, in the memory of one batch.

    Parameters
    ----------
    selection : Selection
        The clips.
    aligned : bool
        In the time of the cluster's reference instead of as captured.
    canonical : bool
        The 19 canonical joints instead of those of the clip's rig: the same keypoints for every clip.

    Yields
    ------
    xarray.Dataset
        In the order the clips are stored in; attribute `clip_id` says which it is.

    Raises
    ------
    CatalogError
        xarray is not installed.
    """
    _require_xarray()
    takes = selection.to_arrow()
    place = {clip_id: row for row, clip_id in enumerate(takes["clip_id"].to_pylist())}
    takes = takes.select([name for name in _TOLD if name in takes.column_names])
    conventions = selection.catalog.config.features.conventions if canonical else None
    for motion in selection.motions(aligned):
        known = takes.slice(place[motion.name], 1).to_pylist()[0]
        yield _dataset(motion, known, conventions)


def _dataset(
    motion: Motion, known: Mapping[str, Any], conventions: tuple[Convention, ...] | None
) -> xr.Dataset:
    import xarray as xr

    names, positions = list(motion.skeleton.names), motion.positions()
    if conventions is not None:
        joints = canonical_indices(motion.skeleton, find_convention(names, conventions))
        names, positions = list(CANONICAL_JOINTS), positions[:, joints]
    dimensions = ("time", "space", "keypoint", "individual")
    about = {"clip_id": motion.name, "unit": motion.unit, **known}
    return xr.Dataset(
        {
            "position": (dimensions, positions.transpose(0, 2, 1)[..., None]),
            "confidence": (
                ("time", *dimensions[2:]),
                np.full((*positions.shape[:2], 1), np.nan, dtype=np.float32),
            ),
        },
        coords={
            "time": np.arange(motion.frames) / motion.fps,
            "space": ["x", "y", "z"],
            "keypoint": names,
            "individual": [known.get("subject") or "id_0"],
        },
        attrs={
            "fps": motion.fps,
            "time_unit": "seconds",
            "ds_type": "poses",
            "source_software": "motionary",
            "source_file": motion.source,
        }
        | {name: value for name, value in about.items() if value is not None},
    )


def _require_xarray() -> None:
    try:
        import xarray  # noqa: F401
    except ImportError as error:
        raise CatalogError(f"xarray datasets need xarray ({error}); install motionary[xarray]") from None
