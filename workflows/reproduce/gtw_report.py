"""The GTW experiments in a terminal: errors, seconds, and what the paper says of its own.

**[GTW]** Zhou, De la Torre, *Generalized time warping*, CVPR 2012: 5.2 with Figure 4g, 4.3 with Figures 3c
and 3d. The figures are pictures, so no numbers of the paper can stand beside ours; see `gtw_claims.py`.
"""

from __future__ import annotations

import pandas as pd
from rich.console import Group, RenderableType

from motionary.workflows.reproduce.claims import claims_table
from motionary.workflows.reproduce.gtw import GtwExperiment, GtwStudy
from motionary.workflows.reproduce.gtw_claims import (
    error_claims,
    growth,
    median_seconds,
    set_claims,
    shown,
    time_claims,
)
from motionary.workflows.reproduce.gtw_methods import GTW, SET_METHODS, START
from motionary.workflows.reproduce.gtw_sequences import LATENT_FRAMES, STRETCHES
from motionary.workflows.reproduce.report import spread
from motionary.workflows.reproduce.study import mean_of
from motionary.workflows.tables import text_table

_LEGEND = (
    "± half of the 95% interval over sets (normal). Columns are the latent frames that a sequence holds: by\n"
    "stretches, each fifth of them thinned to a share of its own; anywhere, any set of them as likely as\n"
    "any other. Uniform: where all start. GTW: 3 polynomial and 3 tanh functions, eta = lambda = 0, uniform\n"
    "start, first and last frames joined. With ends relaxed, the paper's inequality, a warp may leave out\n"
    "the end of a sequence. The coarse start is what the paper names as future work."
)


def gtw_report(experiment: GtwExperiment) -> RenderableType:
    """Lay the experiments out for reading; all their numbers are `GtwStudy.to_arrow`."""
    study = experiment.study
    sets = len(study.of_sets(STRETCHES, "error"))
    pairs = study.of_pairs("error").groupby(level="latent_frames").size()
    parts: list[RenderableType] = [
        f"Sets of three curves of {LATENT_FRAMES} latent frames: {sets} of each choice of columns (the paper "
        f"has 100). Pairs of 1-D curves: {pairs.iloc[0]} of each of {len(pairs)} lengths (the paper: 100 of "
        f"each of 15). Seed {experiment.seed}. Errors are those of eq. 9, in frames."
    ]
    for columns in SET_METHODS:
        parts += ["", _sets_table(study, columns)]
    parts += [_LEGEND, "", claims_table(set_claims(study), _said_of("5.2 (Figure 4g)"))]
    parts += ["", _errors_table(study), "", _seconds_table(study), ""]
    claims = [*error_claims(study), *time_claims(study)]
    return Group(*parts, claims_table(claims, _said_of("4.3 (Figures 3a, 3c and 3d)")))


def _sets_table(study: GtwStudy, columns: str) -> RenderableType:
    errors, seconds = study.of_sets(columns, "error"), study.of_sets(columns, "seconds")
    rows = []
    for name in errors.columns:
        against = "" if name == GTW else spread(mean_of((errors[name] - errors[GTW]).to_numpy()), sign=True)
        rows.append(
            [
                name,
                spread(mean_of(errors[name].to_numpy())),
                f"{errors[name].median():.2f}",
                against,
                f"{seconds[name].mean():.3f}" if name != START else "",
            ]
        )
    headings = ["method", "mean error", "median", "minus GTW, set by set", "seconds"]
    return text_table(headings, rows, f"5.2: three turned and scaled spirals with noise, columns {columns}")


def _errors_table(study: GtwStudy) -> RenderableType:
    errors = study.of_pairs("error").groupby(level="latent_frames").mean()
    title = (
        "4.3: mean error by latent frames. SC: within .1 of the longer length; IP: slopes up to 2; "
        "GN: Gauss-Newton with so many functions"
    )
    return text_table(["frames", *errors.columns], _rows(errors, 2), title)


def _seconds_table(study: GtwStudy) -> RenderableType:
    seconds = median_seconds(study)
    power = [shown(value) for value in growth(study)]
    title = "4.3: median seconds by latent frames; last the power of length that they grow with (longer half)"
    return text_table(["frames", *seconds.columns], [*_rows(seconds, 4), ["power", *power]], title)


def _rows(table: pd.DataFrame, digits: int) -> list[list[str]]:
    return [
        [str(frames), *(f"{value:.{digits}f}" for value in values)]
        for frames, values in zip(table.index, table.to_numpy(), strict=True)
    ]


def _said_of(part: str) -> str:
    return f"What the paper says of {part}, which has no numbers in its text:"
