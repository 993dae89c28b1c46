"""The embedded library knows how its takes were warped: alignment must find that again."""

import numpy as np
import pytest

from motionary.pipeline.alignment import cotw_search, uniform
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import frame_features, sample_times
from motionary.pipeline.synthetic import SyntheticTake, synthetic_library, template

UNMERGED = FeatureConfig(epsilon=0.0)


def pose(motion) -> np.ndarray:
    return frame_features(motion, UNMERGED).values[:, :57]


def times_shown(take: SyntheticTake, template_frames: int) -> np.ndarray:
    """Return the frame of the take, at 30 a second, that shows each frame of its template."""
    samples = sample_times(take.motion.frames, take.motion.fps, 30.0)
    template_time = np.interp(samples, np.arange(take.motion.frames), take.warp)
    return np.interp(np.arange(template_frames), template_time, np.arange(len(samples)))


@pytest.mark.parametrize("action", ["jump", "kick", "punch", "squat", "throw", "wave"])
def test_cotw_recovers_the_warp_of_every_take(action):
    # Walks and runs show only some of their template's cycles, so their ends need not meet.
    takes = [one for one in synthetic_library() if one.action == action and not one.is_mirrored]
    reference = pose(template(action))
    errors = []
    for take in takes:
        moving = pose(take.motion)
        truth = times_shown(take, len(reference))
        by_cotw = cotw_search(moving, reference, effort="fast").source_time
        by_length = uniform(moving, reference).source_time
        errors.append([np.abs(found - truth).mean() / len(moving) for found in (by_cotw, by_length)])
    of_cotw, of_length = np.transpose(errors)
    assert (of_cotw <= of_length).all()
    assert of_cotw.mean() < 0.4 * of_length.mean()
