"""The papers' experiments, on a labelled catalog of one's own or on the embedded library."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from motionary.workflows.reproduce.assign import study_assign
from motionary.workflows.reproduce.assign_report import assign_report
from motionary.workflows.reproduce.better import better_report, study_better
from motionary.workflows.reproduce.cotw import study_cotw
from motionary.workflows.reproduce.cotw_report import cotw_report
from motionary.workflows.reproduce.dtw_curve import study_dtw_curve
from motionary.workflows.reproduce.mutual import mutual_report, study_mutual
from motionary.workflows.reproduce.report import report


class Experiment(NamedTuple):
    """What conducts an experiment, what lays it out for reading, and how many draws are usual."""

    conduct: Callable[..., Any]
    report: Callable[..., Any]
    draws: int


EXPERIMENTS = {
    "dtw-curve": Experiment(study_dtw_curve, report, 100),
    "dtw-curve-better": Experiment(study_better, better_report, 100),
    "cotw": Experiment(study_cotw, cotw_report, 10),
    "assign": Experiment(study_assign, assign_report, 5),
    "mutual": Experiment(study_mutual, mutual_report, 1),
}
"""By name."""
