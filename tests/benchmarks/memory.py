"""Peak memory of all pairs, in fresh processes: the result, and what is held beyond it.

`python -m tests.benchmarks.memory TASK CLIPS FRAMES FEATURES.npz` is one such process; it prints JSON.
"""

from __future__ import annotations

import ctypes
import gc
import json
import resource
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, is_dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.clips import Clip, ClipSet
from tests.benchmarks.contests import OUR_TASKS, WARM_UP_CLIPS

# Clips and frames a clip (a multiple of what kernels pad to); the last shows what longer clips need.
SIZES = ((100, 16), (200, 16), (400, 16), (800, 16), (100, 128))
QUICK_SIZES = ((20, 16),)
NOISE = 1e-3
ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Peak:
    """Memory of one call, in bytes.

    Parameters
    ----------
    task : str
        "dtw" or "curve".
    clips, frames : int
        N, and frames of each.
    inputs : int
        The clips themselves, there before the call.
    result : int
        The arrays that are returned.
    peak : int
        Greatest resident memory during the call, above that before it.
    method : str
        How it was read.
    """

    task: str
    clips: int
    frames: int
    inputs: int
    result: int
    peak: int
    method: str

    @property
    def beyond(self) -> int:
        """What was held besides the result: a tile, with its clips as the kernels read them, and scratch."""
        return self.peak - self.result


def measure_memory(clips: ClipSet, folder: Path, quick: bool) -> list[Peak]:
    """Measure DTW and the curve at every size, one thread, each in a process of its own."""
    file = folder / "memory.npz"
    np.savez(file, values=np.vstack(clips.clips))
    peaks = []
    for task in ("dtw", "curve"):
        for number, frames in QUICK_SIZES if quick else SIZES:
            command = [sys.executable, "-m", "tests.benchmarks.memory"]
            arguments = [task, str(number), str(frames), str(file)]
            told = subprocess.run(
                [*command, *arguments], check=True, cwd=ROOT, stdout=subprocess.PIPE, text=True
            )
            peaks.append(Peak(**json.loads(told.stdout)))
    return peaks


def measured(task: str, number: int, frames: int, file: Path) -> Peak:
    """Measure one call in this process."""
    clips = list(_repeated(np.load(file)["values"], number, frames))
    OUR_TASKS[task](clips[:WARM_UP_CLIPS], 1)
    _give_back_freed()
    before, method = _reset()
    result = OUR_TASKS[task](clips, 1)
    peak = _highest(method) - before
    return Peak(task, number, frames, sum(clip.nbytes for clip in clips), _bytes_of(result), peak, method)


def _repeated(values: Clip, number: int, frames: int) -> Iterator[Clip]:
    """Stretches of the clips end to end, over and over, with noise so that no two are equal."""
    rng = np.random.default_rng(0)
    for index in range(number):
        start = index * frames % (len(values) - frames + 1)
        noise = rng.normal(0.0, NOISE, (frames, values.shape[1]))
        yield (values[start : start + frames] + noise).astype(np.float32)


def _bytes_of(result: object) -> int:
    if is_dataclass(result):
        return sum(_bytes_of(getattr(result, field.name)) for field in fields(result))
    return result.nbytes if isinstance(result, np.ndarray) else 0


def _give_back_freed() -> None:
    """Return what is free to the system, so that the call cannot use it unseen."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def _reset() -> tuple[int, str]:
    """Set the recorded peak to the present; return resident bytes and how the peak will be read."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
        return _status("VmRSS"), "VmHWM, reset before the call"
    except OSError:
        return _highest("ru_maxrss"), "ru_maxrss, above the peak before the call"


def _highest(method: str) -> int:
    if method.startswith("VmHWM"):
        return _status("VmHWM")
    # Kilobytes, except on a Mac.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def _status(name: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) * 1024
    raise OSError(f"/proc/self/status has no {name}; this kernel does not report it")


if __name__ == "__main__":
    named, clip_count, frame_count, features = sys.argv[1:]
    print(json.dumps(asdict(measured(named, int(clip_count), int(frame_count), Path(features)))))
