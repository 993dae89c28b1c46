"""Held-out takes: clusters that do not know them, rules against a slow reference, and the command."""

import json

import numpy as np
import pytest
from scipy.spatial.distance import pdist, squareform

from motionary.catalog import Catalog
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce import assign, assign_trial
from motionary.workflows.reproduce.assign import CLASSES, TAKES, study_assign
from motionary.workflows.reproduce.assign_trial import (
    BOTH,
    FROM_CLIP,
    FROM_REFERENCE,
    MEAN,
    NEAREST,
    REFERENCE,
    KnownClips,
    assign_held_out,
)
from motionary.workflows.reproduce.combinations import StudiedDistance


def known_clips(seed: int, classes: str = "aaaaaabbbbbbcccccc") -> KnownClips:
    """Make clips that are points on a plane, a spot for each class."""
    rng = np.random.default_rng(seed)
    spots = {"a": (0, 0), "b": (4, 0), "c": (0, 4)}
    points = np.array([spots[one] for one in classes]) + rng.normal(size=(len(classes), 2))
    condensed = pdist(points)
    square = squareform(condensed)
    return KnownClips(
        np.array(list(classes), object),
        np.array([f"{one:02}" for one in rng.permutation(len(classes))], object),
        StudiedDistance("weighted", condensed),
        square,
        square,
        [rng.normal(size=(12, 57)).astype(np.float32) for _ in classes],
        PipelineConfig(),
    )


@pytest.mark.parametrize("seed", range(5))
def test_rules_and_reaches_as_by_hand(monkeypatch, seed):
    clips = known_clips(seed)
    held_out = np.array([1, 7, 13])
    kept = np.setdiff1d(np.arange(18), held_out)
    made = {}
    for name in ("_clusters", "_references"):
        compute = getattr(assign_trial, name)

        def remember(*arguments, name=name, compute=compute):
            made[name] = compute(*arguments)
            return made[name]

        monkeypatch.setattr(assign_trial, name, remember)
    outcomes = {(one.rule, one.reach): one for one in assign_held_out(clips, kept, held_out)}
    cluster_of, references = made["_clusters"], made["_references"]
    distance = squareform(clips.distance.key)
    members = {k: [kept[i] for i in range(len(kept)) if cluster_of[i] == k] for k in set(cluster_of.tolist())}
    reference = {k: kept[references[k]] for k in members}
    assert all(reference[k] in members[k] for k in members)
    usual = 1.5 * np.quantile([min(distance[i, j] for j in kept if j != i) for i in kept], 0.95)
    for place, take in enumerate(held_out):
        choices = {
            NEAREST: min(members, key=lambda k: min(distance[take, i] for i in members[k])),
            REFERENCE: min(members, key=lambda k: distance[take, reference[k]]),
            MEAN: min(members, key=lambda k: np.mean([distance[take, i] for i in members[k]])),
        }
        for rule, k in choices.items():
            called = [clips.classes[i] for i in members[k]]
            name = max(sorted(set(called)), key=called.count)
            furthest = max(distance[i, reference[k]] for i in members[k])
            near = distance[take, reference[k]] <= 1.5 * furthest
            found = outcomes[rule, FROM_REFERENCE]
            assert found.right[place] == (name == clips.classes[take])
            assert found.within[place] == near
            assert found.confidence[place] == pytest.approx(called.count(name) / (len(called) + 1))
            if rule == NEAREST:
                like = min(distance[take, i] for i in kept) <= usual
                assert outcomes[rule, FROM_CLIP].within[place] == like
                assert outcomes[rule, BOTH].within[place] == (near and like)


def test_what_is_held_out_is_not_known():
    clips = known_clips(0)
    held_out = np.flatnonzero(clips.classes == "c")
    for outcome in assign_held_out(clips, np.flatnonzero(clips.classes != "c"), held_out):
        assert not outcome.known.any()
        assert not outcome.right.any()


def test_folds_hold_every_clip_out_once_and_part_no_copies():
    digests = np.array([f"{one // 2}" for one in range(30)], object)
    folds = list(assign._folds(digests, 3, 0))
    assert len(folds) == 15
    for draw in range(3):
        some = folds[5 * draw : 5 * draw + 5]
        assert sorted(np.concatenate(some).tolist()) == list(range(30))
        assert all(set(fold.tolist()) == {one ^ 1 for one in fold.tolist()} for fold in some)
    assert [one.tolist() for one in folds] == [one.tolist() for one in assign._folds(digests, 3, 0)]
    assert [one.tolist() for one in folds] != [one.tolist() for one in assign._folds(digests, 3, 1)]


def test_the_embedded_library(demo_catalog, silent_progress):
    experiment = study_assign(Catalog.open(demo_catalog), "action", 1, 0, silent_progress)
    share = experiment.study.share
    assert share("tested", "all", TAKES, NEAREST) == 80
    assert share("right", "all", TAKES, NEAREST) > 0.85
    assert np.isnan(share("right", "all", CLASSES, NEAREST))
    assert share("assigned", "all", TAKES, NEAREST, BOTH) > 0.9
    assert share("assigned", "all", CLASSES, NEAREST, BOTH) < 0.2
    again = study_assign(Catalog.open(demo_catalog), "action", 1, 0, silent_progress)
    assert again.study.rows.equals(experiment.study.rows)


def test_the_command(motionary, demo_catalog):
    code, out, err = motionary("reproduce", "assign", demo_catalog, "--draws", "1")
    assert code == 0, err
    assert "80 clips of 8 classes (action); 1 times parted into 5 folds" in out
    code, out, _ = motionary("reproduce", "assign", demo_catalog, "--draws", "1", "--format", "json")
    rows = json.loads(out)
    assert {row["held_out"] for row in rows} == {"takes", "subjects", "classes"}
    assert {row["rule"] for row in rows} == {NEAREST, REFERENCE, MEAN}


def test_too_few_clips(demo_catalog, silent_progress, monkeypatch):
    monkeypatch.setattr(assign, "FOLDS", 50)
    with pytest.raises(UserError, match="too few"):
        study_assign(Catalog.open(demo_catalog), "action", 1, 0, silent_progress)
