"""Whether the peers find the same costs, in the same run.

Ours is the average cost along the path of least total cost, and the peers' is a total; so the two are brought
together by the number of cells on our path (`dtw_path`):

- dtaidistance with inner_dist="euclidean" sums the same costs over the same steps: all pairs, both ways;
- tslearn's `dtw_path_from_metric` with metric="euclidean" does so too, and gives its path: a sample of pairs,
  where besides the totals the cells on both paths are counted (paths of equal total may differ in length);
- what the other calls compute, the least sum of *squared* distances, our public functions find on the squared
  cost matrix: a sample of pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.distances import (
    cost_matrix,
    dtw_distance,
    dtw_path,
    pairwise_distances,
    pairwise_dtw,
)
from tests.benchmarks.clips import Clip, ClipSet
from tests.benchmarks.peer_process import PeerProcess

TOLERANCE = 1e-4
SAMPLED = 200


@dataclass(frozen=True)
class Agreement:
    """One comparison.

    Parameters
    ----------
    what : str
        What was compared with what.
    pairs : int
        How many pairs.
    difference : float
        Largest difference, relative to the other's value.
    tolerance : float
        What it may be.
    """

    what: str
    pairs: int
    difference: float
    tolerance: float = TOLERANCE

    @property
    def holds(self) -> bool:
        """Whether the difference is small enough; one that is not a number is not."""
        return self.difference <= self.tolerance


def compared(what: str, ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> Agreement:
    """Compare values pair by pair; where theirs is zero, relative to their mean."""
    scale = np.where(theirs > 0, theirs, theirs.mean() or 1.0)
    return Agreement(what, len(theirs), float(np.max(np.abs(ours - theirs) / scale)))


def with_ourselves(clips: ClipSet) -> list[Agreement]:
    """Compare the record of all distances with the kernel that computes DTW and B-DTW alone."""
    record = pairwise_distances(clips.clips, n_jobs=1)
    both = pairwise_dtw(clips.clips, n_jobs=1, bidirectional=True)
    return [
        compared(
            f"{clips.name}: pairwise_dtw, pairwise_distances", pairwise_dtw(clips.clips, n_jobs=1), record.dtw
        ),
        compared(f"{clips.name}: B-DTW by both", both, record.b_dtw),
        compared(f"{clips.name}: B-DTW, the curve at lambda 1", both, record.curve[:, -1]),
    ]


def with_peers(clips: ClipSet, peers: PeerProcess) -> list[Agreement]:
    """Compare with every peer; the peers must have loaded the clips."""
    pairs = list(combinations(range(len(clips.clips)), 2))
    ahead = np.array([_cells_on_path(clips.clips[i], clips.clips[j]) for i, j in pairs])
    back = np.array([_cells_on_path(clips.clips[i], clips.clips[j][::-1]) for i, j in pairs])
    dtw = pairwise_dtw(clips.clips, n_jobs=1)
    both = pairwise_dtw(clips.clips, n_jobs=1, bidirectional=True)
    rooted = peers.totals("dtaidistance, rooted", clips.name)
    rooted_back = peers.totals("dtaidistance, rooted", clips.name, backwards=True)
    found = [
        compared(f"{clips.name}: DTW totals, dtaidistance rooted", dtw * ahead, rooted),
        compared(
            f"{clips.name}: B-DTW, dtaidistance rooted",
            both,
            np.minimum(rooted / ahead, rooted_back / back),
        ),
    ]
    sample = np.sort(np.random.default_rng(0).permutation(len(pairs))[:SAMPLED])
    chosen = [pairs[place] for place in sample]
    total, _, total_back, _ = paths = peers.paths(clips.name, chosen).T
    same = np.mean((paths[1] == ahead[sample]) & (paths[3] == back[sample]))
    found += [
        compared(
            f"{clips.name}: DTW totals, tslearn's paths ({same:.0%} as long as ours)",
            dtw[sample] * ahead[sample],
            total,
        ),
        compared(
            f"{clips.name}: B-DTW, tslearn's paths",
            both[sample],
            np.minimum(total / ahead[sample], total_back / back[sample]),
        ),
    ]
    squared = np.array([_squared_total(clips.clips[i], clips.clips[j]) for i, j in chosen])
    for who, power in (("aeon", 1), ("dtaidistance", 2), ("tslearn", 2)):
        theirs = peers.totals(who, clips.name)[sample] ** power
        found.append(compared(f"{clips.name}: squared totals, {who}", squared, theirs))
    return found


def _cells_on_path(a: Clip, b: Clip) -> int:
    return len(dtw_path(cost_matrix(a, b)))


def _squared_total(a: Clip, b: Clip) -> float:
    squared = cost_matrix(a.astype(np.float64), b.astype(np.float64)) ** 2
    return dtw_distance(squared) * len(dtw_path(squared))
