"""What the text of [GTW] says of its experiments 5.2 and 4.3, and whether it holds of ours.

**[GTW]** Zhou, De la Torre, *Generalized time warping*, CVPR 2012. Its results are pictures, Figures 3c, 3d
and 4g; the text has no number of theirs, only who is better than whom. Each of these sentences is held
against the measurements.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from motionary.workflows.reproduce.gtw import GtwStudy
from motionary.workflows.reproduce.gtw_methods import GTW, PAPER_METHODS, SET_METHODS, START

WINDOWS, GAUSS_NEWTON = ["DTW-SC", "DTW-IP"], ["GN 6", "GN 10", "GN 14"]
BASELINES = [name for name in PAPER_METHODS if name not in (START, GTW)]

_LINEAR = 1.25  # powers up to here are called linear, since part of the time does not grow at all


@dataclass(frozen=True)
class Claim:
    """What the paper says, what was found, and whether they agree.

    Parameters
    ----------
    paper, here : str
        In words, without a full stop.
    holds : bool
        Whether the figures in `here` are as the paper says.
    """

    paper: str
    here: str
    holds: bool


def set_claims(study: GtwStudy) -> list[Claim]:
    """Hold 5.2 against the sets: GTW is the best, whichever way columns were chosen."""
    found = []
    for columns in SET_METHODS:
        errors = study.of_sets(columns, "error")
        others = errors[BASELINES]
        wins = int((errors[GTW] < others.min(axis=1)).sum())
        here = (
            f"with columns {columns}, mean errors {_each(errors.mean(), [*BASELINES, GTW])}; "
            f"GTW's is the least in {wins} of {len(errors)} sets"
        )
        found.append(
            Claim("GTW aligns best of the four", here, bool(errors[GTW].mean() < others.mean().min()))
        )
    return found


def error_claims(study: GtwStudy) -> list[Claim]:
    """Hold what 4.3 says of errors against the pairs; errors in per cent of the latent frames."""
    frames = study.of_pairs("error").index.get_level_values("latent_frames").to_numpy()
    shares = study.of_pairs("error").div(frames, axis=0) * 100
    mean, median = shares.mean().drop(START), shares.median()
    by_bases = mean[GAUSS_NEWTON].to_list()
    return [
        Claim(
            "DTW has the lowest error",
            f"per cent of the latent frames, means over all pairs: {_each(mean, mean.index)}",
            bool(mean.idxmin() == "DTW"),
        ),
        Claim(
            "Itakura's parallelogram is more accurate than Sakoe and Chiba's band",
            f"means {_each(mean, WINDOWS)}",
            bool(mean["DTW-IP"] < mean["DTW-SC"]),
        ),
        Claim(
            "the more bases, the less error",
            f"means {_each(mean, GAUSS_NEWTON)}; medians, which local minima do not move, "
            f"{_each(median, GAUSS_NEWTON)}",
            by_bases == sorted(by_bases, reverse=True),
        ),
    ]


def time_claims(study: GtwStudy) -> list[Claim]:
    """Hold what 4.3 says of time against the pairs' median seconds by length."""
    seconds = median_seconds(study)
    power = growth(study)
    windows = seconds[WINDOWS].max(axis=1) < seconds["DTW"]
    longest = seconds["DTW"] > seconds.drop(columns="DTW").max(axis=1)
    quickest = seconds[GAUSS_NEWTON].max(axis=1) < seconds[["DTW", *WINDOWS]].min(axis=1)
    before_dtw = seconds[GAUSS_NEWTON].max(axis=1) < seconds["DTW"]
    return [
        Claim("DTW takes the most time", _lengths(longest), bool(longest.all())),
        Claim("either window makes DTW faster", _lengths(windows), bool(windows.all())),
        Claim(
            "Gauss-Newton grows linearly with the length, DTW with its square",
            "over the longer half of the lengths, with their power of "
            f"{_each(power, power.index)}; up to {_LINEAR} is called linear",
            bool(power[GAUSS_NEWTON].max() <= _LINEAR < power["DTW"]),
        ),
        Claim(
            "Gauss-Newton takes less time than DTW and DTW in either window",
            f"{_lengths(quickest)}; than DTW without a window, {_lengths(before_dtw)}",
            bool(quickest.all()),
        ),
    ]


def median_seconds(study: GtwStudy) -> pd.DataFrame:
    """Return the median seconds of a pair, a row a length and a column a method that takes time."""
    return study.of_pairs("seconds").groupby(level="latent_frames").median().drop(columns=START)


def growth(study: GtwStudy) -> pd.Series:
    """Return for every method the power of the length that its time grows with.

    The slope of log seconds over log length by least squares, over the longer half of the lengths (two at
    least), where what does not grow counts for least; nan where there is a single length.
    """
    seconds = median_seconds(study)
    longer = seconds.tail(max(2, (len(seconds) + 1) // 2))
    if len(longer) < 2:
        return pd.Series(np.nan, index=seconds.columns)
    length = np.log(longer.index.to_numpy(dtype=np.float64))
    return pd.Series(np.polyfit(length, np.log(longer.to_numpy()), 1)[0], index=seconds.columns)


def _each(values: pd.Series, names: Iterable[str]) -> str:
    return ", ".join(f"{name} {shown(values[name])}" for name in names)


def shown(value: float) -> str:
    """Show a value with two digits, and a missing one as a dash."""
    return "-" if np.isnan(value) else f"{value:.2f}"


def _lengths(at: pd.Series) -> str:
    """Say at how many lengths something is so, and from which on it always is."""
    said = f"at {int(at.sum())} of {len(at)} lengths"
    if at.all() or not at.iloc[-1]:
        return said
    last_not = int(np.flatnonzero(~at.to_numpy())[-1])
    return f"{said}, always from {at.index[last_not + 1]} latent frames on"
