"""Damaged BVH, ASF and AMC files, for `read_motion` and for the features of what it takes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from random import Random

import numpy as np

from motionary.pipeline.canonical import SkeletonError
from motionary.pipeline.features import motion_features
from motionary.pipeline.readers import ReadError, read_motion
from motionary.pipeline.synthetic import synthetic_library
from motionary.pipeline.writers import write_bvh
from tests.readers.conftest import SMALL_AMC, SMALL_ASF, SMALL_BVH
from tests.torture.fuzz import Fault, Kind, Outcome
from tests.torture.mutation import mutated

MANY = 100_000
"""Joints, bones, channels or words in the cases that are large on purpose."""
LARGE = 80
"""One case of so many is one of these, in turn."""
_FRAMES_KEPT = 12


def _seeds(shared: Path) -> None:
    """Write valid files: a short take of either convention of the embedded library."""
    for place, take in enumerate((synthetic_library(0, 1)[0], synthetic_library(0, 1)[-1])):
        path = shared / f"seed{place}.bvh"
        write_bvh(take.motion, path)
        head, _, frames = path.read_text().partition("MOTION\n")
        count, time, *rows = frames.splitlines()
        rows = rows[:_FRAMES_KEPT]
        path.write_text("\n".join([f"{head}MOTION", f"Frames: {len(rows)}", time, *rows, ""]))


@cache
def _bvh_seeds(shared: Path) -> tuple[str, ...]:
    return (SMALL_BVH, *(path.read_text() for path in sorted(shared.glob("seed*.bvh"))))


def _bvh(rng: Random, number: int, shared: Path) -> Mapping[str, bytes]:
    if number % LARGE == LARGE // 2:
        return {"x.bvh": _LARGE_BVH[number // LARGE % len(_LARGE_BVH)]().encode()}
    return {"x.bvh": mutated(rng.choice(_bvh_seeds(shared)), rng)}


def _asf(rng: Random, number: int, shared: Path) -> Mapping[str, bytes]:
    if number % LARGE == LARGE // 2:
        return {
            "x.asf": _LARGE_ASF[number // LARGE % len(_LARGE_ASF)]().encode(),
            "x.amc": SMALL_AMC.encode(),
        }
    return {"x.asf": mutated(SMALL_ASF, rng), "x.amc": SMALL_AMC.encode()}


def _amc(rng: Random, number: int, shared: Path) -> Mapping[str, bytes]:
    if number % LARGE == LARGE // 2:
        return {
            "x.asf": SMALL_ASF.encode(),
            "x.amc": _LARGE_AMC[number // LARGE % len(_LARGE_AMC)]().encode(),
        }
    return {"x.asf": SMALL_ASF.encode(), "x.amc": mutated(SMALL_AMC, rng)}


def check_motion(shared: Path, folder: Path) -> Outcome:
    """Read the case's motion and compare frames of it."""
    (path,) = (one for one in folder.iterdir() if one.suffix in (".bvh", ".amc"))
    try:
        motion = read_motion(path)
    except ReadError as error:
        check_refusal(error, folder)
        return "refused"
    if not (np.isfinite(motion.root_position).all() and np.isfinite(motion.rotations).all()):
        raise Fault("the motion is not finite")
    try:
        features = motion_features(motion)
    except (ReadError, SkeletonError) as error:
        if not (error.what and error.mend):
            raise Fault(f"no reason or no mend: {error}") from None
        return "read"
    if not np.isfinite(features).all():
        raise Fault("the features are not finite")
    return "read"


def check_refusal(error: ReadError, folder: Path) -> None:
    """Raise `Fault` unless a refusal names a file of the case, a line of it, a reason and a mend."""
    path = Path(error.path)
    if path.parent != folder or not path.is_file():
        raise Fault(f"a refusal names {error.path}, which is no file of the case")
    content = path.read_bytes()
    lines = content.count(b"\n") + content.count(b"\r") + 1
    if error.line is None or not 1 <= error.line <= lines:
        raise Fault(f"a refusal names line {error.line} of {lines}: {error}")
    if not (error.what and error.mend) or "\n" in str(error) or len(str(error)) > len(error.path) + 600:
        raise Fault(f"a refusal is not one line of reason and mend: {str(error)[:2000]!r}")


def _nested() -> str:
    opened = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n" for i in range(MANY))
    return _around(f"{opened}{'}' * MANY}")


def _around(joints: str, frames: str = "3") -> str:
    """Return a BVH whose root holds these joints."""
    head, tail = SMALL_BVH.split("  JOINT Leg")
    motion = (
        tail[tail.index("MOTION") :].replace(" 1 2 3 4 5 6", "").replace("Frames: 3", f"Frames: {frames}")
    )
    return f"{head}{joints}\n}}\n{motion}"


def _siblings(name: str) -> str:
    return _around("".join(f"JOINT {name.format(i)}\n{{\nOFFSET 0 1 0\n}}\n" for i in range(MANY)))


def _bones(begin: str, hierarchy: str) -> str:
    bones = "".join(f"begin\n{begin.format(i)}\nend\n" for i in range(MANY // 4))
    lines = "".join(f"{hierarchy.format(i, i - 1)}\n" for i in range(1, MANY // 4))
    return SMALL_ASF.replace(":bonedata\n", f":bonedata\n{bones}").replace(
        "    femur foot\n", f"    femur foot\n{lines}"
    )


_LARGE_BVH = (
    _nested,
    lambda: _nested().replace("JOINT j", "JOINT hip "),
    lambda: _siblings("j{}"),
    lambda: _siblings("same"),
    lambda: SMALL_BVH.replace("Frames: 3", "Frames: 1000000000"),
    lambda: SMALL_BVH.replace("Frames: 3", "Frames: 999999999999"),
    lambda: SMALL_BVH.replace("CHANNELS 3 ", "CHANNELS 1000000000 ", 1),
    lambda: SMALL_BVH.replace("CHANNELS 3 ", f"CHANNELS {MANY + 3} " + "Xrotation " * MANY, 1),
    lambda: SMALL_BVH.replace("Frame Time: 0.0333333", "Frame Time: 1000000"),
    lambda: SMALL_BVH.replace("Frame Time: 0.0333333", "Frame Time: 0." + "0" * 400_000 + "1"),
    lambda: SMALL_BVH.replace("0 9 0 10", "1 " * 1_000_000),
    lambda: SMALL_BVH.replace("0 9 0 10", "9" * 3_000_000),
    lambda: SMALL_BVH.replace("OFFSET 1 -4 0", "{" * 1_000_000),
    lambda: SMALL_BVH.replace("ROOT Hips", "ROOT " + "Hips " * 500_000),
    lambda: "\n" * 3_000_000,
    lambda: SMALL_BVH + "\n" * 3_000_000,
    lambda: "{}" * 1_000_000,
)
_LARGE_ASF = (
    lambda: _bones("name b{}\nlength 1", "b{1} b{0}").replace("root hip", "root b0 hip"),
    lambda: _bones("name b{}\nlength 1", "root b{0}").replace("root hip", "root b0 hip"),
    lambda: _bones("name b{}\nlength 1", ""),
    lambda: _bones("name same", "root same"),
    lambda: SMALL_ASF.replace("dof rx ry rz", "dof " + "rx " * 1_000_000),
    lambda: SMALL_ASF.replace("root hip spine", "root " + "hip spine " * 300_000),
    lambda: SMALL_ASF.replace("length 7", "length " + "7" * 3_000_000),
    lambda: SMALL_ASF.replace("axis XYZ", "axis " + "XYZ" * 1_000_000),
    lambda: SMALL_ASF.replace(":units", ":units\n" * 300_000),
)
_LARGE_AMC = (
    lambda: "\n".join([":DEGREES", *(str(i) for i in range(MANY))]),
    lambda: SMALL_AMC + "".join(f"{i}\nroot 1 2 3 4 5 6\nspine 1\n" for i in range(3, MANY)),
    lambda: SMALL_AMC.replace("\n1\n", "\n1000000000\n"),
    lambda: SMALL_AMC.replace("root 1 2 3", "root " + "1 " * 1_000_000, 1),
    lambda: SMALL_AMC.replace("spine 5", "spine " + "5" * 3_000_000),
    lambda: SMALL_AMC.replace("spine 5", "".join(f"bone{i} 1\n" for i in range(MANY))),
    lambda: SMALL_AMC + "9" * 3_000_000,
    lambda: "\n".join(":" * 9 for _ in range(MANY)),
)

BVH = Kind("bvh", 0.28, _seeds, _bvh, check_motion)
ASF = Kind("asf", 0.16, lambda shared: None, _asf, check_motion)
AMC = Kind("amc", 0.16, lambda shared: None, _amc, check_motion)
