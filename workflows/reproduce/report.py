"""The DTW-Curve experiment in a terminal: the principal figures, beside what the paper says of its own."""

from __future__ import annotations

from rich.console import Group, RenderableType

from motionary.pipeline.distances import THRESHOLDS
from motionary.workflows.reproduce.draws import RULES, WHOLE
from motionary.workflows.reproduce.dtw_curve import Experiment
from motionary.workflows.reproduce.study import Combination, Mean, Study
from motionary.workflows.tables import text_table

FIRST = RULES[0]

COLUMNS = {
    "reward_punish": "r.-p.",
    "ari": "ARI",
    "nmi": "NMI",
    "mean_average_precision": "mAP",
    "nearest_neighbour": "1-NN",
    "ari_strip": "by strip",
    "ari_modularity": "by modularity",
    "ari_silhouette": "by silhouette",
}

_LEGEND = (
    "r.-p.: reward-punish value over its best; r.-p., ARI and NMI at the true number of classes; "
    "by ...: ARI where that rule cuts.\n± half of the 95% interval over draws (normal): how much the draw "
    "matters, not how other clips would score. All combinations: --format json."
)

# What the paper compares, what `motionary run --paper` takes, what `motionary run` takes, and between.
NAMED = {
    "DTW as in the paper": Combination("paper", "dtw", "complete"),
    "run --paper": Combination("paper", "weighted", "complete"),
    "paper's fuzzy": Combination("paper", "fuzzy_0.5", "fuzzy"),
    "paper's features, Ward": Combination("paper", "weighted", "ward"),
    "new features, complete": Combination("pose+travel", "weighted", "complete"),
    "run (default)": Combination("pose+travel", "weighted", "ward"),
    "default by DTW": Combination("pose+travel", "dtw", "ward"),
}


def report(experiment: Experiment) -> RenderableType:
    """Lay out an experiment for reading; the rows of every combination are `Study.to_arrow`."""
    study = experiment.study
    parts = [
        *experiment.notes,
        "",
        _principal_table(study),
        _LEGEND,
        "",
        _rules_table(study),
        "",
        _thresholds_table(study),
        "",
        *_beside_the_paper(study),
    ]
    return Group(*parts)


def _principal_table(study: Study) -> RenderableType:
    shown = [one for one in study.combinations if one.distance in ("dtw", "b_dtw", "weighted", "fuzzy_0.5")]
    rows = [
        [one.features, one.linkage, one.distance, *(spread(study.mean(FIRST, one, name)) for name in COLUMNS)]
        for one in sorted(shown, key=lambda one: (one.features, one.linkage))
    ]
    return text_table(
        ["features", "linkage", "distance", *COLUMNS.values()], rows, f"Draws of {FIRST} clips a class"
    )


def _rules_table(study: Study) -> RenderableType:
    rows = [
        [name, *(spread(study.mean(rule, one, "ari")) for rule in (*RULES, WHOLE))]
        for name, one in NAMED.items()
    ]
    return text_table(
        ["choice", *RULES, WHOLE], rows, "ARI at the true number of classes, by the sizes of the classes"
    )


def _thresholds_table(study: Study) -> RenderableType:
    names = {f"{one:g}": "b_dtw" if one == 1 else f"s_dtw_{one:g}" for one in THRESHOLDS}
    settings = [
        (features, linkage) for features in ("paper", "pose+travel") for linkage in ("complete", "ward")
    ]
    rows = [
        [
            shown,
            *(
                spread(study.mean(FIRST, Combination(features, name, linkage), "ari"))
                for features, linkage in settings
            ),
        ]
        for shown, name in {**names, "weighted": "weighted"}.items()
    ]
    return text_table(
        ["lambda", *(f"{features}, {linkage}" for features, linkage in settings)],
        rows,
        f"ARI of single thresholds, draws of {FIRST} clips a class (the paper's weight has its peak at .7)",
    )


def _beside_the_paper(study: Study) -> list[str]:
    dtw, weighted, fuzzy = (NAMED[name] for name in ("DTW as in the paper", "run --paper", "paper's fuzzy"))

    def against_dtw(measure: str) -> str:
        pieces = [f"DTW {spread(study.mean(FIRST, dtw, measure))}"]
        for name, one in (("weighted", weighted), ("fuzzy", fuzzy)):
            difference = spread(study.mean(FIRST, one, measure, minus=dtw), sign=True)
            pieces.append(
                f"{name} {spread(study.mean(FIRST, one, measure))} ({difference} against DTW, set by set)"
            )
        return ", ".join(pieces)

    return [
        "Beside the paper (its features; complete linkage, fuzzy linkage for the fuzzy distance):",
        "Figure 9. The paper: the threshold strip of the true number of clusters is narrow by DTW, and "
        "broader by the weighted and the fuzzy distance.",
        f"  Here, width over the highest merge: {against_dtw('true_strip')}.",
        "Figure 10. The paper: at that number both have larger reward-punish values than DTW, none the best.",
        f"  Here, value over its best: {against_dtw('reward_punish')}.",
    ]


def spread(mean: Mean, sign: bool = False) -> str:
    """Show a mean with half of its interval."""
    value = f"{mean.value:+.2f}" if sign else f"{mean.value:.2f}"
    if mean.low is None or mean.high is None:
        return value
    return f"{value} ±{(mean.high - mean.low) / 2:.2f}"
