"""Chosen clips as a map-style `torch.utils.data.Dataset`, to train with.

    from motionary.catalog.adapters.nearby_shuffle import NearbyShuffle

    dataset = MotionDataset(catalog.filter(style="tired"), window=64, stride=16, frame_rate=30)
    loader = DataLoader(dataset, batch_size=32, sampler=NearbyShuffle(dataset), num_workers=2)

An item is a dict: the motion as float32 tensors, see `motionary.catalog.adapters.clip_arrays`, and numbers
that say whose it is:

`clip`
    Place in `dataset.clip_ids`.
`start`, `frames`
    The item's first frame in the clip as it is shown, and how many there are.
`label`
    Place in `dataset.labels`, or `NO_LABEL`.
`cluster`
    The cluster_id.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.catalog.adapters.clip_arrays import ClipArrays, Representation
from motionary.catalog.errors import CatalogError, nearest
from motionary.catalog.selection import Selection

NO_LABEL = -100
"""The label of a clip without one: the target that torch's cross entropy passes over."""

_DATASET: Any = import_module("torch.utils.data").Dataset if find_spec("torch") else object


class MotionDataset(_DATASET):
    """Clips, or windows of clips, as tensors.

    Random access reads one part of the catalog and no other. It pickles, so that the workers of a DataLoader
    can have it; each keeps parts of its own.

    Parameters
    ----------
    selection : Selection
        The clips.
    representation : {"positions", "rotations", "features"}
        What the tensors are.
    aligned : bool
        In the time of the cluster's reference instead of as captured.
    frame_rate : float, optional
        Frames a second that motions are brought to; by default each has its own. Aligned ones have the common
        rate already, and features have no other.
    window : int, optional
        Frames of an item; whole clips by default.
    stride : int, optional
        Frames from one window of a clip to the next; by default they lie end to end. Frames that do not fill
        a last window are left out.
    label_column : str
        The text column of `clips` or `clusters` that labels are taken from.
    labels : sequence of str, optional
        The vocabulary, as of the dataset that is trained on; by default the labels that occur, sorted.
    kept_parts : int
        How many parts of the catalog, of some 32 clips each, stay in memory.

    Attributes
    ----------
    clip_ids : sequence of str
        The clips, in clip_id order.
    labels : tuple of str
        The vocabulary.
    left_out : list of str
        Clips that are shorter than a window.
    parts : array (items,) of int
        The part of the catalog that holds each item.

    Raises
    ------
    CatalogError
        torch is not installed, a clip is not aligned, or there is no such column.
    ValueError
        An option is out of its range, a clip's label is not in the vocabulary, or windows are asked of clips
        of different frame rates or, as rotations, of rigs with different joints.
    """

    def __init__(
        self,
        selection: Selection,
        representation: Representation = "positions",
        *,
        aligned: bool = False,
        frame_rate: float | None = None,
        window: int | None = None,
        stride: int | None = None,
        label_column: str = "label",
        labels: Sequence[str] | None = None,
        kept_parts: int = 8,
    ) -> None:
        if not find_spec("torch"):
            raise CatalogError(
                "a MotionDataset needs torch, which is not installed; install the build of it that fits this "
                "machine: pip install torch"
            )
        _check(window, stride)
        self._arrays = ClipArrays(selection, representation, aligned, frame_rate, kept_parts)
        self.clip_ids = tuple(selection.clip_ids)
        takes = selection.to_arrow()
        self.labels, self._label_of = _vocabulary(takes, label_column, labels)
        self._cluster_of = takes["cluster_id"].to_pylist()
        if window is not None:
            _require_one_rate(self._arrays.rates)
            if representation == "rotations":
                _require_one_rig(self._arrays.rig_joints)
        self._clip, self._start, self._frames = _windows(self._arrays.frames, window, stride)
        self.kept_parts = kept_parts
        files = [self._arrays.parts.file_of[clip_id] for clip_id in self.clip_ids]
        self.parts = np.unique(files, return_inverse=True)[1][self._clip]
        shown = set(self._clip.tolist())
        self.left_out = [clip_id for place, clip_id in enumerate(self.clip_ids) if place not in shown]

    def __len__(self) -> int:
        return len(self._clip)

    def __getitem__(self, index: int) -> dict[str, Any]:
        """Read an item; see the module.

        Raises
        ------
        IndexError
            There is no such item.
        CatalogError
            The part of the catalog that holds it is damaged or gone.
        """
        import torch

        clip, start, frames = (int(column[index]) for column in (self._clip, self._start, self._frames))
        arrays = self._arrays.read(clip, start, start + frames)
        return {name: torch.tensor(values) for name, values in arrays.items()} | {
            "clip": clip,
            "start": start,
            "frames": frames,
            "label": self._label_of[clip],
            "cluster": self._cluster_of[clip],
        }


def padded(items: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Collate items of different lengths: zeros follow a tensor's last frame, and `frames` tells which it is.

    Parameters
    ----------
    items : sequence of dict
        B items of one dataset; of `rotations`, of one rig.

    Returns
    -------
    dict of str to Tensor
        Motions (B, most frames, ...), numbers (B,).
    """
    import torch
    from torch.nn.utils.rnn import pad_sequence

    def together(values: list[Any]) -> Any:
        return pad_sequence(values, batch_first=True) if torch.is_tensor(values[0]) else torch.tensor(values)

    return {name: together([item[name] for item in items]) for name in items[0]}


def _check(window: int | None, stride: int | None) -> None:
    for name, value in (("window", window), ("stride", stride)):
        if value is not None and value < 1:
            raise ValueError(f"{name} is {value}; it must be at least 1 frame")
    if window is None and stride is not None:
        raise ValueError(f"stride ({stride}) is given without window; give both")


def _vocabulary(
    takes: pa.Table, column: str, labels: Sequence[str] | None
) -> tuple[tuple[str, ...], list[int]]:
    if column not in takes.column_names:
        raise CatalogError(f"clips have no column {column!r}{nearest(column, takes.column_names)}")
    own = takes[column].to_pylist()
    known = tuple(labels) if labels is not None else tuple(sorted({one for one in own if one is not None}))
    number: dict[str | None, int] = {label: place for place, label in enumerate(known)} | {None: NO_LABEL}
    for clip_id, label in zip(takes["clip_id"].to_pylist(), own, strict=True):
        if label not in number:
            raise ValueError(
                f"clip {clip_id!r} is called {label!r}, which is not among the labels given: "
                f"{', '.join(known)}"
            )
    return known, [number[label] for label in own]


def _require_one_rate(rates: NDArray[np.float64]) -> None:
    if len(found := np.unique(rates)) > 1:
        raise ValueError(
            f"windows are asked of clips with {', '.join(f'{rate:g}' for rate in found)} frames a second; "
            "give frame_rate, so that all last equally long"
        )


def _windows(
    frames: NDArray[np.int64], window: int | None, stride: int | None
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return of every item its clip, its first frame and its number of frames."""
    if window is None:
        return np.arange(len(frames)), np.zeros_like(frames), frames
    stride = stride or window
    counts = np.maximum(0, (frames - window) // stride + 1)
    clip = np.repeat(np.arange(len(frames)), counts)
    start = (np.arange(len(clip)) - np.repeat(np.cumsum(counts) - counts, counts)) * stride
    return clip, start, np.full(len(clip), window)


def _require_one_rig(joints: NDArray[np.int64]) -> None:
    if len(found := np.unique(joints)) > 1:
        raise ValueError(
            f"windows of rotations are asked of rigs with {', '.join(map(str, found))} joints; choose clips "
            "of one rig, or take positions"
        )
