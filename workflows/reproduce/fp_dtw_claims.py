"""What [FP] concludes of its algorithms, and whether that is so here.

**[FP]** Randall, Harvey, Williams, *Online alignment of human motion using forward plotting-DTW*, CAVW 34
(2023), 5 to 7. It judges all of them on takes at 120 frames a second, by medians over pairs; its Figures 5 to
7 are pictures, so what their text says is what can be held against the measurements. Judged are the
algorithms that it has, at the highest rate that was tested.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

from motionary.workflows.reproduce.claims import Claim
from motionary.workflows.reproduce.fp_dtw_measures import (
    ALGORITHMS,
    DTW,
    IMPERCEPTIBLE,
    MATCHING_WINDOW,
    UTW,
    WINDOWS,
    FpStudy,
)

IN_THE_PAPER = [str(one) for one in ALGORITHMS if one.method != "A" or one.window == MATCHING_WINDOW]
PASS_BOTH = ("Mc w40", "Ma + Type V", "Mc w80 + Type V")

_FREE = [name for name in IN_THE_PAPER if "Type V" not in name]
_WORST = 3  # of the nine in `_FREE` so many are called the worst


def claims(study: FpStudy) -> list[Claim]:
    """Hold the conclusions against the medians."""
    rate = study.rates[0]
    medians = study.medians(rate)
    passed = passing(study, rate).loc[IN_THE_PAPER]
    one_mark = set(passed.index[passed.any(axis=1)].intersection(_FREE))
    both_marks = set(passed.index[passed.all(axis=1)])
    return [
        Claim(
            "without a constraint Mc w40 alone passes one mark or both",
            one_mark == {"Mc w40"},
            f"passing: {_names(one_mark)}",
        ),
        Claim(f"{_names(PASS_BOTH)} pass both marks", both_marks == set(PASS_BOTH), _names(both_marks)),
        _worst_claim(medians),
        _best_window_claim(study, 120, "Mc w40"),
        _best_window_claim(study, 60, "Mc w20"),
        _improving_claim(medians),
        *_type_v_claims(improved(study, rate)),
        _leaning_claim(medians, "stick, behind DTW", ("Mb w10", "Mb w80", "Mc w10"), -1),
        _leaning_claim(medians, "skips, ahead of DTW", ("Mc w80",), 1),
        _offline_claim(medians["similarity"]),
    ]


def passing(study: FpStudy, rate: int) -> pd.DataFrame:
    """Tell which algorithms pass the paper's marks: a row each, columns `similarity` and `deviation`."""
    medians = study.medians(rate)
    passed = {
        "similarity": medians["similarity"] > medians.loc[UTW, "similarity"],
        "deviation": medians["deviation"] < IMPERCEPTIBLE * rate,
    }
    return pd.DataFrame(passed).drop(index=[UTW, DTW])


def improved(study: FpStudy, rate: int) -> list[str]:
    """List the algorithms that Type V brings nearer to the target and to DTW, both."""
    medians = study.medians(rate)
    similarity, deviation = medians["similarity"].to_dict(), medians["deviation"].to_dict()
    pairs = [(str(one._replace(type_v=False)), str(one)) for one in ALGORITHMS if one.type_v]
    return [
        free
        for free, bound in pairs
        if similarity[bound] > similarity[free] and deviation[bound] < deviation[free]
    ]


def _worst_claim(medians: pd.DataFrame) -> Claim:
    free = medians.loc[_FREE]
    similar = int(free["similarity"].rank(ascending=False, method="max")["Ma"])
    near = int(free["deviation"].rank(method="max")["Ma"])
    return Claim(
        "without a constraint Ma is among the worst in both tests",
        min(similar, near) > len(free) - _WORST,
        f"of {len(free)} its similarity is number {similar} and its deviation number {near}, best first; the "
        f"last {_WORST} are called the worst",
    )


def _best_window_claim(study: FpStudy, rate: int, best: str) -> Claim:
    claim = f"at {rate} frames a second {best} is the most alike of method C's windows"
    if rate not in study.rates:
        return Claim(claim, None, f"no takes at {rate} frames a second")
    similarity = study.medians(rate)["similarity"]
    names = _of_method("c")
    found = similarity[names].idxmax()
    return Claim(claim, found == best, f"similarity: {_each(similarity, names, '.3f')}")


def _improving_claim(medians: pd.DataFrame) -> Claim:
    names = _of_method("b")
    some = medians.loc[names]
    nearer = some["similarity"].is_monotonic_increasing and some["deviation"].is_monotonic_decreasing
    return Claim(
        "method B goes on improving as its window grows",
        bool(nearer),
        f"similarity: {_each(medians['similarity'], names, '.3f')}; "
        f"deviation: {_each(medians['deviation'], names, '.1f')}",
    )


def _type_v_claims(better: Sequence[str]) -> list[Claim]:
    of_a_b = [name for name in _FREE if not name.startswith("Mc")]
    of_c = [name for name in better if name.startswith("Mc")]
    missing = [name for name in of_a_b if name not in better]
    return [
        Claim(
            "Type V improves all of methods A and B",
            not missing,
            f"nearer by both measures: all but {_names(missing)}",
        ),
        Claim(
            "of method C Type V improves Mc w80 alone",
            of_c == ["Mc w80"],
            f"nearer by both measures: {_names(of_c)}",
        ),
    ]


def _leaning_claim(medians: pd.DataFrame, how: str, names: Sequence[str], sign: int) -> Claim:
    ahead = medians["ahead"]
    return Claim(
        f"{_names(names)} {how}",
        bool((sign * ahead[list(names)] > 0).all()),
        f"frames ahead: {_each(ahead, names, '+.1f')}",
    )


def _offline_claim(similarity: pd.Series) -> Claim:
    online = similarity[IN_THE_PAPER]
    return Claim(
        "no online algorithm is expected to do better than DTW",
        bool(online.max() <= similarity[DTW]),
        f"similarity: {DTW} {similarity[DTW]:.3f}, the best online {online.idxmax()} {online.max():.3f}",
    )


def _of_method(letter: str) -> list[str]:
    return [f"M{letter} w{window}" for window in WINDOWS]


def _each(values: pd.Series, names: Iterable[str], form: str) -> str:
    return ", ".join(f"{name} {values[name]:{form}}" for name in names)


def _names(names: Iterable[str]) -> str:
    """List algorithms in the order of the tables."""
    found = set(names)
    return ", ".join(name for name in map(str, ALGORITHMS) if name in found) or "none"
