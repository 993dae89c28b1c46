"""What the text of [GTW] says of its experiments 5.2 and 4.3, and whether it holds of ours.

**[GTW]** Zhou, De la Torre, *Generalized time warping*, CVPR 2012. Its results are pictures, Figures 3c, 3d
and 4g; the text has no number of theirs, only who is better than whom. Each of these sentences is held
against the measurements.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pandas as pd

from motionary.workflows.reproduce.claims import Claim
from motionary.workflows.reproduce.gtw import GtwStudy
from motionary.workflows.reproduce.gtw_methods import GTW, PAPER_METHODS, SET_METHODS, START

WINDOWS, GAUSS_NEWTON = ["DTW-SC", "DTW-IP"], ["GN 6", "GN 10", "GN 14"]
BASELINES = [name for name in PAPER_METHODS if name not in (START, GTW)]

_LINEAR = 1.25  # up to this power of the length time is said to grow no faster than linearly
_SQUARE = (1.5, 2.5)  # powers nearer to 2 than to 1 or 3


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
        best = bool(errors[GTW].mean() < others.mean().min())
        found.append(Claim("GTW aligns best of the four", best, here))
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
            bool(mean.idxmin() == "DTW"),
            f"per cent of the latent frames, means over all pairs: {_each(mean, mean.index)}",
        ),
        Claim(
            "Gauss-Newton is more accurate than DTW in either window (said of one pair, Figure 3a)",
            bool(mean[GAUSS_NEWTON].min() < mean[WINDOWS].min()),
            f"means {_each(mean, [*WINDOWS, *GAUSS_NEWTON])}; asked of the best number of bases",
        ),
        Claim(
            "Itakura's parallelogram is more accurate than Sakoe and Chiba's band",
            bool(mean["DTW-IP"] < mean["DTW-SC"]),
            f"means {_each(mean, WINDOWS)}",
        ),
        Claim(
            "the more bases, the less error",
            by_bases == sorted(by_bases, reverse=True),
            f"means {_each(mean, GAUSS_NEWTON)}; medians, which local minima do not move, "
            f"{_each(median, GAUSS_NEWTON)}",
        ),
    ]


def time_claims(study: GtwStudy) -> list[Claim]:
    """Hold what 4.3 says of time against the pairs' median seconds by length."""
    seconds = median_seconds(study)
    windows = seconds[WINDOWS].max(axis=1) < seconds["DTW"]
    longest = seconds["DTW"] > seconds.drop(columns="DTW").max(axis=1)
    quickest = seconds[GAUSS_NEWTON].max(axis=1) < seconds[["DTW", *WINDOWS]].min(axis=1)
    before_dtw = seconds[GAUSS_NEWTON].max(axis=1) < seconds["DTW"]
    return [
        Claim("DTW takes the most time", bool(longest.all()), _lengths(longest)),
        Claim("either window makes DTW faster", bool(windows.all()), _lengths(windows)),
        *_growth_claims(study),
        Claim(
            "Gauss-Newton takes less time than DTW and DTW in either window",
            bool(quickest.all()),
            f"{_lengths(quickest)}; than DTW without a window, {_lengths(before_dtw)}",
        ),
    ]


def _growth_claims(study: GtwStudy) -> list[Claim]:
    power = growth(study)
    known = bool(power.notna().all())
    fitted = _longer_half(median_seconds(study)).index
    over = f"fitted over {fitted[0]} to {fitted[-1]} latent frames"
    least, most = _SQUARE
    return [
        Claim(
            "Gauss-Newton's time grows no faster than linearly with the length",
            bool(power[GAUSS_NEWTON].max() <= _LINEAR) if known else None,
            f"with the length to the power of {_each(power, GAUSS_NEWTON)}, {over}; up to {_LINEAR} is "
            "called linear, and below 1 a part of the time is the same at any length",
        ),
        Claim(
            "DTW's time grows with the square of the length",
            bool(least <= power["DTW"] <= most) if known else None,
            f"with the length to the power of {_each(power, ['DTW', *WINDOWS])}, {over}; {least} to {most} "
            "is called its square",
        ),
    ]


def median_seconds(study: GtwStudy) -> pd.DataFrame:
    """Return the median seconds of a pair, a row a length and a column a method that takes time."""
    return study.of_pairs("seconds").groupby(level="latent_frames").median().drop(columns=START)


def growth(study: GtwStudy) -> pd.Series:
    """Return for every method the power of the length that its time grows with.

    The slope of log seconds over log length by least squares, over the longer half of the lengths, where what
    does not grow counts for least; nan where there is a single length.
    """
    longer = _longer_half(median_seconds(study))
    if len(longer) < 2:
        return pd.Series(np.nan, index=longer.columns)
    length = np.log(longer.index.to_numpy(dtype=np.float64))
    return pd.Series(np.polyfit(length, np.log(longer.to_numpy()), 1)[0], index=longer.columns)


def _longer_half(seconds: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the longer half of the lengths, two at least where there are two."""
    return seconds.tail(max(2, (len(seconds) + 1) // 2))


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
