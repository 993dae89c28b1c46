"""The papers' experiments, on a labelled catalog of one's own."""

from motionary.workflows.reproduce.better import better_report, study_better
from motionary.workflows.reproduce.dtw_curve import study_dtw_curve
from motionary.workflows.reproduce.report import report

EXPERIMENTS = {
    "dtw-curve": (study_dtw_curve, report),
    "dtw-curve-better": (study_better, better_report),
}
"""By name: what conducts an experiment, and what lays it out for reading."""
