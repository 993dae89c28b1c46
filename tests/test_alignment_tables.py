"""What a run tells of its alignments and styles, and the settings that lead there."""

import numpy as np
import pytest

from motionary.catalog import Catalog
from motionary.pipeline.config import AlignmentConfig
from motionary.pipeline.stages.align import align
from motionary.pipeline.style import residuals
from motionary.workflows.settings import SettingsError, load_settings


@pytest.fixture(scope="module")
def demo(demo_catalog):
    return Catalog.open(demo_catalog)


def aligned_with(demo, **settings):
    """Align the demo's clips anew by other settings."""
    reference_features = demo.sql(
        """select r.cluster_id, f.clip_id, f.feature from features f join "references" r using (clip_id)
           order by r.cluster_id, f.frame"""
    )
    batch = ["walk/walk_tired_alex_01.bvh", "jump/jump_neutral_alex_01.bvh"]
    known = demo.clips.to_pandas()["clip_id"]
    batch = [clip for clip in batch if clip in set(known)] or known.tolist()[:2]
    ids = ", ".join(f"'{one}'" for one in batch)
    clips, frames, features = (
        demo.sql(f"select * from {table} where clip_id in ({ids}) order by clip_id{order}")
        for table, order in (("clips", ""), ("frames", ", frame"), ("features", ", frame"))
    )
    config = AlignmentConfig(**settings)
    made = align(clips, frames, features, demo.clusters.to_arrow(), reference_features, config, 30.0)
    return made["alignments"].to_pylist()


def test_alignments_are_never_worse_than_length_matching(demo):
    rows = demo.alignments.to_pandas()
    assert len(rows) == len(demo.clips)
    assert (rows["correlation"] >= rows["correlation_before"]).all()
    assert rows["correlation"].mean() > rows["correlation_before"].mean() + 0.05
    assert (rows["distortion"] >= 0).all()
    assert (rows["first_frame"] == 0).all()
    for row in rows.itertuples():
        assert len(row.nodes) == len(row.eta) + 1
        assert sum(row.eta) == 0
        assert max(map(abs, row.eta)) <= row.slack <= max(row.segment_length - 4, 0)
        assert (np.diff(row.source_time) > 0).all()


def test_styles_are_what_is_left_of_the_aligned_clips(demo):
    rows = demo.styles.to_arrow().to_pylist()
    assert [row["clip_id"] for row in rows] == demo.clips.to_arrow()["clip_id"].to_pylist()
    regions = ("root", "torso", "head", "arms", "legs")
    by_cluster = {}
    for row in rows:
        by_cluster.setdefault(row["cluster_id"], []).append(row)
        assert row["energy"] == pytest.approx(sum(row[f"energy_{one}"] for one in regions))
        assert row["energy"] == pytest.approx(sum(row["joint_energy"]), rel=1e-5)
        assert len(row["joints"]) == len(row["joint_energy"])
        assert (row["energy"] < 1e-9) == (row["clip_id"] == row["reference_id"])
        assert row["explained"] == sorted(row["explained"], reverse=True)
        assert sum(row["explained"]) <= 1 + 1e-6
    for members in by_cluster.values():
        assert len({row["kind"] for row in members}) == 1
        assert len({tuple(row["explained"]) for row in members}) == 1
        scores = np.array([row["scores"] for row in members])
        np.testing.assert_allclose(scores.mean(axis=0), 0, atol=1e-4)


def test_a_styles_row_is_the_residual_of_the_catalogs_motions(demo):
    row = next(row for row in demo.styles.to_arrow().to_pylist() if row["clip_id"] != row["reference_id"])
    motions = [demo.aligned(row["clip_id"]), demo.aligned(row["reference_id"])]
    found = residuals(motions[:1], motions[1], kind=row["kind"])[0]
    np.testing.assert_allclose(list(found.joint_energy.values()), row["joint_energy"], rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(list(found.root_energy.values()), row["travel_energy"], rtol=1e-4, atol=1e-7)


def test_settings_reach_the_alignment(demo):
    usual = aligned_with(demo)
    assert usual == aligned_with(demo, search="full")  # the demo's references are short
    for row in aligned_with(demo, segments=2):
        assert len(row["eta"]) == 2
        assert row["slack"] == row["segment_length"] - 4
    for row in aligned_with(demo, segment_length=1000, slack=5):
        assert row["eta"] == [0]
        assert row["correlation"] == pytest.approx(row["correlation_before"])
    for row in aligned_with(demo, segment_length=11, slack=2):
        assert (row["segment_length"], row["slack"]) == (11, 2)
        assert row["nodes"][:-1] == [11 * k for k in range(len(row["eta"]))]
        assert max(map(abs, row["eta"])) <= 2
    assert {row["slack"] for row in aligned_with(demo, segment_length=11, slack=0)} == {0}
    legs, arms = aligned_with(demo, weights="legs"), aligned_with(demo, weights={"wrist": 1, "elbow": 0.5})
    assert [row["correlation_before"] for row in legs] != [row["correlation_before"] for row in arms]
    assert [row["source_time"] for row in aligned_with(demo, alpha=0)] != [
        row["source_time"] for row in aligned_with(demo, alpha=5)
    ]


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"weights": "hands"}, "no preset 'hands'; there are full, legs, arms"),
        ({"weights": {"tail": 1}}, "no joint 'tail' to weigh"),
        ({"weights": {"knee": 0}}, "are all 0; weigh at least one joint"),
        ({"segment_length": 10, "segments": 3}, "are both given; give one"),
        ({"slack": 3}, "given alone; give segment_length or segments too"),
        ({"segment_length": 10, "slack": 7}, "slack may be at most segment_length - 4 = 6"),
        ({"search": "all"}, "search"),
        ({"spacing": "even"}, "spacing"),
        ({"alpha": -1}, "alpha is -1.0; it must be at least 0 and finite"),
        ({"alpha": float("inf")}, "alpha is inf"),
    ],
)
def test_a_setting_that_cannot_be_is_named(settings, problem):
    with pytest.raises(SettingsError, match=problem):
        load_settings(None, {"alignment": settings})


def test_weights_come_from_a_file(tmp_path):
    file = tmp_path / "motionary.toml"
    file.write_text("[alignment]\nopen_ends = true\n[alignment.weights]\nknee = 1\nleft_ankle = 0.5\n")
    config = load_settings(file, {}).alignment
    assert config.weights == {"knee": 1.0, "left_ankle": 0.5}
    assert config.open_ends
