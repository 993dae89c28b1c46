"""JSON out of a motion: one object in one line, which with others makes a JSONL file.

| key | is |
|---|---|
| clip_id | what the motion is called |
| fps | frames a second |
| unit | metres in one source unit, or null where unknown |
| joints, parents | J names, the root first, and the place of each one's parent; -1 for the root |
| offsets | J x 3: each joint in its parent's frame, source units |
| positions | T x J x 3: joints in the world, Y up, source units |
| rotations | T x J x 4: local unit quaternions x, y, z, w, the root's into the world; null of markers |

Numbers have six decimals. What else is known of the motion stands before these.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from motionary.pipeline.motion import FloatArray, Motion

DECIMALS = 6


def motion_line(motion: Motion, about: Mapping[str, object]) -> str:
    """Write a motion as a line of JSONL, its end included.

    Parameters
    ----------
    motion : Motion
    about : mapping of str to object
        What else is known of it, such as labels; a key that the motion has itself is the motion's.

    Raises
    ------
    ValueError
        `about` holds a number that JSON does not know.
    """
    skeleton = motion.skeleton
    values = {
        "clip_id": motion.name,
        "fps": motion.fps,
        "unit": motion.unit,
        "joints": skeleton.names,
        "parents": skeleton.parents,
        "offsets": _rounded(skeleton.offsets),
        "positions": _rounded(motion.positions()),
        "rotations": _rounded(motion.rotations) if motion.places is None else None,
    }
    others = {key: value for key, value in about.items() if key not in values}
    line = {"clip_id": motion.name, **others, **values}
    return json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def _rounded(values: FloatArray) -> list:
    return (np.round(values, DECIMALS) + 0.0).tolist()  # no -0.0
