"""What can be set, one frozen dataclass per stage.

Every field's docstring gives its symbol where a paper has one, its unit, its default and its source.
A configuration is checked when it is made and never rewrites itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from motionary.pipeline.canonical import Convention
from motionary.pipeline.joint_weights import joint_weights

FeatureKind = Literal["pose+travel", "paper"]
Metric = Literal["dtw", "b_dtw", "weighted", "fuzzy"]
Effort = Literal["fast", "full"]
Spacing = Literal["equal", "boundaries"]
ComparedPairs = Literal["all", "pruned", "landmarks"]
LinkageMethod = Literal["complete", "ward", "average", "fuzzy"]


@dataclass(frozen=True)
class ReadConfig:
    """How files are read where they do not say it themselves; see `motionary.pipeline.readers.read_motion`.

    Parameters
    ----------
    position_rule : {"add", "replace"}, optional
        Whether a BVH's position channels are added to the OFFSET or replace it; found out by default.
    up : {"y", "z"}
        The vertical axis of BVH and AMC; other formats say it.
    unit : float, optional
        Metres in one source unit.
    keep_first_frame : bool
        Keep a rest pose in frame 0 that the motion jumps away from.
    """

    position_rule: Literal["add", "replace"] | None = None
    up: Literal["y", "z"] = "y"
    unit: float | None = None
    keep_first_frame: bool = False

    def __post_init__(self) -> None:
        _one_of("position_rule", self.position_rule, (None, "add", "replace"))
        _one_of("up", self.up, ("y", "z"))


@dataclass(frozen=True)
class FeatureConfig:
    """From motion to the vectors that are compared [DC 4.1, 4.2].

    Parameters
    ----------
    kind : {"pose+travel", "paper"}
        59 values a frame, or the 54 of the paper's pose at the origin.
    frame_rate : float
        Frames a second that every motion is brought to; 30 by default.
    travel_time : float
        tau, seconds: weight of the root's velocity against the pose; .10 by our trial.
    epsilon : float
        Merging of low-motion frames, in the feature's unit; 0.1 by our trial. 0 merges nothing.
    criterion : {"sum", "mean"}
        The text's rule (the sum of inner differences stays under epsilon), or equations 4-5 (their mean).
    conventions : tuple of Convention
        A user's own joint-name conventions, tried before the built-in ones.
    """

    kind: FeatureKind = "pose+travel"
    frame_rate: float = 30.0
    travel_time: float = 0.10
    epsilon: float = 0.1
    criterion: Literal["sum", "mean"] = "sum"
    conventions: tuple[Convention, ...] = ()

    def __post_init__(self) -> None:
        _one_of("kind", self.kind, ("pose+travel", "paper"))
        _one_of("criterion", self.criterion, ("sum", "mean"))
        _at_least("frame_rate", self.frame_rate, 1.0)
        _at_least("travel_time", self.travel_time, 0.0)
        _at_least("epsilon", self.epsilon, 0.0)


@dataclass(frozen=True)
class DistanceConfig:
    """The DTW-Curve's thresholds and the size of a tile [DC 4.3, 5].

    Parameters
    ----------
    thresholds : {"midpoints", "random"}
        lambda: the middle of each of the paper's seven intervals, or one drawn in each as the paper does;
        1 is always the eighth.
    seed : int
        Of the draw, under "random".
    tile : int, optional
        Clips a side of a tile of pairs, about; by default as many as the library's size makes fit, see
        `motionary.pipeline.layout.side_for`. The results do not depend on it.
    pairs : {"all", "pruned", "landmarks"}
        Every pair is compared; or those alone whose weighted distance may be at most mu, which give the same
        clusters as all where complete linkage is cut there, see `motionary.pipeline.distances.pruned`; or
        those of some clips and of clusters, which give nearly the same, see
        `motionary.pipeline.clustering.landmarks`.
    """

    thresholds: Literal["midpoints", "random"] = "midpoints"
    seed: int = 0
    tile: int | None = None
    pairs: ComparedPairs = "all"

    def __post_init__(self) -> None:
        _one_of("pairs", self.pairs, ("all", "pruned", "landmarks"))
        _one_of("thresholds", self.thresholds, ("midpoints", "random"))
        _at_least("seed", self.seed, 0)
        if self.tile is not None:
            _at_least("tile", self.tile, 1)


@dataclass(frozen=True)
class ClusterConfig:
    """Linkage, cut and naming [DC 5].

    Parameters
    ----------
    primary : {"ward", "complete", "average", "fuzzy"}
        The linkage whose clusters are published, named and aligned. Default ward; `--paper` takes complete.
    metric : {"weighted", "dtw", "b_dtw"}
        The distance it works on; fuzzy linkage has its own.
    fuzzy_tau : float
        tau of equation 11, 0 (single linkage) to 1 (complete); .5 as in the paper.
    cut : {"auto", "strip"}
        How the number of clusters is found where neither `threshold` nor `n_clusters` is given: labels,
        else modularity; or the widest threshold strip, the paper's idea.
    threshold : float, optional
        mu: merges above it are undone.
    n_clusters : int, optional
        kappa: exactly that many clusters.
    label_column : str
        The supplied label that clusters are named and scored by.
    reach : float
        How many times the furthest labelled member's distance to the reference an unlabelled clip may lie
        from it and still be named; 1.5 by our trial.
    landmarks : int, optional
        n, where not all pairs are compared but those of landmarks: clips of which every pair is; by default
        20 sqrt(N), a thousand at least.
    """

    primary: LinkageMethod = "ward"
    metric: Literal["weighted", "dtw", "b_dtw"] = "weighted"
    fuzzy_tau: float = 0.5
    cut: Literal["auto", "strip"] = "auto"
    threshold: float | None = None
    n_clusters: int | None = None
    label_column: str = "action"
    reach: float = 1.5
    landmarks: int | None = None

    def __post_init__(self) -> None:
        _one_of("primary", self.primary, ("ward", "complete", "average", "fuzzy"))
        _one_of("metric", self.metric, ("weighted", "dtw", "b_dtw"))
        _one_of("cut", self.cut, ("auto", "strip"))
        if not 0 <= self.fuzzy_tau <= 1:
            raise ValueError(f"fuzzy_tau is {self.fuzzy_tau}; it must lie in 0 .. 1")
        if self.threshold is not None and self.n_clusters is not None:
            raise ValueError(
                f"threshold ({self.threshold}) and n_clusters ({self.n_clusters}) are both given; give one"
            )
        if self.n_clusters is not None:
            _at_least("n_clusters", self.n_clusters, 1)
        if self.threshold is not None:
            _at_least("threshold", self.threshold, 0)
        _at_least("reach", self.reach, 0)
        if self.landmarks is not None:
            _at_least("landmarks", self.landmarks, 1)


@dataclass(frozen=True)
class AlignmentConfig:
    """CoTW inside each cluster, and the similarity index that chooses its reference [CoTW 3-5].

    Parameters
    ----------
    search : {"fast", "full"}
        How segment length and slack are found where neither a length nor a number of segments is given: the
        whole grid for references of up to 96 frames and coarse to fine above (default), or the whole grid
        for those of up to 2,000.
    alpha : float
        Weight of distortion against correlation in the search; .5 as in the paper.
    segment_length : int, optional
        L, frames at the common rate; the length of a stride, for example. Of more than a reference has, all.
    segments : int, optional
        The number of segments instead, such as the number of actions shown; of a reference too short for
        them, as many as have 4 frames. Segments of 4 frames, like a single one, cannot be stretched.
    slack : int, optional
        delta, frames, where `segment_length` or `segments` is given; by default the largest the method
        allows, L - 4 [CoTW 4], and never more.
    weights : {"full", "legs", "arms"} or mapping
        What the alignment attends to: a preset of Table 2, or canonical joints and their weights; see
        `motionary.pipeline.joint_weights.joint_weights`.
    spacing : {"equal", "boundaries"}
        Nodes every L frames, or each where the reference pauses nearby.
    open_ends : bool
        Whether a reference's first and last frame may meet other frames than the clip's.
    """

    search: Effort = "fast"
    alpha: float = 0.5
    segment_length: int | None = None
    segments: int | None = None
    slack: int | None = None
    weights: str | dict[str, float] = "full"
    spacing: Spacing = "equal"
    open_ends: bool = False

    def __post_init__(self) -> None:
        _one_of("search", self.search, ("fast", "full"))
        _one_of("spacing", self.spacing, ("equal", "boundaries"))
        if not 0 <= self.alpha < float("inf"):
            raise ValueError(f"alpha is {self.alpha}; it must be at least 0 and finite")
        if self.segment_length is not None and self.segments is not None:
            raise ValueError(
                f"segment_length ({self.segment_length}) and segments ({self.segments}) are both given; "
                "give one"
            )
        if self.segment_length is not None:
            _at_least("segment_length", self.segment_length, 4)
        if self.segments is not None:
            _at_least("segments", self.segments, 1)
        if self.slack is not None:
            _at_least("slack", self.slack, 0)
            if self.segment_length is None and self.segments is None:
                raise ValueError(f"slack ({self.slack}) is given alone; give segment_length or segments too")
            if self.segment_length is not None and self.slack > self.segment_length - 4:
                raise ValueError(
                    f"slack is {self.slack} and segment_length {self.segment_length}; "
                    f"slack may be at most segment_length - 4 = {self.segment_length - 4}"
                )
        if not joint_weights(self.weights).any():
            raise ValueError(f"weights {self.weights!r} are all 0; weigh at least one joint")


@dataclass(frozen=True)
class PipelineConfig:
    """The settings of every stage together."""

    read: ReadConfig = field(default_factory=ReadConfig)
    features: FeatureConfig = field(default_factory=FeatureConfig)
    distances: DistanceConfig = field(default_factory=DistanceConfig)
    clusters: ClusterConfig = field(default_factory=ClusterConfig)
    alignment: AlignmentConfig = field(default_factory=AlignmentConfig)

    def __post_init__(self) -> None:
        clusters = self.clusters
        cut_by_mu = (clusters.primary, clusters.metric) == (
            "complete",
            "weighted",
        ) and clusters.threshold is not None
        if self.distances.pairs == "pruned" and not cut_by_mu:
            raise ValueError(
                "pairs are pruned where complete linkage on the weighted distance is cut at a threshold, and "
                f"here primary is {clusters.primary!r}, metric {clusters.metric!r} and threshold "
                f"{clusters.threshold}; set the three, or compare all pairs"
            )
        if clusters.landmarks is not None and self.distances.pairs != "landmarks":
            raise ValueError(
                f"clusters.landmarks is {clusters.landmarks}, and distances.pairs {self.distances.pairs!r}; "
                "set that to 'landmarks', or leave the landmarks out"
            )

    @property
    def most_distance(self) -> float | None:
        """The weighted distance beyond which pairs are not compared, mu; None where all are."""
        return self.clusters.threshold if self.distances.pairs == "pruned" else None


def config_of(settings: Mapping[str, Mapping[str, Any]]) -> PipelineConfig:
    """Make the settings that `dataclasses.asdict` turned into plain values again.

    Raises
    ------
    TypeError, ValueError
        There is no such setting, or it is out of range.
    """
    features = dict(settings["features"])
    features["conventions"] = tuple(Convention(**one) for one in features["conventions"])
    return PipelineConfig(
        ReadConfig(**settings["read"]),
        FeatureConfig(**features),
        DistanceConfig(**settings["distances"]),
        ClusterConfig(**settings["clusters"]),
        AlignmentConfig(**settings["alignment"]),
    )


def _one_of(name: str, value: object, allowed: tuple[object, ...]) -> None:
    if value not in allowed:
        raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(map(repr, allowed))}")


def _at_least(name: str, value: float, least: float) -> None:
    if not value >= least:
        raise ValueError(f"{name} is {value}; it must be at least {least:g}")
