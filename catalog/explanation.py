"""What there is to say of the distances of two clips: plain data, complete enough to draw.

`Explanation.to_dict` is what `motionary explain --format json` writes. Seconds count from a clip's first
frame, at the common rate; "compared frames" are those of table `resampled`, low-motion ones merged.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from motionary.catalog.warp_pieces import PairWarp


@dataclass(frozen=True)
class ExplainedClip:
    """One of the two.

    Parameters
    ----------
    name : str
        The clip_id, or the file as it was given.
    clip_id, cluster_id, label : str, int, str or None
        None for a file, and the label where there is none.
    seconds : float
        From the first frame to the last.
    first_frame, last_frame : list of int
        The frames at the common rate that each compared frame stands for, both included.
    """

    name: str
    clip_id: str | None
    cluster_id: int | None
    label: str | None
    seconds: float
    first_frame: list[int]
    last_frame: list[int]


@dataclass(frozen=True)
class Span:
    """A stretch of a clip.

    Parameters
    ----------
    first, last : int
        Compared frames, low-motion ones merged; both included.
    first_frame, last_frame : int
        Frames at the common rate.
    start_seconds, end_seconds : float
        When those two are shown.
    """

    first: int
    last: int
    first_frame: int
    last_frame: int
    start_seconds: float
    end_seconds: float


@dataclass(frozen=True)
class Zone:
    """A similar zone, and the cheaper way through it.

    Parameters
    ----------
    a, b : Span
        Where it lies in both clips.
    segment_a, segment_b : int
        Which of the threshold's segments it joins.
    chosen : bool
        Whether it belongs to the cheapest cover.
    backward : bool
        Whether the cheaper way plays `b` backward.
    distance : float
        Its B-DTW.
    path_a, path_b : list of int (L,)
        The compared frames along the cheaper way.
    contributions : dict of str to float
        What every joint, and travel, adds to the distance.
    """

    a: Span
    b: Span
    segment_a: int
    segment_b: int
    chosen: bool
    backward: bool
    distance: float
    path_a: list[int]
    path_b: list[int]
    contributions: dict[str, float]


@dataclass(frozen=True)
class CurvePoint:
    """S-DTW at one threshold.

    Parameters
    ----------
    threshold, weight : float
        lambda, and what the weighted distance multiplies S-DTW with [DC eq. 8].
    limit : float
        The greatest cost inside a zone's region [DC eq. 6].
    distance : float
        S-DTW: the sum over the chosen zones.
    segments_a, segments_b : list of Span
        What the cover has to touch.
    zones : list of Zone
        All of them, in time of `a`.
    contributions : dict of str to float
        What every joint, and travel, adds to the distance.
    """

    threshold: float
    weight: float
    limit: float
    distance: float
    segments_a: list[Span]
    segments_b: list[Span]
    zones: list[Zone]
    contributions: dict[str, float]


@dataclass(frozen=True)
class Part:
    """What a joint, or travel, adds to a distance.

    Parameters
    ----------
    name : str
        As people read it.
    adds : float
    share, of_most : float
        Of the distance, and of what adds most; 0 where nothing is added.
    """

    name: str
    adds: float
    share: float
    of_most: float


@dataclass(frozen=True, repr=False)
class Explanation:
    """What the distances of two clips are made of; lengths are in the features' unit, leg lengths about.

    Parameters
    ----------
    a, b : ExplainedClip
    metric : {"dtw", "b_dtw", "weighted", "fuzzy"}
        The distance that was asked about; the others are there as well.
    features : {"pose+travel", "paper"}
        What was compared.
    frame_rate : float
        The common rate, frames a second.
    distances : dict of str to float
        dtw, b_dtw, weighted, fuzzy_low, fuzzy_high.
    contributions : dict of str to dict of str to float
        For each of them what every joint, and travel, adds; they add up to it.
    curve : list of CurvePoint
        By threshold.
    warp : PairWarp
        The whole clips on each other: DTW's way where the metric is dtw, else B-DTW's, which is the curve's
        at lambda = 1.
    """

    a: ExplainedClip
    b: ExplainedClip
    metric: str
    features: str
    frame_rate: float
    distances: dict[str, float]
    contributions: dict[str, dict[str, float]]
    curve: list[CurvePoint]
    warp: PairWarp

    @property
    def upper_end(self) -> str:
        """The distance of `metric`; of the fuzzy ones the greater."""
        return "fuzzy_high" if self.metric == "fuzzy" else self.metric

    def parts(self, distance: str) -> list[Part]:
        """List what every joint, and travel, adds to one of `distances`, the most first."""
        added = sorted(self.contributions[distance].items(), key=lambda one: -one[1])
        total, most = sum(value for _, value in added) or 1.0, added[0][1] or 1.0
        return [Part(name.replace("_", " "), value, value / total, value / most) for name, value in added]

    def to_dict(self) -> dict[str, Any]:
        """Return it as dicts, lists, text and numbers, as JSON holds them."""
        return asdict(self)

    def __repr__(self) -> str:
        ends = ("fuzzy_low", "fuzzy_high") if self.metric == "fuzzy" else (self.metric,)
        values = " to ".join(f"{self.distances[end]:.4f}" for end in ends)
        return f"<Explanation {self.a.name} | {self.b.name}: {self.metric} {values}>"
