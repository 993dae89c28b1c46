"""Experiment of [DC] 6 on a catalog of one's own: which distance, by which linkage, finds the classes.

**[DC]** Yang, Zhao, Hao, Wu, *DTW-Curve for classification of logically similar motions*. The paper has one
set of 80 motions in six classes, three distances and two linkages; here many draws, all distances, the
linkages that are defined on them, and both kinds of features.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from motionary.catalog import Catalog
from motionary.pipeline.config import FeatureKind
from motionary.pipeline.distances import pairwise_distances
from motionary.pipeline.features import motion_features
from motionary.workflows.errors import UserError
from motionary.workflows.progress import Advance
from motionary.workflows.reproduce.combinations import StudiedDistance, studied_distances
from motionary.workflows.reproduce.draws import LEAST, MOST_CLASSES, RULES, drawable_classes
from motionary.workflows.reproduce.labelled import (
    FeatureOf,
    LabelledClips,
    labelled_clips,
    read_features,
)
from motionary.workflows.reproduce.study import Study, run_study

KINDS: tuple[FeatureKind, ...] = ("paper", "pose+travel")

Show = Callable[[Mapping[str, int]], AbstractContextManager[Advance]]


@dataclass(frozen=True, eq=False)
class Experiment:
    """A study, and the clips it was made on."""

    study: Study
    clips: LabelledClips
    notes: list[str]


def study_dtw_curve(catalog: Catalog, label_column: str, draws: int, seed: int, show: Show) -> Experiment:
    """Study every distance, linkage and kind of features on a labelled catalog.

    Parameters
    ----------
    catalog : Catalog
        Its motions are read back and their features made anew, both kinds.
    label_column : str
        The column that holds the classes.
    draws : int
        Sets a rule.
    seed : int
        Of the draws. The same seed gives the same result.
    show : callable
        Shows progress, see `motionary.workflows.progress`.

    Raises
    ------
    UserError
        The catalog has no such labels, or too few classes of enough clips to draw from.
    """
    clips = drawable_clips(catalog, label_column)
    config = catalog.config.features
    features_of: dict[str, FeatureOf] = {
        kind: partial(motion_features, config=replace(config, kind=kind)) for kind in KINDS
    }
    with show(stages(clips, len(KINDS), draws)) as advance:
        features = read_features(catalog, clips, features_of, partial(advance, "read"))
        distances: dict[str, list[StudiedDistance]] = {}
        for kind in KINDS:
            distances[kind] = studied_distances(pairwise_distances(features[kind]))
            advance("compare")
        study = run_study(distances, clips.classes, clips.subjects, draws, seed, partial(advance, "score"))
    return Experiment(study, clips, notes(clips, label_column, draws, seed))


def drawable_clips(catalog: Catalog, label_column: str) -> LabelledClips:
    """List a catalog's labelled clips; raises UserError where no set can be drawn from them."""
    clips = labelled_clips(catalog, label_column)
    enough = drawable_classes(clips.classes)
    if len(enough) < 2:
        raise UserError(
            f"{len(enough)} classes of {catalog.store.url} have {LEAST} clips or more, and a draw needs 2; "
            "label more clips, or name a coarser column with --label-column"
        )
    return clips


def stages(clips: LabelledClips, kinds: int, draws: int) -> dict[str, int]:
    """Count the steps of an experiment, for its progress."""
    return {"read": len(clips.clip_ids), "compare": kinds, "score": len(RULES) * draws + 1}


def notes(clips: LabelledClips, label_column: str, draws: int, seed: int) -> list[str]:
    """Say what was studied, and what the catalog did not allow."""
    enough, every = drawable_classes(clips.classes), len(np.unique(clips.classes.astype(str)))
    largest = max(int((clips.classes == name).sum()) for name in enough)
    said = [
        f"{len(clips.clip_ids)} clips of {every} classes ({label_column}); "
        f"{draws} draws a rule, seed {seed}, of {min(len(enough), MOST_CLASSES)} classes "
        f"among the {len(enough)} that have {LEAST} clips or more (the largest has {largest}). "
        "A class that has fewer clips than a rule asks for gives all it has."
    ]
    if len(enough) < MOST_CLASSES:
        said.append(f"The paper's six classes cannot be had here: {len(enough)} are drawn.")
    if clips.subjects is None:
        said.append("Subjects are not known of every clip: the nearest neighbour is any other clip.")
    else:
        people = len(set(clips.subjects.tolist()))
        said.append(f"The nearest neighbour is the nearest clip of another of {people} subjects.")
    return said
