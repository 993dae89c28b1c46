"""Online alignment against the paper's Algorithms 1 to 3 written out, and what must be so whatever comes."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from motionary.pipeline.alignment.online import USUAL_WINDOWS, OnlineAligner, online_warp
from motionary.pipeline.alignment.path_warp import path_warp
from motionary.pipeline.alignment.rotation_costs import rotation_costs
from motionary.pipeline.distances import dtw_path
from motionary.pipeline.joint_rotations import joint_rotations
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import template
from tests.benchmarks import online

METHODS = pytest.mark.parametrize("method", ["A", "B", "C"])
seeds = st.integers(0, 2**32 - 1)
methods, constraints = st.sampled_from("ABC"), st.sampled_from([None, "type-v"])


def wandering(rng: np.random.Generator, frames: int, joints: int) -> np.ndarray:
    """Joints that turn this way and that."""
    steps = rng.normal(scale=0.15, size=(frames, joints, 3)) + rng.normal(scale=0.1, size=(joints, 3))
    vectors = np.cumsum(steps, axis=0)
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat().reshape(frames, joints, 4)


def in_other_time(frames: np.ndarray, times: np.ndarray) -> np.ndarray:
    shown = [Slerp(np.arange(len(frames)), Rotation.from_quat(one))(times) for one in frames.swapaxes(0, 1)]
    return np.stack([one.as_quat() for one in shown], axis=1)


def a_pair(seed: int, joints: int, frames: int, live: int) -> tuple[np.ndarray, np.ndarray]:
    """A motion and one like it, in a time of its own."""
    rng = np.random.default_rng(seed)
    motion = wandering(rng, frames, joints)
    times = np.sort(rng.uniform(0, max(frames - 1, 0), live))
    shown = in_other_time(motion, times) if frames > 1 else np.repeat(motion, live, axis=0)
    noise = Rotation.from_rotvec(rng.normal(scale=0.05, size=(live * joints, 3)))
    return motion, (noise * Rotation.from_quat(shown.reshape(-1, 4))).as_quat().reshape(live, joints, 4)


def apart(shown, frame):
    """Eq. 1 of two frames, as it is printed."""
    dots = [abs(sum(p * q for p, q in zip(*two, strict=True))) for two in zip(shown, frame, strict=True)]
    return sum(2 / math.pi * math.acos(min(1.0, dot)) for dot in dots)


class Naive:
    """The paper's algorithms, cell by cell; `allowed` advances are those that Type V leaves.

    `maps` has an entry for each frame in `live`; `lost` counts the frames held since the last of them.
    """

    def __init__(self, prerecorded, method, window, constraint, missing):
        self.prerecorded, self.method, self.window, self.constraint = prerecorded, method, window, constraint
        self.missing, self.live, self.maps, self.lost, self.gap = missing, [], [], 0, 1

    def push(self, frame):
        if frame is None and self.missing == "hold":
            self.lost += 1
            return self.maps[-1]
        if frame is None:
            frame = self._forecast()[1] if len(self.live) > 1 else self.live[-1]
        self.gap, self.lost = self.lost + 1, 0
        self.live.append(frame)
        n, m = len(self.live) - 2, len(self.prerecorded) - 1
        if n < 0:
            self.maps.append(0)
        elif self.maps[-1] == m:
            self.maps.append(m)
        elif self.method != "A" and n < 2:
            self.maps.append(n + 1)
        else:
            rows = min(self.window, m - self.maps[-1]) + 1
            allowed = [row for row in range(rows) if self._allows(row)]
            self.maps.append(self.maps[-1] + getattr(self, f"_{self.method}")(rows, allowed))
        return self.maps[-1]

    def _allows(self, advance):
        if self.constraint is None:
            return True
        before = [*np.diff(self.maps), advance]
        return advance <= 3 and before[-3:] != [0, 0, 0]

    def _cost(self, row, frame):
        return apart(self.prerecorded[self.maps[-1] + row], frame)

    def _forecast(self):
        before, now = (Rotation.from_quat(frame) for frame in self.live[-2:])
        turn = Rotation.from_rotvec((before.inv() * now).as_rotvec() / self.gap)
        return [(now * turn**k).as_quat() for k in range(self.window + 1)]

    def _A(self, rows, allowed):
        return min(allowed, key=lambda row: self._cost(row, self.live[-1]))

    def _B(self, rows, allowed):
        columns = [self.live[-2], *self._forecast()]
        costs = {(i, j): self._cost(i, one) for j, one in enumerate(columns) for i in range(rows)}

        def before(i, j):
            steps = [(i - 1, j - 1), (i, j - 1), (i - 1, j)]
            # The first step into column 1 enters it in row i.
            return [one for one in steps if one in costs and (j != 1 or one[1] == 1 or i in allowed)]

        total = {(0, 0): costs[0, 0]}
        for j in range(len(columns)):
            for i in range(rows):
                if i or j:
                    reached = [total[one] for one in before(i, j)]
                    total[i, j] = costs[i, j] + min(reached, default=math.inf)
        total[0, 0] = math.inf
        i, j = rows - 1, len(columns) - 1
        met = {}
        while (i, j) not in ((0, 1), (1, 0), (0, 0)):
            met[j] = i
            i, j = min(before(i, j), key=lambda one: (total[one], abs(one[0] - one[1])))
        met[j] = i
        return met[1]

    def _C(self, rows, allowed):
        columns = self._forecast()
        total = {}
        for j in reversed(range(len(columns))):
            for i in reversed(range(rows)):
                after = [total[one] for one in ((i + 1, j + 1), (i + 1, j), (i, j + 1)) if one in total]
                total[i, j] = self._cost(i, columns[j]) + min(after, default=0.0)
        return min(allowed, key=lambda row: total[row, 0])


@settings(max_examples=80, deadline=None)
@given(
    seed=seeds,
    method=methods,
    constraint=constraints,
    window=st.integers(1, 7),
    joints=st.integers(1, 3),
    frames=st.integers(1, 14),
    missing=st.sampled_from(["forecast", "hold"]),
    lost=st.sets(st.integers(1, 15), max_size=6),
)
def test_a_pushed_sequence_is_as_the_algorithms_have_it(
    seed, method, constraint, window, joints, frames, missing, lost
):
    prerecorded, live = a_pair(seed, joints, frames, 16)
    options = (prerecorded, method, window, constraint, missing)
    aligner, naive = OnlineAligner(*options), Naive(*options)
    for k, frame in enumerate(live):
        one = None if k in lost else frame
        assert aligner.push(one) == naive.push(one)


@pytest.mark.parametrize("missing", ["forecast", "hold"])
@METHODS
def test_a_long_sequence_with_gaps_is_as_the_algorithms_have_it(method, missing):
    prerecorded, live = a_pair(1, 1, 90, 80)
    options = (prerecorded, method, 6, "type-v", missing)
    aligner, naive = OnlineAligner(*options), Naive(*options)
    for k, frame in enumerate(live):
        one = frame if k < 9 or k % 5 < 2 else None
        assert aligner.push(one) == naive.push(one)
    assert 9 < aligner.path[-1] < 89


@settings(max_examples=60, deadline=None)
@given(
    seed=seeds,
    method=methods,
    constraint=constraints,
    missing=st.sampled_from(["forecast", "hold"]),
    window=st.integers(1, 30),
    frames=st.integers(1, 40),
    lost=st.sampled_from([0.0, 0.2, 0.9]),
)
def test_the_index_never_falls_and_type_v_keeps_its_slopes(
    seed, method, constraint, missing, window, frames, lost
):
    rng = np.random.default_rng(seed)
    aligner = OnlineAligner(wandering(rng, frames, 2), method, window, constraint, missing)
    live = [None if k and rng.random() < lost else one for k, one in enumerate(wandering(rng, 50, 2))]
    shown = np.array([aligner.push(frame) for frame in live])
    np.testing.assert_array_equal(aligner.path, shown)
    assert shown[0] == 0
    assert shown[-1] < frames
    advances = np.diff(shown)
    assert advances.min() >= 0
    assert advances.max() <= window
    if constraint:
        seen = shown if missing == "forecast" else shown[[frame is not None for frame in live]]
        stays = "".join("s" if advance == 0 else "-" for advance in np.diff(seen[seen < frames - 1]))
        assert advances.max() <= 3
        assert "sss" not in stays


@settings(max_examples=40, deadline=None)
@given(seed=seeds, method=methods, window=st.integers(1, 12))
def test_type_v_changes_nothing_that_it_allows(seed, method, window):
    """Of one state, the choice without the constraint is the choice with it, where the state allows that."""
    prerecorded, live = a_pair(seed, 2, 40, 30)
    bound = OnlineAligner(prerecorded, method, window, "type-v")
    for frame in live:
        free = OnlineAligner(prerecorded, method, window)
        free._followed = before = bound._followed
        advance = free.push(frame) - before.frame
        if before.state.least <= advance <= 3 or before.frame == 39:
            assert bound.push(frame) - before.frame == advance
        else:
            bound.push(frame)


@pytest.mark.parametrize("method", ["A", "B", "C"])
def test_a_still_beginning_longer_than_the_window_is_left_again(method):
    angle = np.concatenate([np.zeros(14), np.arange(1, 9) * 0.1])
    motion = Rotation.from_rotvec(angle[:, None] * [1.0, 0, 0]).as_quat()[:, None]
    np.testing.assert_array_equal(online_warp(motion, motion, method, 5).path[:15, 0], np.arange(15))
    assert online_warp(motion, motion, method, 5).path[-1, 0] == len(motion) - 1


@settings(max_examples=30, deadline=None)
@given(seed=seeds, window=st.integers(1, 9), still=st.integers(0, 12), constraint=constraints)
def test_a_live_copy_is_followed_frame_by_frame_by_a(seed, window, still, constraint):
    """Also through a stretch in which nothing moves, where any frame matches."""
    motion = wandering(np.random.default_rng(seed), 30, 3)
    motion[7 : 7 + still] = motion[7]
    assert online_warp(motion, motion.copy(), "A", window, constraint).path[:, 0].tolist() == list(range(30))


@METHODS
def test_a_live_copy_of_a_walk_is_followed(method):
    walk = joint_rotations(template("walk"), rate=120.0)
    path = online_warp(walk, walk, method, None, "type-v").path
    assert np.abs(path[:, 0] - path[:, 1]).max() <= 6


@METHODS
def test_another_pace_is_followed(method):
    walk = joint_rotations(template("walk"), rate=120.0)
    times = np.linspace(0, len(walk) - 1, int(0.8 * len(walk)))
    warp = online_warp(walk, in_other_time(walk, times), method, 20, "type-v")
    assert np.abs(warp.source_time - times).mean() < 6


@settings(max_examples=30, deadline=None)
@given(seed=seeds, method=methods, constraint=constraints)
def test_signs_and_precision_of_quaternions_do_not_matter(seed, method, constraint):
    prerecorded, live = a_pair(seed, 2, 30, 30)
    rng = np.random.default_rng(seed)
    expected = online_warp(prerecorded, live, method, 8, constraint).path
    signs = [rng.choice([-1.0, 1.0], (*one.shape[:2], 1)) for one in (prerecorded, live)]
    other = online_warp(signs[0] * prerecorded, 1.0004 * signs[1] * live, method, 8, constraint).path
    np.testing.assert_array_equal(other, expected)
    assert len(online_warp(prerecorded.astype(np.float32), live.astype(np.float32), method, 8).path) == 30


@METHODS
def test_a_finished_motion_keeps_its_last_frame(method):
    motion = wandering(np.random.default_rng(0), 5, 2)
    path = online_warp(motion, np.concatenate([motion, motion[::-1], motion]), method, 3, "type-v").path
    assert path[-8:, 0].tolist() == [4] * 8


@METHODS
def test_one_prerecorded_frame_is_shown_throughout(method):
    motion = wandering(np.random.default_rng(0), 9, 2)
    assert online_warp(motion[:1], motion, method).source_time.tolist() == [0.0] * 9


@METHODS
def test_lost_frames_are_forecast_or_the_last_one_is_held(method):
    start = Rotation.from_rotvec([[0.2, 0, 0], [0.9, 0, 0]])
    motion = np.stack([(start * Rotation.from_rotvec([0, 0.035 * k, 0])).as_quat() for k in range(60)])
    live = [None if 20 <= k < 25 else frame for k, frame in enumerate(motion)]
    forecast, hold = (OnlineAligner(motion, method, 8, missing=one) for one in ("forecast", "hold"))
    shown = np.array([forecast.push(frame) for frame in live])
    assert np.abs(shown - np.arange(60)).max() <= 1  # B's two ways round the corner cost the same
    held = [hold.push(frame) for frame in live]
    assert held[:25] == [*range(20), *[19] * 5]
    assert held[-1] == 59


@METHODS
@pytest.mark.parametrize("missing", ["forecast", "hold"])
def test_a_live_motion_may_begin_with_lost_frames(method, missing):
    motion = wandering(np.random.default_rng(1), 12, 2)
    aligner = OnlineAligner(motion, method, 4, "type-v", missing)
    shown = [aligner.push(frame) for frame in (None, None, motion[0], None, *motion[1:])]
    assert shown[:3] == [0, 0, 0]
    assert [OnlineAligner(motion, method, missing=missing).push(None) for _ in range(5)] == [0] * 5


WRONG = [
    (lambda frame: frame[:2], r"has shape \(2, 4\).*needs real numbers, \(3, 4\)"),
    (lambda frame: frame * [[1], [1], [1.1]], "live frame 6, joint 2 holds .*length 1"),
    (lambda frame: frame * [[1], [np.nan], [1]], r"live frame 6, joint 1 holds the quaternion \(nan"),
    (lambda frame: frame * [[np.inf], [1], [1]], "live frame 6, joint 0"),
    (lambda frame: 0 * frame, "live frame 6, joint 0"),
    (lambda frame: frame.astype(complex), "real numbers"),
    (lambda frame: "frame", "real numbers"),
]


@METHODS
@pytest.mark.parametrize(("spoil", "what"), WRONG)
def test_a_wrong_frame_is_refused_and_changes_nothing(method, spoil, what):
    prerecorded, live = a_pair(5, 3, 40, 30)
    aligner, other = (OnlineAligner(prerecorded, method, 6, "type-v") for _ in range(2))
    for k, frame in enumerate(live):
        if k == 6:
            before = aligner._followed
            with pytest.raises(ValueError, match=what):
                aligner.push(spoil(frame))
            assert aligner._followed is before
            assert len(aligner.path) == 6
        assert aligner.push(frame) == other.push(frame)


def test_the_caller_may_reuse_its_arrays():
    prerecorded, live = a_pair(6, 2, 30, 30)
    expected = online_warp(prerecorded, live, "C", 6).path[:, 0]
    ours, frame = prerecorded.copy(), np.empty_like(live[0])
    aligner = OnlineAligner(ours, "C", 6)
    ours[:] = np.nan
    for k, one in enumerate(live):
        frame[:] = one
        assert aligner.push(frame) == expected[k]
        frame[:] = np.nan


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"method": "D"}, "no method 'D'; there are A, B, C"),
        ({"window": 0}, "window is 0"),
        ({"window": 2.5}, "window is 2.5"),
        ({"window": math.inf}, "window is inf"),
        ({"window": 1001}, "1 to 1000"),
        ({"constraint": "type-i"}, "no constraint 'type-i'; there is 'type-v'"),
        ({"missing": "wait"}, "missing is 'wait'"),
    ],
)
def test_an_unknown_option_is_refused(options, what):
    with pytest.raises(ValueError, match=what):
        OnlineAligner(wandering(np.random.default_rng(0), 3, 2), **options)


def test_prerecorded_frames_are_checked():
    motion = wandering(np.random.default_rng(0), 5, 2)
    motion[3, 1, 2] += 1
    with pytest.raises(ValueError, match="prerecorded, frame 3, joint 1 holds the quaternion"):
        OnlineAligner(motion)
    for shape in ((0, 2, 4), (3, 0, 4), (3, 2, 3), (3, 4)):
        with pytest.raises(ValueError, match=r"prerecorded has shape .* needs real numbers, \(m, J, 4\)"):
            OnlineAligner(np.ones(shape))
    good = wandering(np.random.default_rng(0), 5, 2)
    with pytest.raises(ValueError, match=r"reference has shape \(5, 1, 4\).*\(n, 2, 4\)"):
        online_warp(good, good[:, :1])


def test_the_usual_windows_are_the_papers():
    motion = wandering(np.random.default_rng(0), 3, 2)
    assert {method: OnlineAligner(motion, method).window for method in USUAL_WINDOWS} == {
        "A": 2, "B": 40, "C": 40
    }  # fmt: skip


@settings(max_examples=30, deadline=None)
@given(seed=seeds, joints=st.integers(1, 4), frames=st.integers(1, 6), others=st.integers(1, 6))
def test_costs_are_equation_1_of_any_two_frames(seed, joints, frames, others):
    rng = np.random.default_rng(seed)
    one, other = (
        Rotation.random(n * joints, rng=rng).as_quat().reshape(n, joints, 4) for n in (frames, others)
    )
    other[0] = one[-1]
    costs = rotation_costs(one, -other)
    assert costs.shape == (frames, others)
    for i, k in np.ndindex(costs.shape):
        assert costs[i, k] == pytest.approx(apart(one[i], other[k]), abs=1e-6)
    assert costs[-1, 0] == 0


def test_costs_keep_the_digits_of_small_turns():
    angles = 10.0 ** -np.arange(1, 12)
    turned = Rotation.from_rotvec(np.outer(angles, [0, 1, 0])).as_quat()[:, None]
    found = rotation_costs(turned, [[[0, 0, 0, 1]]])[:, 0]
    np.testing.assert_allclose(found, angles / np.pi, rtol=1e-9)


def test_costs_of_what_cannot_be_compared_are_refused():
    good = wandering(np.random.default_rng(0), 5, 2)
    with pytest.raises(ValueError, match=r"b has shape \(5, 1, 4\).*\(n, 2, 4\)"):
        rotation_costs(good, good[:, :1])
    with pytest.raises(ValueError, match=r"a, frame 0, joint 0 holds .* normalise it$"):
        rotation_costs(2 * good, good)


@pytest.mark.parametrize(
    ("microseconds", "window", "code", "said"),
    [
        (8333, 40, 0, "within 8333 us, windows up to 40: met by every method"),
        (8334, 40, 1, "windows up to 40: MISSED by B, window 40, 8 joints"),
        (99999, 80, 0, "met by every method"),
    ],
)
def test_the_benchmark_judges_medians_by_the_time_of_a_frame(
    tmp_path, capsys, monkeypatch, microseconds, window, code, said
):
    def timed(method, width, joints, frames):
        slow = (method, width, joints) == ("B", window, 8)
        return [1.0, microseconds if slow else 2.0, 1e6]  # the longest is no median

    monkeypatch.setattr(online, "_samples", timed)
    assert online.main(["--json", str(tmp_path / "online.json")]) == code
    assert said in capsys.readouterr().out
    assert online.main(["--quick", "--json", str(tmp_path / "online.json")]) == 0


def test_the_benchmark_runs(tmp_path, capsys):
    assert online.main(["--quick", "--json", str(tmp_path / "made" / "online.json")]) == 0
    figures = json.loads((tmp_path / "made" / "online.json").read_text())["figures"]
    assert len(figures) == 36
    assert all(one["measured"] > 0 for one in figures)
    assert "C, window 40, 8 joints, us a frame (Table 2: 4764)" in capsys.readouterr().out


@METHODS
def test_real_takes_of_two_people_are_followed(shared_data, method):
    """Under Type V, and near the DTW path: within 150 ms at 120 frames a second, the paper's bound."""
    takes = [
        f"HDM_{one}_120.amc"
        for one in ("bd_jogLeftCircle4StepsRstart_001", "bk_jogLeftCircle4StepsRstart_003")
    ]
    moving, reference = (joint_rotations(read_motion(shared_data / "hdm05" / one)) for one in takes)
    dtw = path_warp(dtw_path(rotation_costs(moving, reference)), len(moving))
    warp = online_warp(moving, reference, method, None, "type-v")
    assert np.abs(warp.source_time - dtw.source_time).mean() < 18


def test_the_warp_joins_every_reference_frame_with_one_frame():
    prerecorded, live = a_pair(8, 2, 30, 45)
    warp = online_warp(prerecorded, live, "B", 10)
    assert warp.path[:, 1].tolist() == list(range(45))
    np.testing.assert_array_equal(warp.source_time, warp.path[:, 0])
    assert warp.moving_frames == 30
