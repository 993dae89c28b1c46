"""Stretches of single clips as float32 arrays, in one of three representations.

`rotations`
    `rotations` (frames, J, 4), local quaternions x y z w, and `root_position` (frames, 3) in source units.
    J is the rig's.
`positions`
    `positions` (frames, 19, 3): the canonical joints in the world, Y up, in leg lengths, so that figures of
    any rig and unit go together. The rival is source units: times the clip's `leg_length`.
`features`
    `features` (frames, 59) at the common rate: place and heading removed, see `motionary.pipeline.features`.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.catalog.adapters.clip_parts import ClipParts
from motionary.catalog.errors import CatalogError
from motionary.catalog.export_choice import rows_of
from motionary.catalog.selection import Selection
from motionary.pipeline.canonical import canonical_indices, find_convention
from motionary.pipeline.features import frame_features, sample_times
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.stages.columns import matrix
from motionary.pipeline.stages.motions import read_motion_rows

Representation = Literal["positions", "rotations", "features"]

_CLIP = ["clip_id", "path", "fps", "frames", "leg_length", "unit", "skeleton", "notes"]


class ClipArrays:
    """Chosen clips, any stretch of which can be read.

    Parameters
    ----------
    selection : Selection
        N clips.
    representation : {"positions", "rotations", "features"}
    aligned : bool
        In the time of the cluster's reference instead of as captured.
    frame_rate : float, optional
        Frames a second that motions are brought to; by default each has its own.
    kept_parts : int
        See `ClipParts`.

    Attributes
    ----------
    frames : array (N,) of int
        Of each clip, as it is shown.
    rates : array (N,)
        Frames a second of each, as it is shown.
    parts : ClipParts
        Where they are read from.

    Raises
    ------
    CatalogError
        A clip is not aligned.
    ValueError
        There is no such representation, or the frame rate is not possible.
    """

    def __init__(
        self,
        selection: Selection,
        representation: Representation,
        aligned: bool,
        frame_rate: float | None,
        kept_parts: int,
    ) -> None:
        _check(representation, frame_rate)
        self.representation, self.aligned, self.frame_rate = representation, aligned, frame_rate
        self.config = selection.catalog.config.features
        self._clips = _clips(selection)
        self._stored = _stored(selection, self._clips, aligned)
        as_stored = representation == "features" and not aligned
        if as_stored:
            frame_rate = self.config.frame_rate
        self.rates = np.array([rate if frame_rate is None else frame_rate for _, rate in self._stored])
        self.frames = np.array(
            [len(self._times(place)) for place in range(len(self._stored))], dtype=np.int64
        )
        table, columns = ("aligned" if aligned else "frames"), ["root_position", "rotations"]
        if as_stored:
            table, columns = "features", ["feature"]
        self.parts = ClipParts(selection.catalog, table, selection.clip_ids, columns, kept_parts)

    @property
    def rig_joints(self) -> NDArray[np.int64]:
        """How many joints each clip's rig has."""
        joints = pc.struct_field(self._clips["skeleton"], "joints")
        return pc.list_value_length(joints).to_numpy().astype(np.int64)

    def read(self, place: int, start: int, stop: int) -> dict[str, NDArray[np.float32]]:
        """Read frames `start` to `stop` (not included) of the clip at a place of the selection.

        Raises
        ------
        CatalogError
            The part that holds it is damaged or gone; or rotations are asked of a motion of markers.
        """
        clip = self._clips.slice(place, 1).to_pylist()[0]
        rows = self.parts[clip["clip_id"]]
        if self.representation == "features":
            return {"features": self._features(clip, rows, place, start, stop)}
        motion = self._motion(clip, rows, place, start, stop)
        if self.representation == "rotations":
            if motion.places is not None:
                raise CatalogError(
                    f"clip {motion.name!r} was captured as markers and has no rotations; leave it out, "
                    "or take positions"
                )
            arrays = {"rotations": motion.rotations, "root_position": motion.root_position}
        else:
            joints = canonical_indices(
                motion.skeleton, find_convention(motion.skeleton.names, self.config.conventions)
            )
            arrays = {"positions": motion.positions()[:, joints] / clip["leg_length"]}
        return {name: values.astype(np.float32) for name, values in arrays.items()}

    def _features(self, clip: dict, rows: pa.Table, place: int, start: int, stop: int) -> NDArray[np.float32]:
        if not self.aligned:
            return matrix(rows["feature"].slice(start, stop - start))
        motion = read_motion_rows(clip, rows, self._stored[place][1])
        return frame_features(motion, self.config).values[start:stop]

    def _motion(self, clip: dict, rows: pa.Table, place: int, start: int, stop: int) -> Motion:
        """Read a stretch of a motion; of a long clip no other frames are turned into arrays."""
        rate = self._stored[place][1]
        if self.frame_rate is None:
            return read_motion_rows(clip, rows.slice(start, stop - start), rate)
        times = self._times(place)[start:stop]
        first, last = int(times[0]), int(np.ceil(times[-1]))
        return read_motion_rows(clip, rows.slice(first, last + 1 - first), rate).sampled(times - first)

    def _times(self, place: int) -> FloatArray:
        """Return where, in frames as stored, the frames lie that are shown."""
        frames, rate = self._stored[place]
        shown = self.rates[place]
        return np.arange(float(frames)) if shown == rate else sample_times(frames, rate, shown)


def _check(representation: str, frame_rate: float | None) -> None:
    if representation not in get_args(Representation):
        raise ValueError(
            f"representation is {representation!r}; it must be one of {', '.join(get_args(Representation))}"
        )
    if frame_rate is not None and not 0 < frame_rate < np.inf:
        raise ValueError(f"frame_rate is {frame_rate}; it must be positive and finite")
    if frame_rate is not None and representation == "features":
        raise ValueError("frame_rate is given with features, which have the common rate; leave it out")


def _clips(selection: Selection) -> pa.Table:
    """Read the rows of `clips`, in the selection's order."""
    return rows_of(selection.catalog.clips.to_arrow().select(_CLIP), selection.clip_ids).combine_chunks()


def _stored(selection: Selection, clips: pa.Table, aligned: bool) -> list[tuple[int, float]]:
    """Return of every clip its frames, as captured or aligned, and how many there are in a second."""
    if not aligned:
        return list(zip(clips["frames"].to_pylist(), clips["fps"].to_pylist(), strict=True))
    table = selection.catalog.alignments.to_arrow().select(["clip_id", "source_time", "frame_rate"])
    frames = pc.list_value_length(table["source_time"]).to_pylist()
    rates = table["frame_rate"].to_pylist()
    known = dict(zip(table["clip_id"].to_pylist(), zip(frames, rates, strict=True), strict=True))
    try:
        return [known[clip_id] for clip_id in selection.clip_ids]
    except KeyError as error:
        raise CatalogError(
            f"clip {error.args[0]!r} of {selection.catalog.store.url} is not aligned; leave out `aligned`, "
            "or choose other clips"
        ) from None
