"""What the adaptive DTW experiment measures: of two clips, of a known warp, by several constraints.

All methods read the same coordinates, the first principal postures of the reference, weighted by limbs, so
they differ in nothing but the path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from time import perf_counter

import numpy as np

from motionary.pipeline.alignment.adaptive import adaptive_dtw, constrained_dtw, eigenposture_coordinates
from motionary.pipeline.alignment.dtw import dtw
from motionary.pipeline.alignment.limited import limited_dtw
from motionary.pipeline.alignment.path_warp import PathWarp
from motionary.pipeline.alignment.postures import weighted_postures
from motionary.pipeline.canonical import Convention
from motionary.pipeline.evaluation import jerk, longest_stay, mean_distance, path_deviation
from motionary.pipeline.features import sample_times
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.synthetic import TEMPLATE_FPS, SyntheticTake, template
from motionary.workflows.reproduce.cotw_measures import KNOWN, Measurement

Method = Callable[[FloatArray, FloatArray], PathWarp]

TAKES, SEQUENCES, SETTINGS = "takes", "sequences", "settings"
"""Parts of the experiment beside the known warps: single takes, takes joined, radius and K on the takes."""

LIMITED, CONSTRAINED, ADAPTIVE = "constrained DTW, 2 steps", "constrained DTW, K 2", "adaptive DTW"

METHODS: Mapping[str, Method] = {
    "DTW": dtw,
    LIMITED: limited_dtw,
    CONSTRAINED: constrained_dtw,
    ADAPTIVE: adaptive_dtw,
}
"""The paper's three, of which the second is two: what its experiment did, and the recurrence it prints."""

WITH_SETTINGS: Mapping[str, Method] = {
    f"radius {radius}, K {weight:g}": partial(adaptive_dtw, radius=radius, slope_weight=weight)
    for radius in (1, 3, 10)
    for weight in (1.0, 2.0, 3.0, 5.0)
}

_LEAST_FRAMES = 4  # that have a jerk


def measure_pair(
    part: str,
    action: str,
    pair: tuple[str, str],
    moving: Motion,
    reference: Motion,
    rate: float,
    conventions: Iterable[Convention] = (),
    methods: Mapping[str, Method] = METHODS,
) -> list[Measurement]:
    """Align a motion to another of the same joints by several methods.

    Parameters
    ----------
    part, action : str
        Part of the experiment, and what both motions show.
    pair : tuple of str
        Names of the moving motion and the reference.
    moving, reference : Motion
        The motions.
    rate : float
        Frames a second at which they are aligned.
    conventions : iterable of Convention
        A user's own joint names.
    methods : mapping of str to callable
        What aligns them.

    Returns
    -------
    list of Measurement
        For every method, in frames, the deviation from the plain DTW's path and the longest stay; the jerk of
        what the warp shows over the reference's own; the mean distance of what it shows from the reference;
        the seconds that the method took on the coordinates, of which those that pay for standing still seek
        the principal ones once more. Nothing of `LIMITED` where it finds no path between these lengths, and
        nothing at all where the reference has no jerk.

    Raises
    ------
    ValueError
        The motions cannot be compared, or any other method cannot align them.
    """
    one, other = eigenposture_coordinates(*weighted_postures(moving, reference, rate, conventions))
    own_jerk = jerk(other) if len(other) >= _LEAST_FRAMES else 0.0
    if not own_jerk:
        return []
    plain = dtw(one, other)
    rows = []
    for name, align in methods.items():
        start = perf_counter()
        try:
            warp = align(one, other)
        except ValueError:
            if name != LIMITED:
                raise
            continue  # such lengths have no path of short stays, or are too long for it
        seconds, shown = perf_counter() - start, warp.apply(one)
        values = {
            "deviation": path_deviation(warp.source_time, plain.source_time),
            "stay": float(longest_stay(warp.path)),
            "jerk": jerk(shown) / own_jerk,
            "distance": mean_distance(shown, other),
            "seconds": seconds,
        }
        rows += [Measurement(part, action, *pair, name, measure, value) for measure, value in values.items()]
    return rows


def measure_known(take: SyntheticTake) -> list[Measurement]:
    """Find the warp of an embedded take again, against the part of its action's template that it shows.

    Returns
    -------
    list of Measurement
        For every method the mean absolute error of its times, in frames of the take at 30 a second.
    """
    samples = sample_times(take.motion.frames, take.motion.fps, TEMPLATE_FPS)
    shown = np.interp(samples, np.arange(take.motion.frames), take.warp)
    first, last = int(np.ceil(shown[0] - 1e-6)), int(np.floor(shown[-1] + 1e-6))
    truth = np.interp(np.arange(first, last + 1), shown, np.arange(len(samples)))
    performed = template(take.action)
    part = performed.sampled(np.arange(first, last + 1, dtype=np.float64))
    one, other = eigenposture_coordinates(*weighted_postures(take.motion, part, TEMPLATE_FPS))
    return [
        Measurement(
            KNOWN, take.action, take.path, performed.name, name, "error",
            float(np.abs(align(one, other).source_time - truth).mean()),
        )
        for name, align in METHODS.items()
    ]  # fmt: skip
