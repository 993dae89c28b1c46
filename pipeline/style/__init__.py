"""Style: what is left of a clip once it is aligned to the reference of its cluster [CoTW 6.3].

In reading order: `rig` (which joints belong together), `root_motion` (the root in its own heading frame),
`residual` (clip minus reference), `space` (the principal axes of a cluster's residuals), `separability` (how
well labels are predicted from them), `transfer` (a residual added to another clip), `contact` (when feet
stand, how far they slide meanwhile, and the fastest joint).
"""

from motionary.pipeline.style.contact import fastest_joint, foot_sliding, standing_toes
from motionary.pipeline.style.residual import Residual, ResidualKind, pose_differences, residual, residuals
from motionary.pipeline.style.rig import REGIONS, joint_regions
from motionary.pipeline.style.separability import style_accuracy
from motionary.pipeline.style.space import StyleSpace
from motionary.pipeline.style.transfer import transfer

__all__ = [
    "REGIONS",
    "Residual",
    "ResidualKind",
    "StyleSpace",
    "fastest_joint",
    "foot_sliding",
    "joint_regions",
    "pose_differences",
    "residual",
    "residuals",
    "standing_toes",
    "style_accuracy",
    "transfer",
]
