"""The peers, in a process of their own: run by the peers' Python, so it imports nothing of motionary.

Orders come as lines of JSON on standard input, and each is answered by one line of JSON on standard output:

    {"order": "load", "clips": NAME, "file": NPZ}          values (frames, d) of all clips, and their lengths
    {"order": "time", "peer": P, "task": T, "clips": NAME, "first": N}              -> {"seconds": ...}
    {"order": "totals", "peer": P, "reversed": false, "clips": NAME, "file": NPY}   writes (pairs,)
    {"order": "paths", "pairs": [[i, j], ...], "clips": NAME, "file": NPY}          writes (pairs, 4)
    {"order": "versions"}

Tasks: `dtw`, every clip with every later one; `b_dtw`, also with every later one reversed. Every peer finds
a *total* along the path: the sum of squared distances of frames (aeon), the square root of that
(dtaidistance, tslearn), or the sum of distances (dtaidistance with `inner_dist="euclidean"`).
"""

import json
import os
import platform
import sys
import time
import warnings
from collections.abc import Callable
from importlib.metadata import version
from typing import Any, Protocol

import numpy as np
from aeon.distances import dtw_pairwise_distance
from dtaidistance import dtw_ndim
from tslearn.metrics import cdist_dtw, dtw_path_from_metric

Array = np.ndarray
Clips = list[np.ndarray]
Order = dict[str, Any]

PACKAGES = ("dtaidistance", "aeon", "tslearn", "numpy", "numba", "llvmlite", "scipy")


class Peer(Protocol):
    """All pairs of prepared clips (pairs,), and all of one list against all of another (na, nb)."""

    def prepared(self, clips: Clips) -> Clips:
        """Lay clips out as this peer takes them."""

    def pairs(self, clips: Clips) -> Array:
        """Compare every clip with every later one."""

    def rectangle(self, a: Clips, b: Clips) -> Array:
        """Compare every clip of one list with every one of another."""


class Dtaidistance:
    """The C library, by its fastest call for many sequences."""

    def __init__(self, inner_dist: str) -> None:
        self.options = {"inner_dist": inner_dist, "parallel": False, "compact": True}

    def prepared(self, clips: Clips) -> Clips:
        return [np.ascontiguousarray(clip, dtype=np.float64) for clip in clips]

    def pairs(self, clips: Clips) -> Array:
        return np.asarray(dtw_ndim.distance_matrix_fast(clips, **self.options))

    def rectangle(self, a: Clips, b: Clips) -> Array:
        block = ((0, len(a)), (len(a), len(a) + len(b)))
        distances = dtw_ndim.distance_matrix_fast(a + b, block=block, **self.options)
        return np.asarray(distances).reshape(len(a), len(b))


class Aeon:
    """Clips are (channels, frames): in C order as its documentation makes them, or each frame contiguous."""

    def __init__(self, frames_contiguous: bool) -> None:
        self.frames_contiguous = frames_contiguous

    def prepared(self, clips: Clips) -> Clips:
        turned = [np.ascontiguousarray(clip, dtype=np.float64).T for clip in clips]
        return turned if self.frames_contiguous else [np.ascontiguousarray(clip) for clip in turned]

    def pairs(self, clips: Clips) -> Array:
        return upper(dtw_pairwise_distance(clips))

    def rectangle(self, a: Clips, b: Clips) -> Array:
        return dtw_pairwise_distance(a, b)


class Tslearn:
    """Clips are padded to one length by the call itself."""

    def prepared(self, clips: Clips) -> Clips:
        return [np.ascontiguousarray(clip, dtype=np.float64) for clip in clips]

    def pairs(self, clips: Clips) -> Array:
        return upper(cdist_dtw(clips))

    def rectangle(self, a: Clips, b: Clips) -> Array:
        return cdist_dtw(a, b)


PEERS: dict[str, Peer] = {
    "dtaidistance": Dtaidistance("squared euclidean"),
    "dtaidistance, rooted": Dtaidistance("euclidean"),
    "aeon": Aeon(frames_contiguous=False),
    "aeon, frames contiguous": Aeon(frames_contiguous=True),
    "tslearn": Tslearn(),
}


def upper(square: Array) -> Array:
    """Condense a square matrix."""
    return square[np.triu_indices(len(square), 1)]


class Server:
    """What has been loaded, and the answers to orders."""

    def __init__(self) -> None:
        self.clips: dict[str, Clips] = {}

    def load(self, order: Order) -> Order:
        """Read clips and keep them under their name."""
        with np.load(order["file"]) as file:
            cuts = np.cumsum(file["lengths"])[:-1]
            self.clips[order["clips"]] = np.split(file["values"], cuts)
        return {}

    def versions(self, order: Order) -> Order:
        """Name the versions of Python and of the packages."""
        return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}

    def time(self, order: Order) -> Order:
        """Time a task; what it takes to lay the clips out is not counted.

        For the second direction every clip meets every second clip reversed, in one call: as many pairs as
        are needed, but for a small share by which the time is corrected.
        """
        peer, clips, backwards = self._laid_out(order)
        took = seconds(lambda: peer.pairs(clips))
        if order["task"] == "b_dtw":
            # All clips have one dimension, so their sizes are in proportion to their frames.
            sizes = np.array([clip.size for clip in clips], dtype=float)
            needed = (sizes.sum() ** 2 - (sizes**2).sum()) / 2
            computed = sizes.sum() * sizes[::2].sum()
            took += seconds(lambda: peer.rectangle(clips, backwards[::2])) * needed / computed
        return {"seconds": took}

    def totals(self, order: Order) -> Order:
        """Write the totals of every clip and every later one, or of every later one reversed."""
        peer, clips, backwards = self._laid_out(order)
        found = upper(peer.rectangle(clips, backwards)) if order["reversed"] else peer.pairs(clips)
        np.save(order["file"], found)
        return {}

    def paths(self, order: Order) -> Order:
        """Write tslearn's rooted total and the cells on its path, ahead and reversed, of some pairs."""
        clips = self.clips[order["clips"]]
        rows = []
        for i, j in order["pairs"]:
            ahead = dtw_path_from_metric(clips[i], clips[j], metric="euclidean")
            back = dtw_path_from_metric(clips[i], clips[j][::-1], metric="euclidean")
            rows.append([ahead[1], len(ahead[0]), back[1], len(back[0])])
        np.save(order["file"], np.array(rows))
        return {}

    def _laid_out(self, order: Order) -> tuple[Peer, Clips, Clips]:
        """Return the peer, its clips, and the same clips reversed."""
        peer = PEERS[order["peer"]]
        clips = self.clips[order["clips"]][: order.get("first")]
        return peer, peer.prepared(clips), peer.prepared([clip[::-1] for clip in clips])


def seconds(job: Callable[[], object]) -> float:
    """Time a job."""
    began = time.perf_counter()
    job()
    return time.perf_counter() - began


def main() -> None:
    """Answer orders until the input ends."""
    # The answers have the pipe to themselves: what a library prints goes to standard error.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    warnings.simplefilter("ignore")
    server = Server()
    for line in sys.stdin:
        order = json.loads(line)
        answers.write(json.dumps(getattr(server, order["order"])(order)) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
