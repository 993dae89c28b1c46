"""A prerecorded motion in the time of a live one, frame by frame as it comes [FP], by forward plotting.

Each live frame is given a prerecorded frame, at or after the one before it: it advances the motion by some
number of frames from 0 on. Frames are compared by eq. 1, the sum over joints of 2/pi times the angle between
their quaternions (0 alike, 1 opposite a joint). With M the prerecorded frame shown last and w the window,

- A: the advance is to the nearest of frames M .. M + w [Algorithm 1]; the paper's window is 2
- B: DTW of frames M .. M + w with the last live frame, this one and w forecasts; the path, which may not
  leave its first cell aslant, advances to the lowest frame that it meets beside this one [Algorithm 2]
- C: DTW with this live frame and w forecasts, accumulated back from the far corner; the advance is to the
  frame of least accumulated cost beside this one [Algorithm 3]

Where the printed algorithms leave room, this is how they are read:

- A window has w + 1 frames, its end with it, as the loop of Algorithm 1 and the bound "M + w > m" have it
  (the text counts w). With two frames, method A could stay or go on by one and would never catch up.
- Forecasting gives the live frame, which method C reads its first column as and method B its second, and
  then w frames, so that C's window is square, as the arrays of Algorithm 3 are declared. The rival counts the
  live frame among the w, a column less than there are rows. Whether C sticks with 10 and skips with 80 as
  the paper's does, `motionary reproduce fp-dtw` prints.
- The first live frame shows frame 0. "n < s maps to n + 1", with s = 2 frames smoothed over, has B and C
  advance by 1 at the next two. A forecasts nothing and has no such start.
- D(0, 0) = 10,000 means "never": here it is infinite, since many joints over a wide window add up to more.
- Of equal costs A and C take the advance nearest to 1, and B's path the step that ends nearest to the
  diagonal, which comes to the same. The lowest frame, an argmin's usual choice, would never leave a motion's
  still beginning.

Under Type V the three choose the best of what its state allows: A and C among those frames, B among the paths
that enter the live frame's column in them. A finished motion keeps its last frame, whatever the constraint.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.alignment.forecast import forecast
from motionary.pipeline.alignment.path_warp import PathWarp, path_warp
from motionary.pipeline.alignment.rotation_costs import checked_rotations
from motionary.pipeline.alignment.type_v import MOST_ADVANCE, TypeV
from motionary.pipeline.motion import FloatArray

Method = Literal["A", "B", "C"]
Constraint = Literal["type-v"]
Missing = Literal["forecast", "hold"]

USUAL_WINDOWS = {"A": 2, "B": 40, "C": 40}
"""Frames at 120 a second: the paper's for A, and with which its method C does best."""

MOST_WINDOW = 1000  # a push takes time and memory with its square

_SMOOTHED = 2  # live frames that a forecast is made from


class _Followed(NamedTuple):
    """What is known after a live frame; replaced as a whole, so that an error leaves the one before."""

    frame: int = 0  # the prerecorded one that is shown
    received: int = 0  # live frames, those that a forecast stood in for as well
    state: TypeV = TypeV()
    previous: FloatArray | None = None
    latest: FloatArray | None = None
    elapsed: int = 1  # frames from previous to latest
    held: int = 0  # frames that were missing since latest


class OnlineAligner:
    """Follow a live motion with a prerecorded one.

    Parameters
    ----------
    prerecorded : array (m, J, 4)
        Unit quaternions x, y, z, w of m frames, as `motionary.pipeline.joint_rotations` gives them, of the
        live motion's rig and at its rate; either of a rotation's two quaternions will do.
    method : {"A", "B", "C"}
        Frame matching, or by forecast: the path through the window, or its accumulated costs.
    window : int, optional
        Frames that are looked ahead, in both motions, 1 to 1,000; left out 2 with A and 40 with B and C, a
        third of a second at the paper's 120 frames a second: at 60 give 20. For C the paper advises less than
        half the period of what is repeated.
    constraint : {"type-v"}, optional
        Advance by at most 3, and stay for at most two live frames in a row.
    missing : {"forecast", "hold"}
        What a live frame that is None stands for: that every joint went on as it did, or nothing, so that the
        frame shown last is kept. Holding does not count among the stays of Type V.

    Raises
    ------
    ValueError
        An option is unknown, the window is not positive, or `prerecorded` is not such an array: of a
        quaternion that is not of length 1 (to .001) the message names frame and joint.
    """

    def __init__(
        self,
        prerecorded: ArrayLike,
        method: Method = "C",
        window: int | None = None,
        constraint: Constraint | None = None,
        missing: Missing = "forecast",
    ) -> None:
        if method not in USUAL_WINDOWS:
            raise ValueError(f"no method {method!r}; there are {', '.join(USUAL_WINDOWS)}")
        if constraint is not None and constraint not in get_args(Constraint):
            raise ValueError(f"no constraint {constraint!r}; there is 'type-v', or None")
        if missing not in get_args(Missing):
            raise ValueError(f"missing is {missing!r}; it may be 'forecast' or 'hold'")
        self.method, self.constraint, self.missing = method, constraint, missing
        window = USUAL_WINDOWS[method] if window is None else window
        if not (1 <= window <= MOST_WINDOW and window == int(window)):
            raise ValueError(f"window is {window}; it must be a whole number of frames, 1 to {MOST_WINDOW}")
        self.window = int(window)
        frames = checked_rotations(prerecorded, ("m", "J", 4), "prerecorded")
        self._planes = np.ascontiguousarray(frames.transpose(1, 2, 0))
        self._last, self._joints = len(frames) - 1, frames.shape[1]
        columns = {"A": 1, "B": self.window + 2, "C": self.window + 1}[method]
        self._shown = np.empty((2 if method == "A" else self.window + 2, self._joints, 4))
        self._costs = np.empty((columns, min(self.window, self._last) + 1))
        self._path: list[int] = []
        self._followed = _Followed()
        # Kernels are loaded by their first call, and that shall not be while somebody performs.
        self._advance(_Followed(received=_SMOOTHED + 1, previous=frames[0]), frames[0])
        forecast(frames[0], frames[0], 1)

    @property
    def path(self) -> NDArray[np.int64]:
        """The prerecorded frame shown at each push so far, (pushes,); it never falls."""
        return np.array(self._path, dtype=np.int64)

    def push(self, frame: ArrayLike | None) -> int:
        """Take the next live frame and say which prerecorded frame to show with it.

        Parameters
        ----------
        frame : array (J, 4) or None
            Unit quaternions of the same joints, at the same rate; None where the frame was lost.

        Returns
        -------
        int
            Index of the prerecorded frame, from 0; no less than the one before.

        Raises
        ------
        ValueError
            The frame is no such array. The aligner stays as it was, and takes the frame mended, or None.
        """
        before = self._followed
        if frame is not None:
            live = checked_rotations(frame, (self._joints, 4), f"live frame {len(self._path)}")
            return self._keep(self._after(before, live))
        if self.missing == "hold" or before.latest is None:
            return self._keep(before._replace(held=before.held + 1))
        if before.previous is None:
            return self._keep(self._after(before, before.latest))
        return self._keep(self._after(before, forecast(before.previous, before.latest, 1, before.elapsed)[0]))

    def _keep(self, after: _Followed) -> int:
        self._path.append(after.frame)
        self._followed = after
        return after.frame

    def _after(self, before: _Followed, live: FloatArray) -> _Followed:
        elapsed = before.held + 1
        advance, state = 0, before.state
        if before.received and before.frame < self._last:
            advance = self._advance(before._replace(previous=before.latest, elapsed=elapsed), live)
            state = state.after(advance) if self.constraint else state
        return _Followed(before.frame + advance, before.received + 1, state, before.latest, live, elapsed)

    def _advance(self, followed: _Followed, live: FloatArray) -> int:
        """Choose the advance to a live frame; `followed.previous` is the one that was received before it."""
        from motionary.pipeline.alignment.online_kernels import (
            accumulate_back,
            extrapolate,
            match_frame,
            plot_path,
        )

        start = followed.frame
        most = ahead = min(self.window, self._last - start)
        least = 0
        if self.constraint:
            least, most = followed.state.least, min(ahead, MOST_ADVANCE)
        shown, costs = self._shown, self._costs
        shown[0], shown[1] = followed.previous, live
        if self.method == "A":
            return match_frame(self._planes, start, shown[1:], costs, least, most)
        if followed.received <= _SMOOTHED:
            return 1
        extrapolate(shown, followed.elapsed)
        if self.method == "B":
            return plot_path(self._planes, start, ahead + 1, shown, costs, least, most)
        return accumulate_back(self._planes, start, ahead + 1, shown[1:], costs, least, most)


def online_warp(
    moving: ArrayLike,
    reference: ArrayLike,
    method: Method = "C",
    window: int | None = None,
    constraint: Constraint | None = None,
) -> PathWarp:
    """Warp a motion as an `OnlineAligner` does that gets the reference's frames one by one.

    Parameters
    ----------
    moving : array (m, J, 4)
        Unit quaternions of the prerecorded motion.
    reference : array (n, J, 4)
        Unit quaternions of the live one.
    method, window, constraint
        As of `OnlineAligner`.

    Returns
    -------
    PathWarp
        Its path joins each frame of the reference with one of `moving`, from 0 on; the last need not be met.

    Raises
    ------
    ValueError
        As `OnlineAligner` and its `push`.
    """
    prerecorded = checked_rotations(moving, ("m", "J", 4), "moving")
    live = checked_rotations(reference, ("n", prerecorded.shape[1], 4), "reference")
    aligner = OnlineAligner(prerecorded, method, window, constraint)
    for frame in live:
        aligner.push(frame)
    return path_warp(np.column_stack([aligner.path, np.arange(len(live))]), len(prerecorded))
