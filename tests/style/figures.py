"""Figures to try style on: a small rig that moves at random, and the embedded library's bodies."""

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.synthetic import BODIES, STYLES
from motionary.pipeline.synthetic.actions import ACTIONS
from motionary.pipeline.synthetic.conventions import MIXAMO
from motionary.pipeline.synthetic.posture import placed, pose
from motionary.pipeline.synthetic.styles import apply


def performed(
    action: str,
    style: str = "neutral",
    body: str = "alex",
    frames: int = 50,
    heading: float = 0.0,
    place: tuple[float, float] = (0.0, 0.0),
    convention=MIXAMO,
) -> Motion:
    """Perform an action evenly in `frames` frames: any two such clips are aligned."""
    who, how = BODIES[body], STYLES[style]
    channels = apply(how, ACTIONS[action].curves(np.linspace(0.0, 1.0, frames), how))
    posture = placed(pose(channels, who), heading, place)
    return convention.motion(posture, who, 30.0, f"{action}_{style}_{body}")


def shaken(motion: Motion, seed: int, amount: float = 0.4) -> Motion:
    """Turn every joint of every frame a little more, and move the root, at random."""
    rng = np.random.default_rng(seed)
    more = Rotation.from_rotvec(rng.uniform(-amount, amount, (motion.rotations[..., 0].size, 3)))
    rotations = (Rotation.from_quat(motion.rotations.reshape(-1, 4)) * more).as_quat()
    # Signs of quaternions mean nothing; nobody may depend on them.
    rotations *= rng.choice([-1.0, 1.0], (len(rotations), 1))
    root = motion.root_position + rng.uniform(-amount, amount, motion.root_position.shape) * 10
    return Motion(
        f"{motion.name}_{seed}",
        motion.skeleton,
        motion.fps,
        root,
        rotations.reshape(motion.rotations.shape),
        unit=motion.unit,
    )


def moved(motion: Motion, turn: float, place: tuple[float, float, float]) -> Motion:
    """Turn a motion about the vertical axis through the origin, and set it down elsewhere."""
    whole = Rotation.from_rotvec([0.0, turn, 0.0])
    rotations = motion.rotations.copy()
    rotations[:, 0] = (whole * Rotation.from_quat(rotations[:, 0])).as_quat()
    root = whole.apply(motion.root_position) + place
    return Motion(motion.name, motion.skeleton, motion.fps, root, rotations, unit=motion.unit)


def renamed(motion: Motion, joint: int, name: str) -> Motion:
    """Call one joint something else."""
    names = list(motion.skeleton.names)
    names[joint] = name
    skeleton = Skeleton(tuple(names), motion.skeleton.parents, motion.skeleton.offsets)
    return Motion(motion.name, skeleton, motion.fps, motion.root_position, motion.rotations)
