"""The FP-DTW experiment: which takes are paired, measures against slow ones, verdicts on made-up medians."""

import io

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from scipy.spatial.transform import Rotation
from scipy.stats import kendalltau

from motionary.catalog import Catalog
from motionary.pipeline.alignment.online import OnlineAligner
from motionary.pipeline.alignment.rotation_costs import rotation_costs
from motionary.pipeline.joint_rotations import FP_JOINTS
from motionary.pipeline.synthetic import ACTIONS, STYLES
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce import fp_dtw as experiment
from motionary.workflows.reproduce import fp_dtw_clips, fp_dtw_measures
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.fp_dtw import study_fp_dtw
from motionary.workflows.reproduce.fp_dtw_claims import PASS_BOTH, claims, improved, passing
from motionary.workflows.reproduce.fp_dtw_clips import (
    RATES,
    Takes,
    catalog_takes,
    draw_pairs,
    embedded_takes,
    read_take,
)
from motionary.workflows.reproduce.fp_dtw_measures import (
    ALGORITHMS,
    DTW,
    UTW,
    Algorithm,
    Alignment,
    FpStudy,
    measure_pair,
)
from motionary.workflows.reproduce.fp_dtw_report import TABLE_1, TABLE_2, fp_dtw_report

FEW = (
    Algorithm("A", 2, False),
    Algorithm("B", 10, False),
    Algorithm("C", 10, False),
    Algorithm("C", 10, True),
)


class Clips:
    """A catalog of nothing but a table of clips."""

    class store:
        url = "here"

    def __init__(self, rows: list[tuple]):
        names = ["clip_id", "action", "fps", "format", "joints"]
        self.table = pd.DataFrame(rows, columns=names)
        self.table["skeleton"] = [{"joints": list(joints)} for joints in self.table.pop("joints")]
        self.table["subject"] = None
        self.config = type("Config", (), {"features": type("Features", (), {"conventions": ()})})
        self.motion = None

    @property
    def clips(self):
        return self

    def to_pandas(self) -> pd.DataFrame:
        return self.table.copy()


def test_takes_that_were_recorded_too_slowly_are_left_out():
    rows = [
        ("p", "walk", 120.0, "asf/amc", "ab"),
        ("q", "walk", 119.999, "asf/amc", "ab"),
        ("r", "walk", 60.0, "bvh", "ab"),
        ("s", "walk", 120.0, "c3d", "ab"),
        ("t", "walk", 120.0, "bvh", "abc"),
        ("u", "run", 30.0, "bvh", "ab"),
        ("v", "run", 120.0, "bvh", "ab"),
    ]
    takes = catalog_takes(Clips(rows), "action")
    assert takes.groups == {("walk", ("a", "b")): ["p", "q"]}
    assert takes.rates == (120, 60)
    assert takes.note == (
        "2 of 7 labelled clips, of 1 actions (action), recorded at 120 frames a second or more; left out: "
        "1 recorded at 30, 1 recorded at 60, 1 of markers, 2 alone in their action and skeleton."
    )


def test_where_nothing_is_faster_only_60_frames_a_second_are_tested():
    rows = [(name, "ab"[i % 2], 60.0, "bvh", "ab") for i, name in enumerate("pqrs")]
    takes = catalog_takes(Clips(rows), "action")
    assert takes.rates == (60,)
    assert list(takes.groups.values()) == [["p", "r"], ["q", "s"]]
    with pytest.raises(UserError, match="no action .* 60 frames a second or more"):
        catalog_takes(Clips([(*row[:2], 30.0, *row[3:]) for row in rows]), "action")


def test_pairs_are_ordered_of_one_action_and_one_skeleton():
    groups = {("a", ("x",)): ["a1", "a2", "a3"], ("a", ("y",)): ["a4", "a5"], ("b", ("x",)): ["b1", "b2"]}
    takes = Takes(groups, RATES, lambda name: None, (), "")
    every = draw_pairs(takes, 99, 0)
    inside = {(one, other) for one in groups["a", ("x",)] for other in groups["a", ("x",)] if one != other}
    assert set(every["a"]) == inside | {("a4", "a5"), ("a5", "a4")}
    assert len(every["a"]) == 8
    assert sorted(every["b"]) == [("b1", "b2"), ("b2", "b1")]
    few = draw_pairs(takes, 3, 0)
    assert few["a"] == every["a"][:3]
    assert any(draw_pairs(takes, 3, seed)["a"] != few["a"] for seed in range(1, 5))


@pytest.fixture(scope="module")
def kick_takes() -> Takes:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fp_dtw_clips, "ACTIONS", {"kick": ACTIONS["kick"]})
        return embedded_takes(0)


def test_embedded_takes_are_performed_at_the_rate(kick_takes, monkeypatch):
    takes = kick_takes
    ((action, names),) = [(action, names) for (action, _), names in takes.groups.items()]
    assert (action, len(names)) == ("kick", 2 * len(STYLES))
    name = names[0]
    assert takes.motion(name).fps == 120
    clips = read_take(takes, name)
    np.testing.assert_allclose(clips[60].rotations, clips[120].rotations[::2], atol=1e-12)
    monkeypatch.setattr(fp_dtw_clips, "ACTIONS", {"kick": ACTIONS["kick"]})
    monkeypatch.setattr(fp_dtw_clips, "EMBEDDED_TAKES", 1)
    same, other = (embedded_takes(seed).motion(name).rotations for seed in (0, 1))
    np.testing.assert_array_equal(same, takes.motion(name).rotations)
    assert not np.array_equal(other[:9], same[:9])


@pytest.fixture(scope="module")
def kicks(kick_takes):
    (names,) = kick_takes.groups.values()
    return [read_take(kick_takes, name)[60] for name in names[:2]]


def test_a_pair_is_measured_by_every_algorithm(kicks):
    moving, reference = kicks
    rows = {row.algorithm: row for row in measure_pair(60, "kick", ("m", "r"), moving, reference, FEW)}
    assert list(rows) == [UTW, DTW, "Ma", "Mb w10", "Mc w10", "Mc w10 + Type V"]
    even = np.arange(len(reference.rotations)) * (len(moving.rotations) - 1) / (len(reference.rotations) - 1)
    best = _slow_dtw_times(rotation_costs(moving.rotations, reference.rotations))
    assert rows[UTW].deviation == pytest.approx(np.abs(even - best).mean(), abs=1e-9)
    assert rows[UTW].ahead == pytest.approx((even - best).mean(), abs=1e-9)
    assert rows[DTW].deviation == rows[DTW].ahead == 0
    aligner = OnlineAligner(moving.rotations, "C", 10)
    shown = np.array([aligner.push(frame) for frame in reference.rotations])
    assert rows["Mc w10"].deviation == pytest.approx(np.abs(shown - best).mean(), abs=1e-9)
    taus = []
    for joint in range(len(FP_JOINTS)):
        tracks = [
            Rotation.from_quat(clip.rotations[:, joint]).apply(clip.directions[joint]) for clip in kicks
        ]
        for axis in range(3):
            if np.ptp(tracks[1][:, axis]) > 1e-9:
                taus.append(kendalltau(tracks[0][shown, axis], tracks[1][:, axis]).statistic)
    assert rows["Mc w10"].similarity == pytest.approx(np.nan_to_num(taus).mean())
    assert rows[DTW].similarity > rows[UTW].similarity
    assert rows["Mc w10"].microseconds > 0
    assert rows[UTW].microseconds is None


def _slow_dtw_times(costs):
    """Mean frame of the moving clip at each frame of the other, on the cheapest path, cell by cell."""
    m, n = costs.shape
    total = np.full((m + 1, n + 1), np.inf)
    total[0, 0] = 0
    for i in range(m):
        for k in range(n):
            total[i + 1, k + 1] = costs[i, k] + min(total[i, k], total[i, k + 1], total[i + 1, k])
    i, k, joined = m, n, {}
    while i and k:
        joined.setdefault(k - 1, []).append(i - 1)
        i, k = min(((i - 1, k - 1), (i - 1, k), (i, k - 1)), key=lambda cell: total[cell])
    return np.array([np.mean(joined[k]) for k in range(n)])


def test_the_time_is_in_microseconds_a_live_frame(kicks, monkeypatch):
    clock = iter([10.0, 10.5])
    monkeypatch.setattr(fp_dtw_measures, "perf_counter", lambda: next(clock))
    row = measure_pair(60, "kick", ("m", "r"), *kicks, FEW[:1])[-1]
    assert row.microseconds == pytest.approx(500_000 / len(kicks[1].rotations))


def test_a_copy_is_as_alike_as_can_be(kicks):
    rows = measure_pair(60, "kick", ("m", "m"), kicks[0], kicks[0], FEW[:1])
    for row in rows:
        assert row.similarity == pytest.approx(1)
        assert row.deviation == pytest.approx(0, abs=1e-9)


def made_up(rate: int, **changes: tuple[float, float]) -> list[Alignment]:
    """Every algorithm, below both marks but where `changes` says otherwise; UTW's similarity is .5."""
    rows = [
        Alignment(rate, "a", "m", "r", UTW, 0.5, 30.0, 0.0, None),
        Alignment(rate, "a", "m", "r", DTW, 0.9, 0.0, 0.0, None),
    ]
    for one in map(str, ALGORITHMS):
        similarity, deviation = changes.get(one, (0.4, 40.0))
        rows.append(Alignment(rate, "a", "m", "r", one, similarity, deviation, -1.0, 10.0))
    return rows


def test_marks_are_utws_similarity_and_150_milliseconds():
    changes = {"Mc w40": (0.6, 17.9), "Ma": (0.5, 18.0), "Mb w10": (0.51, 19.0), "Mb w20": (0.1, 17.0)}
    passed = passing(FpStudy(made_up(120, **changes)), 120)
    assert UTW not in passed.index
    assert DTW not in passed.index
    assert passed.index[passed.all(axis=1)].tolist() == ["Mc w40"]
    assert passed.index[passed.similarity].tolist() == ["Mb w10", "Mc w40"]
    assert passed.index[passed.deviation].tolist() == ["Mb w20", "Mc w40"]
    slower = passing(FpStudy(made_up(60, **{"Ma": (0.6, 9.0), "Mc w10": (0.6, 8.9)})), 60)
    assert slower.index[slower.all(axis=1)].tolist() == ["Mc w10"]


def test_type_v_improves_what_it_brings_nearer_to_both():
    changes = {"Ma + Type V": (0.5, 30.0), "Mb w10 + Type V": (0.5, 40.0), "Mc w80 + Type V": (0.41, 39.0)}
    assert improved(FpStudy(made_up(120, **changes)), 120) == ["Ma", "Mc w80"]


def test_the_tables_are_the_papers():
    assert [list(row.values()) for row in TABLE_1.values()] == [
        [0.133, 0.281, 0.178, 0.068, 0.242], [0.053, 0.200, 0.285, 0.146, 0.240]
    ]  # fmt: skip
    assert [list(row) for row in TABLE_1.values()] == [["Mc w10", "Mc w20", "Mc w40", "Mc w80", UTW]] * 2
    assert list(TABLE_1) == [60, 120]
    assert [TABLE_2[f"Mb w{window}"] for window in (10, 20, 40, 80)] == [856, 1654, 4806, 16945]
    assert [TABLE_2[f"Mc w{window}"] for window in (10, 20, 40, 80)] == [782, 1583, 4764, 10106]


SKIPS = 2.0


def as_published(**changes: tuple[float, float]) -> list[Alignment]:
    """Medians with the paper's Table 1, passing as it says; of C at 80 frames the warp runs ahead."""
    fast = {name: (value + 0.26, 40.0) for name, value in TABLE_1[120].items()}
    fast |= {"Mc w40": (0.545, 17.0)} | {f"Mb w{w}": (0.3 + w / 1000, 100.0 - w) for w in (10, 20, 40, 80)}
    fast |= {f"{name} + Type V": (0.45, 19.0) for name in fast if name.startswith("Mb")}
    fast |= {"Ma": (0.312, 95.0), "Ma + Type V": (0.55, 16.0), "Mc w80 + Type V": (0.6, 17.0)}
    slow = {name: (value + 0.258, 40.0) for name, value in TABLE_1[60].items()}
    rows = made_up(120, **(fast | changes)) + made_up(60, **slow)
    return [row._replace(ahead=SKIPS) if row.algorithm == "Mc w80" else row for row in rows]


CLAIMS = {
    "Mc w40 alone": 0, "pass both marks": 1, "among the worst": 2, "at 120": 3, "at 60": 4,
    "goes on improving": 5,
    "all of methods A and B": 6, "Mc w80 alone": 7, "stick": 8, "skips": 9, "better than DTW": 10,
}  # fmt: skip


def test_the_papers_conclusions_follow_from_medians_such_as_it_has():
    found = claims(FpStudy(as_published()))
    assert all(part in one.claim for part, one in zip(CLAIMS, found, strict=True))
    assert [one.holds for one in found] == [True] * len(CLAIMS)
    assert found[2].here.startswith("of 9 its similarity is number 8 and its deviation number 9, best first")
    assert "Mc w10 0.313, Mc w20 0.460, Mc w40 0.545, Mc w80 0.406" in found[3].here


@pytest.mark.parametrize(
    ("part", "changes"),
    [
        ("Mc w40 alone", {"Mc w20": (0.46, 17.9)}),
        ("pass both marks", {"Mb w20 + Type V": (0.51, 17.0)}),
        ("among the worst", {"Ma": (0.4, 95.0)}),
        ("among the worst", {"Ma": (0.31, 39.0), "Mb w10": (0.32, 90.0)}),
        ("at 120", {"Mc w20": (0.549, 40.0)}),
        ("goes on improving", {"Mb w80": (0.3399, 20.0)}),
        ("goes on improving", {"Mb w80": (0.38, 61.0)}),
        ("all of methods A and B", {"Mb w40 + Type V": (0.3, 19.0)}),
        ("Mc w80 alone", {"Mc w10 + Type V": (0.4, 39.0)}),
        ("better than DTW", {"Mc w40": (0.91, 17.0)}),
    ],
)
def test_a_conclusion_that_does_not_follow_is_said_not_to_hold(part, changes):
    assert not claims(FpStudy(as_published(**changes)))[CLAIMS[part]].holds


@pytest.mark.parametrize(
    ("part", "algorithm", "ahead"),
    [("stick", "Mc w10", 0.2), ("stick", "Mb w80", 0.0), ("skips", "Mc w80", -0.2)],
)
def test_what_sticks_is_behind_and_what_skips_ahead(part, algorithm, ahead):
    rows = [row._replace(ahead=ahead) if row.algorithm == algorithm else row for row in as_published()]
    one = claims(FpStudy(rows))[CLAIMS[part]]
    assert not one.holds
    assert f"{algorithm} {ahead:+.1f}" in one.here


def test_a_rate_that_was_not_tested_has_no_verdict():
    found = claims(FpStudy(made_up(60)))
    assert found[CLAIMS["at 120"]].holds is None
    assert found[CLAIMS["at 60"]].holds is not None


def test_the_report_fits_a_page_whatever_is_found():
    """Printed to a file, where nothing is folded; every algorithm passes, is improved and is late."""
    rows = made_up(120, **{str(one): (0.6 + one.type_v / 10, 17.0 - one.type_v) for one in ALGORITHMS})
    rows = [row._replace(microseconds=None if row.microseconds is None else 1e5) for row in rows]
    shown = _shown(Conducted(FpStudy(rows), ["a note"]), width=10_000).splitlines()
    assert "a note" in shown[0]
    assert max(len(line.rstrip()) for line in shown) <= 150


def _shown(conducted: Conducted[FpStudy], width: int = 200) -> str:
    shown = io.StringIO()
    Console(file=shown, width=width).print(fp_dtw_report(conducted))
    return shown.getvalue()


@pytest.fixture(scope="module")
def conducted(silent_progress) -> Conducted[FpStudy]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fp_dtw_clips, "ACTIONS", {name: ACTIONS[name] for name in ("punch", "kick")})
        patch.setattr(fp_dtw_clips, "EMBEDDED_TAKES", 1)
        return study_fp_dtw(None, "action", 2, 0, silent_progress)


def test_the_experiment_has_every_pair_rate_and_algorithm(conducted):
    study = conducted.study
    rows = study.to_arrow().to_pandas()
    assert study.rates == [120, 60]
    assert len(rows) == 2 * 2 * 2 * (2 + len(ALGORITHMS))
    assert not rows.duplicated(["rate", "moving", "reference", "algorithm"]).any()
    assert not rows.drop(columns="microseconds").isna().any(axis=None)
    assert rows.similarity.between(-1, 1).all()
    pairs = [set(zip(some.moving, some.reference, strict=True)) for _, some in rows.groupby("rate")]
    assert pairs[0] == pairs[1]
    table = study.pairs(120, "deviation")
    assert table.shape == (4, 2 + len(ALGORITHMS))
    medians = study.medians(120)
    assert medians.loc["Mb w40", "deviation"] == pytest.approx(table["Mb w40"].median())
    assert medians.loc[DTW, "similarity"] > medians.loc[UTW, "similarity"]
    assert medians.loc["Ma + Type V", "deviation"] < medians.loc["Ma", "deviation"]


def test_the_report_sets_ours_beside_the_papers(conducted):
    text = _shown(conducted)
    lines = text.splitlines()
    assert len(lines) < 120
    assert sum(line.startswith("without a constraint Ma is among the worst") for line in lines) == 1
    medians = conducted.study.medians(120)
    (utw,) = [line for line in lines if line.startswith(" 120 ")]
    assert f"{medians.loc[UTW, 'similarity']:.3f}  0.240" in utw
    (table_2,) = [line for line in lines if line.startswith("Method B")]
    assert all(str(TABLE_2[f"Mb w{window}"]) in table_2 for window in (10, 20, 40, 80))
    at_120 = lines[: next(place for place, line in enumerate(lines) if line.startswith("At 60 frames"))]
    for name in PASS_BOTH:
        assert sum(line.startswith(f"{name} ") and line.rstrip().endswith("yes") for line in at_120) == 1
    assert conducted.notes[0] in text.replace("\n", " ")


@pytest.mark.slow
def test_a_catalogs_labelled_clips_are_aligned(demo_catalog, silent_progress):
    """The embedded catalog's takes were recorded at 30 and 60 frames a second."""
    found = study_fp_dtw(Catalog.open(demo_catalog), "action", 1, 0, silent_progress)
    assert found.study.rates == [60]
    assert "recorded at 30" in found.notes[0]
    assert "not measured" in _shown(found)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_but_for_the_times(silent_progress):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fp_dtw_clips, "ACTIONS", {"punch": ACTIONS["punch"]})
        tables = [
            experiment.study_fp_dtw(None, "action", 1, 5, silent_progress).study.to_arrow() for _ in range(2)
        ]
    first, second = (table.drop_columns("microseconds") for table in tables)
    assert first.equals(second)
