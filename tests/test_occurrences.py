"""Short motions found in long takes: with times, several times a take, and not in themselves."""

import itertools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from motionary.catalog import Catalog
from motionary.catalog.errors import CatalogError
from motionary.catalog.occurrences import occurrences
from motionary.pipeline.config import FeatureConfig, PipelineConfig
from motionary.pipeline.distances.subsequence import find_occurrences, pack_takes
from motionary.pipeline.features import at_rate, frame_features, merged
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import SyntheticTake, synthetic_library
from motionary.pipeline.writers.bvh import write_bvh
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

FPS = 60.0
QUERIES = ("kick", "jump", "squat", "throw")


@dataclass(frozen=True)
class LongTakes:
    """A catalog of long takes, and of a short one of each action by others; what is where, in seconds."""

    catalog: Catalog
    library: Path
    truth: pd.DataFrame


def joined(motions: list[Motion], name: str) -> Motion:
    """Perform motions of one skeleton and rate one after another, each from where the last one ended."""
    places, end = [], None
    for motion in motions:
        place = motion.root_position.copy()
        if end is not None:
            place[:, [0, 2]] += end - place[0, [0, 2]]
        places.append(place)
        end = place[-1, [0, 2]]
    rotations = np.concatenate([motion.rotations for motion in motions])
    return replace(motions[0], name=name, root_position=np.concatenate(places), rotations=rotations)


def still(motion: Motion, frames: int) -> Motion:
    """Hold a motion's first pose."""
    return motion.sampled(np.zeros(frames))


def write(library: Path, motion: Motion) -> None:
    write_bvh(motion, library / f"{motion.name}.bvh")


@pytest.fixture(scope="module")
def long_takes(tmp_path_factory, silent_progress) -> LongTakes:
    library = tmp_path_factory.mktemp("long") / "library"
    library.mkdir()
    by_body: dict[str, list[SyntheticTake]] = {}
    for take in synthetic_library():
        if not take.is_mirrored:
            by_body.setdefault(f"{take.subject}-{take.convention}", []).append(take)
    short = {take.action: take for take in by_body["emil-mixamo"] + by_body["dora-cmu-bvh"]}
    truth = []
    for body in ("alex-cmu-bvh", "alex-mixamo", "bea-mixamo", "emil-cmu-bvh"):
        motions = [at_rate(take.motion, FPS) for take in by_body[body]]
        starts = np.cumsum([0, *(motion.frames for motion in motions)]) / FPS
        for take, (start, end) in zip(by_body[body], itertools.pairwise(starts), strict=True):
            truth.append({"clip_id": f"{body}.bvh", "action": take.action, "start": start, "end": end})
        write(library, joined(motions, body))
    kick = at_rate(by_body["alex-mixamo"][5].motion, FPS)
    write(library, joined([still(kick, 300), kick], "rest-and-kick"))
    for action in QUERIES:
        write(library, replace(at_rate(short[action].motion, FPS), name=action))
    url = str(library.parent / "catalog")
    run(Job([str(library)], url, PipelineConfig()), silent_progress)
    return LongTakes(Catalog.open(url), library, pd.DataFrame(truth))


@pytest.mark.parametrize("action", QUERIES)
def test_every_performance_in_the_long_takes_is_found_before_anything_else(long_takes, action):
    truth = long_takes.truth[long_takes.truth.action == action]
    found = occurrences(long_takes.catalog, f"{action}.bvh", len(truth), takes=[*truth.clip_id.unique()])
    matched = found.to_pandas().sort_values(["clip_id", "start_seconds"])
    assert matched.clip_id.tolist() == truth.clip_id.tolist()
    assert matched.start_seconds.to_numpy() == pytest.approx(truth.start.to_numpy(), abs=0.4)
    assert matched.end_seconds.to_numpy() == pytest.approx(truth.end.to_numpy(), abs=0.4)


def test_rows_are_ranked_and_times_are_those_of_the_frames_as_captured(long_takes):
    found = occurrences(long_takes.catalog, "kick.bvh", 7)
    table = found.to_pandas()
    assert table["rank"].tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert table.distance.is_monotonic_increasing
    assert table.start_frame.tolist() == (table.start_seconds * FPS).round().astype(int).tolist()
    assert table.end_frame.tolist() == (table.end_seconds * FPS).round().astype(int).tolist()
    lasts = long_takes.catalog.clips.to_pandas().set_index("clip_id").frames[table.clip_id] - 1
    assert (table.end_frame.to_numpy() <= lasts.to_numpy()).all()
    assert all(field.metadata[b"meaning"] for field in found.to_arrow().schema)


def test_a_long_rest_is_not_part_of_the_occurrence(long_takes):
    """Five seconds at rest, one merged frame, come before the kick; the query rests for less."""
    rest = occurrences(long_takes.catalog, "kick.bvh", 1, takes=["rest-and-kick.bvh"]).to_pandas()
    assert rest.start_seconds[0] == pytest.approx(5, abs=0.4)


def test_a_clip_is_not_looked_for_in_itself_unless_it_is_named(long_takes):
    by_default = occurrences(long_takes.catalog, "kick.bvh", 50)
    assert "kick.bvh" not in by_default.to_pandas().clip_id.tolist()
    clips = len(long_takes.catalog.clips)
    assert by_default.searched + by_default.pruned + by_default.too_short == clips - 1
    itself = occurrences(long_takes.catalog, "kick.bvh", 1, takes="kick.bvh").to_pandas()
    seconds = long_takes.catalog.motion("kick.bvh").seconds
    assert itself[["distance", "start_seconds", "start_frame"]].iloc[0].tolist() == [0, 0, 0]
    assert itself.end_seconds[0] == pytest.approx(seconds, abs=1 / 30)


def test_a_file_finds_what_the_clip_does(long_takes, tmp_path):
    write_bvh(long_takes.catalog.motion("kick.bvh"), tmp_path / "kick.bvh")
    of_file = occurrences(long_takes.catalog, tmp_path / "kick.bvh", 1)
    assert of_file.query == str(tmp_path / "kick.bvh")
    assert of_file.table["clip_id"].to_pylist() == ["kick.bvh"]
    assert of_file.table["distance"][0].as_py() == pytest.approx(0, abs=1e-5)


def test_takes_too_short_for_the_query_are_counted_and_give_nothing(long_takes):
    found = occurrences(long_takes.catalog, "alex-cmu-bvh.bvh", 5, takes=["kick.bvh", "jump.bvh"])
    assert (len(found), found.searched, found.pruned, found.too_short) == (0, 0, 0, 2)
    assert found.table.schema.names[:2] == ["rank", "clip_id"]


def test_over_some_joints_alone(long_takes):
    """A kick with other arms is the same kick for the legs."""
    by_legs = occurrences(
        long_takes.catalog, "kick.bvh", 4, takes=["alex-cmu-bvh.bvh"], joints="legs"
    ).to_pandas()
    by_arms = occurrences(
        long_takes.catalog, "kick.bvh", 4, takes=["alex-cmu-bvh.bvh"], joints="arms"
    ).to_pandas()
    kicks = long_takes.truth.query("clip_id == 'alex-cmu-bvh.bvh' and action == 'kick'")
    assert sorted(by_legs.start_seconds[:2]) == pytest.approx(kicks.start.tolist(), abs=0.4)
    assert by_legs.distance.tolist() != by_arms.distance.tolist()


def test_shows_itself(long_takes):
    found = occurrences(long_takes.catalog, "kick.bvh", 2, takes=["alex-mixamo.bvh"])
    assert repr(found) == "<2 occurrences of kick.bvh: 1 take searched, 0 ruled out, 0 too short>"
    assert "alex-mixamo.bvh" in found._repr_html_()


def test_says_what_is_wrong(long_takes):
    catalog = long_takes.catalog
    with pytest.raises(CatalogError, match=r"no clip 'alex-mixamo'.*did you mean alex-mixamo.bvh"):
        occurrences(catalog, "kick.bvh", takes=["alex-mixamo"])
    with pytest.raises(CatalogError, match="neither a clip of"):
        occurrences(catalog, "kick")
    with pytest.raises(ValueError, match="k is 0"):
        occurrences(catalog, "kick.bvh", 0)
    with pytest.raises(ValueError, match="no joint 'tail'"):
        occurrences(catalog, "kick.bvh", joints=["tail"])


def real_features(file: Path) -> np.ndarray:
    return frame_features(read_motion(file), FeatureConfig()).values


@pytest.mark.slow
def test_ten_hops_of_a_real_take_are_found_in_each_of_its_three_recordings(shared_data):
    """The hop is of another library. Where its pelvis is highest the take has ten; it was exported twice, and
    once more on another body.
    """
    hop = real_features(shared_data / "hdm05" / "HDM_bk_hopBothLegs1hops_013_120.amc")
    query = merged(hop, FeatureConfig())
    captured = read_motion(shared_data / "pairs" / "01_01.amc")
    height = captured.root_position[:, 1]
    tops = [
        np.argmax(height[start:end]) + start
        for start, end in runs(height > np.median(height) + 0.5 * (height.max() - np.median(height)))
    ]
    assert len(tops) == 10
    for name in ("01_01.amc", "01_01.bvh", "001_01.bvh"):
        take = merged(real_features(shared_data / "pairs" / name), FeatureConfig())
        found = find_occurrences(query.values, pack_takes([take.values]), 12)
        spans = sorted(zip(take.first[found.first[:10]], take.last[found.last[:10]], strict=True))
        for top, (start, end) in zip(tops, spans, strict=True):
            assert start / 30 <= top / captured.fps <= end / 30 + 0.2
        hops, others = found.distance[:10].round(3), found.distance[10:].round(3)
        print(f"\n{name}: the ten hops {hops}, what comes next {others}")
        assert found.distance[10] > 1.2 * found.distance[9]


def runs(chosen: np.ndarray) -> list[tuple[int, int]]:
    """Where something is so, from and until."""
    edges = np.flatnonzero(np.diff(chosen.astype(int), prepend=0, append=0))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


@pytest.mark.slow
def test_itakuras_steps_find_more_than_dtw_with_open_ends(shared_data):
    """Every HDM05 clip of one actor, looked for in a long take of each other actor's clips."""
    labels = pd.read_csv(shared_data / "labels.csv").set_index("path")
    clips = labels[labels.index.str.startswith("hdm05/")]
    features = {path: real_features(shared_data / path) for path in clips.index}
    figures = []
    for subject, theirs in clips.groupby("subject"):
        take, spans = one_after_another(
            [features[path] for path in theirs.sample(frac=1, random_state=0).index]
        )
        actions = theirs.sample(frac=1, random_state=0).action.to_numpy()
        for path, clip in clips[clips.subject != subject].iterrows():
            truth = [span for span, action in zip(spans, actions, strict=True) if action == clip.action]
            query = merged(features[path], FeatureConfig()).values
            if truth:
                figures += [
                    {"steps": steps, **scores(found, take, truth, len(features[path]))}
                    for steps, found in (
                        ("Itakura's", by_itakura(query, take.values, len(truth))),
                        ("DTW with open ends", by_open_dtw(query, take.values, len(truth))),
                    )
                ]
    table = (
        pd.DataFrame(figures)
        .groupby("steps")
        .agg(
            searches=("found", "size"),
            found=("found", "mean"),
            first_is_right=("first", "mean"),
            shortest_tenth=("shortest", lambda shortest: shortest.quantile(0.1)),
        )
    )
    print(f"\n{table.round(3).to_string()}")
    itakura, rival = table.loc["Itakura's"], table.loc["DTW with open ends"]
    assert itakura.found > rival.found + 0.1
    assert itakura.shortest_tenth > 0.5 > rival.shortest_tenth


def one_after_another(parts: list[np.ndarray], between: int = 10):
    """Join features by a third of a second of blending; return them merged, and where each part is."""
    pieces, spans, at = [], [], 0
    for part in parts:
        if pieces:
            share = np.linspace(0, 1, between + 2)[1:-1, None]
            pieces.append((pieces[-1][-1] * (1 - share) + part[0] * share).astype(np.float32))
            at += between
        spans.append((at, at + len(part) - 1))
        pieces.append(part)
        at += len(part)
    return merged(np.concatenate(pieces), FeatureConfig()), spans


def scores(found, take, truth, frames):
    """Share of the true spans found, whether the first is one of them, the shortest's part of the query."""
    spans = [(take.first[first], take.last[last]) for first, last in found]
    hits = [{span for span in truth if 2 * common(span, one) >= union(span, one)} for one in spans]
    return {
        "found": len(set().union(*hits)) / len(truth),
        "first": bool(hits[0]),
        "shortest": min(last - first + 1 for first, last in spans) / frames,
    }


def common(a, b):
    return max(0, min(a[1], b[1]) - max(a[0], b[0]) + 1)


def union(a, b):
    return a[1] - a[0] + 1 + b[1] - b[0] + 1 - common(a, b)


def by_itakura(query, take, k):
    found = find_occurrences(query, pack_takes([take]), k)
    return list(zip(found.first.tolist(), found.last.tolist(), strict=True))


def by_open_dtw(query, take, k):
    """The least average at the ends of paths of least (total, cells), then what shares no frame with it."""
    cost = np.linalg.norm(query[:, None].astype(np.float64) - take[None], axis=-1)
    found: list[tuple[int, int]] = []
    candidates: list[tuple[float, int, int, int, int]] = []
    pieces = [(0, len(take) - 1)]
    while len(found) < k:
        for left, right in pieces:
            if left <= right:
                best = least_average(cost[:, left : right + 1])
                candidates.append((best[0], left + best[1], left + best[2], left, right))
        best = min(candidates)
        candidates.remove(best)
        _, first, last, left, right = best
        found.append((first, last))
        pieces = [(left, first - 1), (last + 1, right)]
    return found


def least_average(cost):
    """(average, first, last) by DTW that begins and ends anywhere in the columns."""
    above = [(value, 1, start) for start, value in enumerate(cost[0].tolist())]
    for row in cost[1:].tolist():
        here = []
        for column, value in enumerate(row):
            total, cells, start = min([above[column], *above[max(0, column - 1) : column], *here[-1:]])
            here.append((total + value, cells + 1, start))
        above = here
    return min((total / cells, start, end) for end, (total, cells, start) in enumerate(above))
