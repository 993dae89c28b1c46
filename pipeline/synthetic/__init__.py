"""The embedded library: labelled, seeded motions whose time warps are known.

In reading order: `bodies` (who), `actions` (what; from `gaits`, `single_actions` and their `curves`),
`styles` (how), `posture` (channels to a posed body), `conventions` (a posed body to a skeleton), `library`
(takes and warps), `files` (a folder of them), `style_takes` (takes for telling styles apart). Nothing is read
from disk.
"""

from motionary.pipeline.synthetic.actions import ACTIONS
from motionary.pipeline.synthetic.bodies import BODIES, DEFAULT_BODY
from motionary.pipeline.synthetic.conventions import CONVENTIONS
from motionary.pipeline.synthetic.files import write_library
from motionary.pipeline.synthetic.library import (
    CLIPS,
    TEMPLATE_FPS,
    SyntheticTake,
    least_clips,
    numbered_take,
    synthetic_library,
    take_numbers,
    template,
    template_frames,
)
from motionary.pipeline.synthetic.style_takes import style_takes
from motionary.pipeline.synthetic.styles import STYLES

__all__ = [
    "ACTIONS",
    "BODIES",
    "CLIPS",
    "CONVENTIONS",
    "DEFAULT_BODY",
    "STYLES",
    "TEMPLATE_FPS",
    "SyntheticTake",
    "least_clips",
    "numbered_take",
    "style_takes",
    "synthetic_library",
    "take_numbers",
    "template",
    "template_frames",
    "write_library",
]
