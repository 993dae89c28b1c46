"""The labelled clips of a catalog, read back from it: classes, subjects, and their motions as captured."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.catalog import Catalog
from motionary.pipeline.motion import Motion
from motionary.pipeline.tables import TABLES
from motionary.workflows.errors import UserError

FeatureOf = Callable[[Motion], NDArray[np.float32]]


@dataclass(frozen=True, eq=False)
class LabelledClips:
    """Clips with a class, in clip_id order.

    Parameters
    ----------
    clip_ids : list of str (N,)
        Their names.
    classes : array (N,) of str
        The supplied label of each.
    subjects : array (N,) of str, or None
        Who moves; None where that is not known of every clip, or all are of one subject.
    """

    clip_ids: list[str]
    classes: NDArray[np.object_]
    subjects: NDArray[np.object_] | None


def labelled_clips(catalog: Catalog, label_column: str) -> LabelledClips:
    """List the clips that have a label.

    Parameters
    ----------
    catalog : Catalog
        Any; its supplied labels are read, not the names it gave its clusters.
    label_column : str
        The column that holds the classes.

    Raises
    ------
    UserError
        There is no such column, or fewer than two of its labels have two clips; the message says what to do.
    """
    clips = catalog.clips.to_pandas().sort_values("clip_id", ignore_index=True)
    columns = [name for name in clips.columns if name not in TABLES["ingested"].names]
    if label_column not in columns:
        raise UserError(
            f"{catalog.store.url} has no label column {label_column!r}; "
            f"give --label-column one of {', '.join(columns)}"
        )
    clips = clips[clips[label_column].notna() & (clips[label_column] != "")]
    several = [name for name, count in Counter(clips[label_column]).items() if count > 1]
    if len(several) < 2:
        raise UserError(
            f"{len(several)} labels in column {label_column!r} of {catalog.store.url} have two clips, "
            "and a study needs 2: run again with labels (motionary run LIBRARY CATALOG --labels CSV), "
            "or name another column with --label-column"
        )
    subjects = clips["subject"]
    known = bool(subjects.notna().all() and subjects.nunique() > 1)
    return LabelledClips(
        clips["clip_id"].tolist(),
        clips[label_column].to_numpy(object),
        subjects.to_numpy(object) if known else None,
    )


def read_features(
    catalog: Catalog, clips: LabelledClips, features_of: Mapping[str, FeatureOf], advance: Callable[[], None]
) -> dict[str, list[NDArray[np.float32]]]:
    """Compute several features of every clip; a motion is read once and kept no longer than that.

    Parameters
    ----------
    catalog : Catalog
        Where the motions are.
    clips : LabelledClips
        Which of them.
    features_of : mapping of str to callable
        For each kind of feature what computes it.
    advance : callable
        Called after every clip.

    Returns
    -------
    dict of str to list of array (frames, d)
        For each kind the features of all clips.
    """
    features: dict[str, list[NDArray[np.float32]]] = {kind: [] for kind in features_of}
    for clip_id in clips.clip_ids:
        motion = catalog.motion(clip_id)
        for kind, compute in features_of.items():
            features[kind].append(compute(motion))
        advance()
    return features
