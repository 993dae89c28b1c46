"""Small files that the readers' tests vary."""

from collections.abc import Callable
from pathlib import Path

import pytest

SMALL_BVH = """\
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Leg
  {
    OFFSET 1 -4 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -4 0
    }
  }
  JOINT Spine
  {
    OFFSET 0 5 0
    CHANNELS 3 Xrotation Yrotation Zrotation
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
0 9 0 10 20 30 1 2 3 4 5 6
0 9 1 11 21 31 1 2 3 4 5 6
0 9 2 12 22 32 1 2 3 4 5 6
"""

SMALL_ASF = """\
# a comment
:version 1.10
:name SMALL
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   .ast/.asf of a test
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name hip
     direction 1 0 0
     length 2
     axis 0 0 0 XYZ
  end
  begin
     id 2
     name femur
     direction 0 -1 0
     length 7
     axis 0 0 20 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 3
     name foot
     direction 0 0 1
     length 3
     axis -90 7e-016 20 XYZ
    dof rx rz
  end
  begin
     id 4
     name spine
     direction 0 1 0
     length 5
     axis 0 0 0 XYZ
    dof rx
  end
:hierarchy
  begin
    root hip spine
    hip femur
    femur foot
  end
"""

SMALL_AMC = """\
#!OML:ASF X:\\small.ASF
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 10 20 30
spine 5
foot 1 2
femur 10 20 30
2
root 1 2 3 11 21 31
spine 6
foot 1 2
femur 11 21 31
"""


@pytest.fixture(scope="session")
def small_bvh() -> str:
    """Return a whole, valid BVH of three joints and three frames."""
    return SMALL_BVH


@pytest.fixture(scope="session")
def small_asf() -> str:
    """Return a valid ASF of four bones."""
    return SMALL_ASF


@pytest.fixture(scope="session")
def small_amc() -> str:
    """Return two frames for `small_asf`."""
    return SMALL_AMC


@pytest.fixture
def write_file(tmp_path: Path) -> Callable[[str, str | bytes], Path]:
    """Return a function that writes a file into the test's folder and returns its path."""

    def write(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write
