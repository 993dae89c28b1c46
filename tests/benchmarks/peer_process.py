"""Our end of the pipe to `peers.py`."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.clips import ClipSet
from tests.benchmarks.machine import one_thread

SERVER = Path(__file__).with_name("peers.py")


class PeerProcess:
    """One process of the peers' Python that lives as long as the benchmarks do.

    Parameters
    ----------
    python : Path
        The interpreter of the peers' environment.
    folder : Path
        Where features and totals are handed over.
    """

    def __init__(self, python: Path, folder: Path) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [str(python), str(SERVER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=one_thread(os.environ),
        )

    def __enter__(self) -> PeerProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()

    def load(self, clips: ClipSet) -> None:
        """Hand over clips, under their name."""
        file = self.folder / "features.npz"
        np.savez(file, values=np.vstack(clips.clips), lengths=[len(clip) for clip in clips.clips])
        self._ask(order="load", clips=clips.name, file=str(file))

    def versions(self) -> dict[str, str]:
        """Return the versions of the peers and of what they stand on."""
        return self._ask(order="versions")

    def seconds(self, peer: str, task: str, clips: str, first: int | None) -> float:
        """Time one pass over all pairs of the first clips, inside the peers' process."""
        return float(self._ask(order="time", peer=peer, task=task, clips=clips, first=first)["seconds"])

    def totals(self, peer: str, clips: str, backwards: bool = False) -> NDArray[np.float64]:
        """Return a peer's totals (pairs,), of every later clip as it is or backwards."""
        file = self.folder / "totals.npy"
        self._ask(order="totals", peer=peer, reversed=backwards, clips=clips, file=str(file))
        return np.load(file)

    def paths(self, clips: str, pairs: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
        """Return total and cells of tslearn's path, and both against the second clip reversed (pairs, 4)."""
        file = self.folder / "paths.npy"
        self._ask(order="paths", clips=clips, pairs=[list(pair) for pair in pairs], file=str(file))
        return np.load(file)

    def _ask(self, **order: object) -> dict[str, Any]:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(
                f"the peers' process ended with {self.process.wait()} at {order['order']!r}; "
                "its error is printed above; without the peers' environment, make bench makes it afresh"
            )
        return json.loads(answer)
