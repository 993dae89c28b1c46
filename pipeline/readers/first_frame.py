"""A rest pose in frame 0, followed by a jump: exporters put it there, and it is no motion.

The rule is free of scale and rate. With s_k the greatest displacement of any joint from frame k to k+1,
frame 0 is dropped when

    s_0 > 5 max(s_1 .. s_8)   and   s_0 > size / 10,

size being the diagonal of the box around the joints of frame 1. The first says that the step is of
another kind than those after it, the second that it is no tremor of a figure that stands still. Clips
of fewer than four frames are left alone: there are too few steps to judge by.

On 270 real clips the first ratio is 24 or more where there is a rest pose and 1.4 or less elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from motionary.pipeline.motion import Motion

JUMP_RATIO = 5.0
JUMP_SHARE = 0.1  # of the body's size
STEPS_AFTER = 8
LEAST_FRAMES = 4


def drop_rest_frame(motion: Motion) -> Motion:
    """Drop frame 0 if the module's rule says that it is a rest pose, and note it.

    Parameters
    ----------
    motion : Motion

    Returns
    -------
    Motion
        The same, or without its first frame.
    """
    if motion.frames < LEAST_FRAMES:
        return motion
    places = _first(motion, STEPS_AFTER + 2).positions()
    steps = np.linalg.norm(np.diff(places, axis=0), axis=-1).max(axis=1)
    size = np.linalg.norm(np.ptp(places[1], axis=0))
    usual = steps[1:].max()
    if not (steps[0] > JUMP_RATIO * usual and steps[0] > JUMP_SHARE * size):
        return motion
    note = (
        f"frame 0 dropped as a rest pose: the step after it is {steps[0]:g}, the next ones at most {usual:g} "
        "(keep_first_frame=True keeps it)"
    )
    return replace(
        motion,
        root_position=motion.root_position[1:],
        rotations=motion.rotations[1:],
        notes=(*motion.notes, note),
    )


def _first(motion: Motion, frames: int) -> Motion:
    return replace(motion, root_position=motion.root_position[:frames], rotations=motion.rotations[:frames])
