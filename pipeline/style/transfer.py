"""The style of one clip on another: styled - reference, added to the other [CoTW 6.3].

All three run in the reference's time. With R the local rotations, the root's without its heading, and v, w, h
the root's velocity in its own heading frame, its turning and its height, in leg lengths:

    R_new = R_onto (R_reference^-1 R_styled)
    (v, w, h)_new = (v, w, h)_onto + (v, w, h)_styled - (v, w, h)_reference

and the path and the heading are those that v and w lead along, from where `onto` begins. The paper adds joint
angles and the global displacement; rotations are composed here, so they stay rotations, and displacement is
taken in the heading's frame, so that it does not matter which way any of the three walks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import Convention
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.style.residual import check_same_time
from motionary.pipeline.style.rig import is_one_rig, refuse_markers, rig_difference
from motionary.pipeline.style.root_motion import (
    RootMotion,
    about_vertical,
    features_by_frame,
    retraced,
    root_motion,
    without_heading,
)


def transfer(
    styled: Motion, reference: Motion, onto: Motion, conventions: Sequence[Convention] = ()
) -> Motion:
    """Give a motion the style of another.

    Parameters
    ----------
    styled : Motion
        Aligned to the reference: m frames at its rate.
    reference : Motion
        m frames.
    onto : Motion
        Aligned to the reference; its skeleton, unit, beginning and heading are kept.
    conventions : sequence of Convention
        A user's own joint-name conventions.

    Returns
    -------
    Motion
        m frames. With `styled` the reference itself it is `onto`; with `onto` the reference it is `styled` on
        that body, but for where it begins and faces. Feet are not held to the floor: see `foot_sliding`.

    Raises
    ------
    ValueError
        Frames or rates differ, or the skeletons do; bones may differ in length. Or one is of markers.
    SkeletonError
        No convention fits the skeleton, or it has no legs.
    """
    refuse_markers((styled, reference, onto))
    for motion in (styled, onto):
        check_same_time(motion, reference)
        if not is_one_rig(motion.skeleton, reference.skeleton):
            raise ValueError(f"{rig_difference(motion, reference)}; style is transferred within one rig only")
    motions = (styled, reference, onto)
    roots = [root_motion(one, features_by_frame(one, conventions)) for one in motions]
    place, heading = _new_root(roots, onto)
    turned = [without_heading(one, at.heading) for one, at in zip(motions, roots, strict=True)]
    rotations = (turned[2] * (turned[1].inv() * turned[0])).as_quat().reshape(onto.rotations.shape)
    rotations[:, 0] = (about_vertical(heading) * Rotation.from_quat(rotations[:, 0])).as_quat()
    return replace(
        onto,
        name=f"{onto.name}_in_the_style_of_{styled.name}",
        root_position=place,
        rotations=rotations,
        source=f"style of {styled.source or styled.name} on {onto.source or onto.name}",
    )


def _new_root(roots: list[RootMotion], onto: Motion) -> tuple[FloatArray, FloatArray]:
    """Return the root's places (T, 3), in units of `onto`, and headings (T,)."""
    styled, reference, own = roots
    path, heading = retraced(
        own.steps + (styled.steps - reference.steps),
        own.turns + (styled.turns - reference.turns),
        float(own.heading[0]),
    )
    start = onto.root_position[0] * [1.0, 0.0, 1.0]
    height = onto.root_position[:, 1] + own.leg_length * (styled.height - reference.height)
    place = start + own.leg_length * path
    place[:, 1] = height
    return place, np.asarray(heading)
