"""AMASS: an NPZ of SMPL pose parameters, for a body that the file only names.

A row of `poses` is one rotation vector a joint, of SMPL (24 joints, 72 values), SMPL-H (52, 156) or SMPL-X
(55, 165). The first 22 are the same joints in all three and are kept; hands, jaw and eyes are left out.
`trans` moves the body, `mocap_framerate` or `mocap_frame_rate` is the rate. AMASS is Z-up: the world is
turned by -90 degrees about X.

**Skeleton.** Where the joints lie follows from a licensed body model, which is not here, and from `betas`,
which mean nothing without it. Every take gets one mean body instead, 1.70 m tall, from published proportions
of stature H: limbs, ankle and shoulder of Drillis and Contini (1966) as in Winter, *Biomechanics and Motor
Control of Human Movement*, fig. 4.1; hip joint centres .05 H from the middle (Bell, Pedersen, Brand 1990: .36
of the distance of the iliac spines); and, ours, the pelvis .02 H over the hips, the trunk up to the neck
(.85 H) in four equal parts, the head joint at .91 H. So rotations are the file's, and bones are not; the
pelvis stands at `trans`, off by a constant that features do not see; and speeds in leg lengths are off by how
much the actor's legs are longer or shorter than this body's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import FloatArray, Motion, Skeleton
from motionary.pipeline.readers.arrays import Declared, declared_arrays, read_arrays
from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.extent import check_extent
from motionary.pipeline.readers.text import LARGEST

_MODELS = {72: ("SMPL", 24), 156: ("SMPL-H", 52), 165: ("SMPL-X", 55)}
_RATES = ("mocap_framerate", "mocap_frame_rate")
_SMALL = 1 << 16  # bytes of the arrays that hold one value
_BLOCK = 1 << 11  # frames turned at a time: what is needed on the way is small beside the take
_STATURE = 1.70

_UPRIGHT = Rotation.from_euler("X", -90, degrees=True)  # Z up becomes Y up

# Joint, parent, offset in shares of stature; SMPL's rest pose is a T, Y up, facing +Z, its left at +X.
_TRUNK = 0.30 / 4
_MIDDLE = (
    ("Pelvis", None, (0, 0, 0)),
    ("Spine1", "Pelvis", (0, _TRUNK, 0)),
    ("Spine2", "Spine1", (0, _TRUNK, 0)),
    ("Spine3", "Spine2", (0, _TRUNK, 0)),
    ("Neck", "Spine3", (0, _TRUNK, 0)),
    ("Head", "Neck", (0, 0.06, 0)),
)
_LEFT = (
    ("Hip", "Pelvis", (0.05, -0.02, 0)),
    ("Knee", "Hip", (0, -0.245, 0)),
    ("Ankle", "Knee", (0, -0.246, 0)),
    ("Foot", "Ankle", (0, -0.030, 0.075)),  # the ball: half the foot's .152 H before the ankle
    ("Collar", "Spine3", (0.03, 0.043, 0)),
    ("Shoulder", "Collar", (0.099, 0, 0)),  # .129 H from the middle and .818 H high
    ("Elbow", "Shoulder", (0.186, 0, 0)),
    ("Wrist", "Elbow", (0.146, 0, 0)),
)
_ORDER = (
    "Pelvis L_Hip R_Hip Spine1 L_Knee R_Knee Spine2 L_Ankle R_Ankle Spine3 L_Foot R_Foot Neck "
    "L_Collar R_Collar Head L_Shoulder R_Shoulder L_Elbow R_Elbow L_Wrist R_Wrist"
).split()


def read_amass(path: Path) -> Motion:
    """Read an AMASS file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Motion
        22 joints of the module's mean body, metres, Y up.

    Raises
    ------
    ReadError
        The file is no NPZ, lacks an array or holds one that cannot be: of another shape, not of numbers, of
        Python objects, too large.
    """
    declared = declared_arrays(path, ("poses", "trans"))
    frames, width = _size(path, declared)
    about = read_arrays(path, (), (*_RATES, "gender"), largest=_SMALL)
    fps = _rate(path, about)
    check_extent(path, frames, fps)
    arrays = read_arrays(path, tuple(declared))
    model, joints = _MODELS[width]
    root_position, rotations = np.empty((frames, 3)), np.empty((frames, len(_ORDER), 4))
    for first in range(0, frames, _BLOCK):
        rows = slice(first, first + _BLOCK)
        rotations[rows] = _turned(_numbers(path, "poses", arrays["poses"][rows]))
        root_position[rows] = _UPRIGHT.apply(_numbers(path, "trans", arrays["trans"][rows]))
    return Motion(
        name=path.stem,
        skeleton=mean_body(),
        fps=fps,
        root_position=root_position,
        rotations=rotations,
        unit=1.0,
        source=str(path),
        notes=(
            f"{model} pose{_gender(about)}: {len(_ORDER)} of {joints} joints kept, without hands and face",
            f"a mean body of {_STATURE:.2f} m, from proportions: the file holds none",
            "world turned by -90 degrees about X: AMASS is Z-up",
        ),
    )


def mean_body() -> Skeleton:
    """Return the skeleton that stands in for SMPL's, in metres: see the module."""
    bones: dict[str, tuple[str | None, tuple[float, float, float]]]
    bones = {name: (parent, offset) for name, parent, offset in _MIDDLE}
    for side, sign in (("L", 1), ("R", -1)):
        for name, parent, (x, y, z) in _LEFT:
            above = parent if parent in bones else f"{side}_{parent}"
            bones[f"{side}_{name}"] = (above, (sign * x, y, z))
    parents = tuple(-1 if bones[name][0] is None else _ORDER.index(str(bones[name][0])) for name in _ORDER)
    return Skeleton(tuple(_ORDER), parents, _STATURE * np.array([bones[name][1] for name in _ORDER]))


def _size(path: Path, declared: dict[str, Declared]) -> tuple[int, int]:
    """Return how many frames, and values a pose, the file declares."""
    poses, trans = declared["poses"].shape, declared["trans"].shape
    if len(poses) != 2 or poses[1] not in _MODELS:
        known = ", ".join(f"{width} ({name})" for width, (name, _) in _MODELS.items())
        what = f"'poses' has shape {poses}; a row has one of {known} values"
        raise ReadError(path, None, what, "give AMASS's own file, with the poses of all joints")
    if trans != (poses[0], 3):
        what = f"'trans' has shape {trans} and 'poses' {poses[0]} rows"
        raise ReadError(path, None, what, "both have a row a frame: copy the file again")
    return poses[0], poses[1]


def _turned(poses: FloatArray) -> FloatArray:
    """Return poses (frames x values) as quaternions (frames x 22 x 4) in a world that is Y up."""
    turns = Rotation.from_rotvec(poses[:, : 3 * len(_ORDER)].reshape(-1, 3))
    rotations = turns.as_quat().reshape(len(poses), len(_ORDER), 4)
    rotations[:, 0] = (_UPRIGHT * Rotation.from_quat(rotations[:, 0])).as_quat()
    return rotations


def _numbers(path: Path, name: str, values: np.ndarray) -> FloatArray:
    usable = values.dtype.kind in "fiu"
    values = values.astype(np.float64) if usable else values
    if not (usable and (np.abs(values) <= LARGEST).all()):  # false for what is not a number
        what = f"{name!r} holds values that are no numbers, or larger than {LARGEST:g}"
        raise ReadError(path, None, what, "cut the damaged frames, or copy the file again")
    return values


def _rate(path: Path, arrays: dict[str, np.ndarray]) -> float:
    rate = next((name for name in _RATES if name in arrays), None)
    if rate is None:
        mend = "AMASS's files of a body's shape are no motion; of another file, add the rate"
        raise ReadError(path, None, f"the file has neither {_RATES[0]!r} nor {_RATES[1]!r}", mend)
    values = _numbers(path, rate, arrays[rate])
    if values.size != 1:
        raise ReadError(path, None, f"{rate!r} has shape {values.shape}", "it is one number")
    return float(values.item())


def _gender(arrays: dict[str, np.ndarray]) -> str:
    """Return the file's word for the body, where it is one of AMASS's."""
    value = arrays["gender"].item() if "gender" in arrays and arrays["gender"].size == 1 else ""
    word = value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)
    return f" ({word})" if word in ("male", "female", "neutral") else ""
