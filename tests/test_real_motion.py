"""What must be true on real motion capture. Run with -s to see the figures that each test prints."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.distance import squareform

from motionary.catalog import Catalog
from motionary.pipeline.clustering import complete_linkage, cut_tree, ward_linkage
from motionary.pipeline.config import FeatureConfig, PipelineConfig
from motionary.pipeline.distances import PairwiseDistances, pairwise_distances
from motionary.pipeline.evaluation import (
    adjusted_rand_index,
    best_reward_punish,
    reward_punish,
)
from motionary.pipeline.features import motion_features
from motionary.pipeline.readers import read_motion
from motionary.pipeline.readers.library import scan_library
from motionary.pipeline.retrieval import nearest_neighbour_accuracy
from motionary.pipeline.stages.columns import condensed, condensed_places
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from motionary.workflows.reproduce.combinations import pairs_among
from motionary.workflows.reproduce.draws import draw

DRAWS = 100

WALK_OR_RUN = {
    "walk": "walk",
    "walk-turn-left": "walk",
    "run": "run",
    "run-jog": "run",
    "dash": "run",
    "jogLeftCircle4StepsRstart": "run",
}
"""Labels of the real clips that are a walk or a run under whatever name."""


@pytest.fixture(scope="module")
def hdm05(shared_data) -> tuple[np.ndarray, dict[str, PairwiseDistances]]:
    """Compare the HDM05 clips by both features."""
    sources = scan_library(shared_data / "hdm05")
    labels = pd.read_csv(shared_data / "labels.csv").set_index("path").action
    motions = [read_motion(source.files[0]) for source in sources]
    assert len(motions) == 108
    classes = np.array([labels[f"hdm05/{source.path}"] for source in sources])
    kinds = ("pose+travel", "paper")
    features = {
        kind: [motion_features(motion, FeatureConfig(kind=kind)) for motion in motions] for kind in kinds
    }
    return classes, {kind: pairwise_distances(features[kind]) for kind in kinds}


def test_on_draws_of_hdm05_the_curve_beats_dtw_and_the_default_beats_the_paper(hdm05):
    classes, distances = hdm05
    paper, default = distances["paper"], distances["pose+travel"]
    rows = []
    for number in range(DRAWS):
        chosen = draw(classes, "6-20", 0, number)
        known, kappa, pairs = classes[chosen], len(np.unique(classes)), pairs_among(chosen, len(classes))

        def clusters(linkage, distance, pairs=pairs, kappa=kappa):
            return cut_tree(linkage(distance[pairs]), n_clusters=kappa)

        by_dtw, by_curve = clusters(complete_linkage, paper.dtw), clusters(complete_linkage, paper.weighted)
        best = best_reward_punish(known)
        rows.append(
            {
                "reward-punish / best, paper features, complete: DTW": reward_punish(by_dtw, known) / best,
                "reward-punish / best, paper features, complete: curve": reward_punish(by_curve, known)
                / best,
                "ARI, --paper": adjusted_rand_index(by_curve, known),
                "ARI, default": adjusted_rand_index(clusters(ward_linkage, default.weighted), known),
            }
        )
    means = pd.DataFrame(rows).mean()
    print(f"\n{DRAWS} draws of 6 to 20 clips a class, at the true number of classes:")
    print(means.round(3).to_string())
    dtw, curve, ari_paper, ari_default = means
    assert curve > dtw
    assert ari_default > ari_paper


@pytest.fixture(scope="module")
def everything(shared_data, tmp_path_factory, silent_progress) -> Catalog:
    """Run the main job on all real clips."""
    out = str(tmp_path_factory.mktemp("real") / "catalog")
    return run(
        Job([str(shared_data)], out, PipelineConfig(), shared_data / "labels.csv", 2), silent_progress
    ).catalog


@pytest.mark.slow
def test_all_conventions_in_one_catalog(everything):
    clips = everything.clips.to_pandas()
    assert len(clips) == 270
    assert len(everything.quarantine) == 0
    assert set(clips.convention) == {"cmu-asf", "cmu-bvh", "bandai", "character-creator"}
    assert clips.action.notna().all()


@pytest.mark.slow
def test_the_nearest_clip_of_another_dataset_to_a_walk_or_run_is_one(everything):
    clips = everything.clips.to_pandas()
    gait = clips.action.map(WALK_OR_RUN)
    pairs = everything.pairs.to_arrow()
    places = condensed_places(pairs, everything.clips.to_arrow()["clip_id"])
    square = squareform(condensed(pairs, "weighted", places))
    asked = clips.action.isin(["walk", "run", "run-jog"]).to_numpy()
    # Every clip may answer, only walks and runs ask.
    answers = square.copy()
    for groups, name in ((clips.dataset, "dataset"), (clips.dataset.str.split("-").str[0], "source")):
        other = groups.to_numpy()[:, None] != groups.to_numpy()[None, :]
        nearest = np.where(other, answers, np.inf).argmin(axis=1)[asked]
        walk_or_run = gait.notna().to_numpy()[nearest]
        same_gait = gait.to_numpy()[nearest] == gait.to_numpy()[asked]
        print(
            f"\n1-NN of {asked.sum()} walks and runs in any other {name}: "
            f"a walk or run {walk_or_run.mean():.3f}, the same of the two {same_gait.mean():.3f}"
        )
        assert walk_or_run.mean() > 0.5
    own = nearest_neighbour_accuracy(square, clips.action.to_list())
    print(f"1-NN accuracy over all clips and actions: {own:.3f}")
