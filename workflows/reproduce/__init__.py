"""The papers' experiments, on a labelled catalog of one's own, on the embedded library, or made up."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

from motionary.workflows.reproduce.adaptive_dtw import study_adaptive_dtw
from motionary.workflows.reproduce.adaptive_dtw_report import adaptive_dtw_report
from motionary.workflows.reproduce.assign import study_assign
from motionary.workflows.reproduce.assign_report import assign_report
from motionary.workflows.reproduce.better import better_report, study_better
from motionary.workflows.reproduce.cotw import study_cotw
from motionary.workflows.reproduce.cotw_report import cotw_report
from motionary.workflows.reproduce.dtw_curve import study_dtw_curve
from motionary.workflows.reproduce.fp_dtw import study_fp_dtw
from motionary.workflows.reproduce.fp_dtw_report import fp_dtw_report
from motionary.workflows.reproduce.gtw import study_gtw
from motionary.workflows.reproduce.gtw_report import gtw_report
from motionary.workflows.reproduce.landmarks import study_landmarks
from motionary.workflows.reproduce.landmarks_report import landmarks_report
from motionary.workflows.reproduce.mutual import mutual_report, study_mutual
from motionary.workflows.reproduce.report import report
from motionary.workflows.reproduce.style import TAKES, conduct_style, style_report


class Experiment(NamedTuple):
    """What conducts an experiment, what lays it out, how many draws are usual, and what it is made on.

    `conduct` takes (catalog, label_column, draws, seed, show), without the first two where the experiment is
    made up; the catalog may be None where the embedded library will do.
    """

    conduct: Callable[..., Any]
    report: Callable[..., Any]
    draws: int
    on: Literal["labelled", "labelled or embedded", "made up"] = "labelled"


EXPERIMENTS = {
    "dtw-curve": Experiment(study_dtw_curve, report, 100),
    "dtw-curve-better": Experiment(study_better, better_report, 100),
    "cotw": Experiment(study_cotw, cotw_report, 10),
    "gtw": Experiment(study_gtw, gtw_report, 100, "made up"),
    "fp-dtw": Experiment(study_fp_dtw, fp_dtw_report, 20, "labelled or embedded"),
    "adaptive-dtw": Experiment(study_adaptive_dtw, adaptive_dtw_report, 10, "labelled or embedded"),
    "style": Experiment(conduct_style, lambda made: style_report(made.study), TAKES, "made up"),
    "assign": Experiment(study_assign, assign_report, 5),
    "mutual": Experiment(study_mutual, mutual_report, 1),
    "landmarks": Experiment(study_landmarks, landmarks_report, 5),
}
"""By name."""
