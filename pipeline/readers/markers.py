"""Marker sets: which markers make which of the 19 canonical joints.

A joint is the mean of markers, each counted as often as the number before it says: `LASI + RASI`, or
`3 LASI + 3 LPSI + LKNE`. A set fits a file that has all its markers. As joint names, markers are compared
without case and without a subject's name (`Anna:LASI`). A user's own set is written like any convention,
`[conventions.NAME]` in the configuration, with such means for names.

Joint centres where the file has them (`LKJC`), else markers on the skin, which lie off the joints: knees,
ankles and elbows some centimetres to the outside. So takes of one marker set compare with each other best.
A hip is put a seventh of the way from the middle of the two markers over it to the knee: a joint centre lies
about .07 m below (Bell, Pedersen, Brand 1990: .30 of the distance of the iliac spines, and that is .24 m).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, plain_name
from motionary.pipeline.motion import FloatArray
from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.text import shown

LONGEST_GAP = 0.5
"""Seconds that a marker may be unseen."""

_TERM = re.compile(r"\s*(?:(\d{1,4})\s+)?(.+?)\s*")


def joints_of(
    path: Path, labels: Sequence[str], points: FloatArray, fps: float, conventions: Iterable[Convention] = ()
) -> tuple[FloatArray, list[str]]:
    """Compute the canonical joints of a take.

    Parameters
    ----------
    path : Path
        For the errors.
    labels : sequence of str
        N names of markers; further points have none.
    points : array (T, at least N, 3)
        Not a number where a marker is unseen.
    fps : float
    conventions : iterable of Convention
        A user's own sets, tried before the built-in ones.

    Returns
    -------
    joints : array (T, 19, 3)
    notes : list of str
        Which set, and what was filled in.

    Raises
    ------
    ReadError
        No set fits, a marker that it needs is unseen for longer than `LONGEST_GAP`, or stands there twice.
    """
    places: dict[str, list[int]] = {}
    for index, label in enumerate(labels[: points.shape[1]]):
        places.setdefault(plain_name(label), []).append(index)
    fitting = _fitting_set(path, labels, set(places), [*conventions, *MARKER_SETS])
    filled: dict[str, FloatArray] = {}
    gaps = 0
    for name in sorted(set().union(*map(terms_of, fitting.joints.values()))):
        indices = places[name]
        if len(indices) > 1:
            twice = ", ".join(shown(labels[index]) for index in indices[:4])
            mend = "export each subject alone, and each marker once"
            raise ReadError(path, None, f"the file has marker {name!r} more than once: {twice}", mend)
        values = points[:, indices[0]]
        gaps += int(np.isnan(values).any(axis=1).sum())
        filled[name] = _filled(path, labels[indices[0]], values, fps)
    joints = np.stack([_mean(terms_of(fitting.joints[joint]), filled) for joint in CANONICAL_JOINTS], axis=1)
    notes = [f"joints from markers by the set {fitting.name!r}"]
    if gaps:
        notes.append(f"{gaps} unseen places of markers filled in, over at most {LONGEST_GAP:g} s")
    return joints, notes


def terms_of(mean: str) -> dict[str, int]:
    """Split a joint's markers, as the module says, into how often each counts, by their plain names."""
    counts: dict[str, int] = {}
    for part in re.split(r"\s\+\s", mean):
        term = _TERM.fullmatch(part)
        name = plain_name(term[2]) if term else ""
        counts[name] = counts.get(name, 0) + (int(term[1]) if term and term[1] else 1)
    return counts


def _fitting_set(path: Path, labels: Sequence[str], there: set[str], sets: list[Convention]) -> Convention:
    missing = {one.name: set().union(*map(terms_of, one.joints.values())) - there for one in sets}
    for one in sets:
        if not missing[one.name]:
            return one
    nearest = min(missing, key=lambda name: len(missing[name]))
    lacks = ", ".join(sorted(missing[nearest])).upper()
    named = ", ".join(shown(label) for label in labels[:80] if label) or "none"
    raise ReadError(
        path,
        None,
        f"no marker set fits: the nearest, {nearest!r}, misses {lacks}; the file's markers are {named}",
        "say which markers make each of the 19 canonical joints under [conventions.NAME] in the "
        'configuration file, as in pelvis = "LASI + RASI"',
    )


def _filled(path: Path, label: str, values: FloatArray, fps: float) -> FloatArray:
    """Fill in where one marker (T, 3) is unseen."""
    seen = np.flatnonzero(~np.isnan(values).any(axis=1))
    ends = np.concatenate([[-1], seen, [len(values)]])
    gaps = np.diff(ends) - 1
    longest = int(gaps.argmax())
    if not seen.size or gaps[longest] > LONGEST_GAP * fps:
        first = ends[longest] + 1
        raise ReadError(
            path,
            None,
            f"marker {shown(label)} is unseen for {gaps[longest] / fps:.3g} s from frame {first}",
            f"fill gaps over {LONGEST_GAP:g} s in the capture software, or cut the take there",
        )
    frames = np.arange(len(values))
    return np.stack([np.interp(frames, seen, values[seen, axis]) for axis in range(3)], axis=1)


def _mean(terms: dict[str, int], markers: dict[str, FloatArray]) -> FloatArray:
    total = sum(count * markers[name] for name, count in terms.items())
    return np.asarray(total) / sum(terms.values())


def _set(name: str, middle: Sequence[str], left: Sequence[str]) -> Convention:
    """Build a set of mirrored names from the joints of the middle and those of the left side."""
    right = [re.sub(r"\bL(?=[A-Z])", "R", one) for one in left]
    arms, legs = slice(0, 3), slice(3, 7)
    names = [*middle, *left[arms], *right[arms], *left[legs], *right[legs]]
    return Convention(name, dict(zip(CANONICAL_JOINTS, names, strict=True)))


def _vicon(name: str, front: str, back: str) -> Convention:
    """Build Plug-in Gait's full body with the names that its markers before and behind the hips have here."""
    waist = f"L{front} + R{front} + L{back} + R{back}"
    return _set(
        name,
        [
            waist,
            f"2 T10 + 2 STRN + {waist}",
            "C7 + CLAV + T10 + STRN",
            "C7 + CLAV",
            "LFHD + RFHD + LBHD + RBHD",
        ],
        ["LSHO", "LELB", "LWRA + LWRB", f"3 L{front} + 3 L{back} + LKNE", "LKNE", "LANK", "LTOE"],
    )


# Of two that fit, the first counts.
MARKER_SETS: tuple[Convention, ...] = (
    _set(
        "joint-centres",
        [
            "LHJC + RHJC",
            "2 LHJC + 2 RHJC + LSJC + RSJC",
            "LHJC + RHJC + 2 LSJC + 2 RSJC",
            "LSJC + RSJC",
            "LFHD + RFHD + LBHD + RBHD",
        ],
        ["LSJC", "LEJC", "LWJC", "LHJC", "LKJC", "LAJC", "LTOE"],
    ),
    _vicon("plug-in-gait", "ASI", "PSI"),
    _vicon("vicon-waist", "FWT", "BWT"),  # the same on older files, such as CMU's and HDM05's
)
