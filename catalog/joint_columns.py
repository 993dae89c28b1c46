"""The columns of features that some joints have, weighed so that distances stay root-mean-square ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.config import FeatureKind
from motionary.pipeline.joint_weights import PRESETS, joint_weights


@dataclass(frozen=True, eq=False)
class JointColumns:
    """Which columns are compared, and what they are multiplied by.

    Parameters
    ----------
    columns : array (c,) of int
    scale : array (c,) float32
    """

    columns: NDArray[np.intp]
    scale: NDArray[np.float32]

    @property
    def key(self) -> str:
        """Names them; equal choices have equal names."""
        return f"{self.columns.tolist()} {self.scale.tolist()}"

    def of(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Take them out of features (frames, d)."""
        return features[:, self.columns] * self.scale


def joint_columns(joints: str | Sequence[str], kind: FeatureKind) -> JointColumns:
    """Choose the columns of joints.

    Features are joints' places over the square root of their number J, so that the distance of two frames is
    the root-mean-square distance of their joints. Multiplied by the square root of J w over the sum of the
    weights w, they make it that of the chosen joints.

    Parameters
    ----------
    joints : str or sequence of str
        A preset, or canonical joints; without its side ("knee") a name means both.
    kind : {"pose+travel", "paper"}
        Of the features; the paper's have no pelvis.

    Raises
    ------
    ValueError
        There is no such joint, or none of the features has it.
    """
    names = [joints] if isinstance(joints, str) else list(joints)
    preset = len(names) == 1 and names[0] in PRESETS
    try:
        weights = joint_weights(names[0] if preset else dict.fromkeys(names, 1.0))
    except ValueError as error:
        raise ValueError(f"{error}; presets: {', '.join(PRESETS)}") from None
    if kind == "paper":
        weights = weights[3:]
    columns = np.flatnonzero(weights)
    if not columns.size:
        raise ValueError(
            f"{', '.join(names) or 'no joint'}: nothing to compare, since the features of this run are seen "
            "from the pelvis; name other joints"
        )
    counted = len(CANONICAL_JOINTS) - (kind == "paper")
    by_joint = weights.sum() / 3
    scale = np.sqrt(counted * weights[columns] / by_joint)
    return JointColumns(columns, scale.astype(np.float32))
