"""A time warp: which moment of one motion is shown at each frame of another.

Times are in frames and may be fractional; between two frames values are interpolated linearly and rotations
by slerp, so a warp slows and hastens a motion without still frames [CoTW 3.1].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionary.pipeline.features import sample_times
from motionary.pipeline.motion import FloatArray, Motion

_LARGEST = np.float64(1e150)  # as such: a plain float would be narrowed to float32 beside float32


@dataclass(frozen=True, eq=False)
class Warp:
    """The time of the moving sequence that is shown at each frame of the reference.

    Parameters
    ----------
    source_time : array (reference frames,) float64
        In frames of the moving sequence, non-decreasing, within 0 .. moving_frames - 1.
    moving_frames : int
        Length of the moving sequence that the times refer to.

    Raises
    ------
    ValueError
        A time is not a number, lies outside the moving sequence or before the time that precedes it.
    """

    source_time: FloatArray
    moving_frames: int

    def __post_init__(self) -> None:
        times = np.array(self.source_time, dtype=np.float64)
        if times.ndim != 1 or not times.size:
            raise ValueError(
                f"source_time has shape {times.shape}; it needs one time a reference frame, at least one"
            )
        if not np.isfinite(times).all():
            frame = int(np.argmin(np.isfinite(times)))
            raise ValueError(
                f"source_time holds {times[frame]} at reference frame {frame}; times must be finite"
            )
        if not (times.min() >= 0 and times.max() <= self.moving_frames - 1):
            raise ValueError(
                f"source_time runs from {times.min():g} to {times.max():g}; "
                f"a moving sequence of {self.moving_frames} frames has times 0 to {self.moving_frames - 1}"
            )
        falls = np.flatnonzero(np.diff(times) < 0)
        if falls.size:
            frame = int(falls[0])
            raise ValueError(
                f"source_time falls from {times[frame]:g} to {times[frame + 1]:g} after reference frame "
                f"{frame}; time must not run backwards"
            )
        object.__setattr__(self, "source_time", times)

    @property
    def reference_frames(self) -> int:
        """Number of frames of the reference, and of whatever the warp is applied to."""
        return len(self.source_time)

    def apply(self, values: FloatArray) -> FloatArray:
        """Show the moving sequence in the reference's time, by linear interpolation.

        Parameters
        ----------
        values : array (moving_frames, dofs)
            Any values of the moving sequence, a row a frame; further axes are carried along.

        Returns
        -------
        array (reference_frames, dofs)
            In the dtype of `values` where that is floating, else float64.

        Raises
        ------
        ValueError
            `values` has another number of frames than the warp was made for.
        """
        values = np.asarray(values)
        if not values.ndim or len(values) != self.moving_frames:
            raise ValueError(
                f"values have shape {values.shape}; this warp was made for {self.moving_frames} moving frames"
            )
        return interpolate(values, self.source_time)

    def apply_motion(self, motion: Motion, rate: float | None = None) -> Motion:
        """Show the moving motion in the reference's time: slerp for rotations, linear for the root.

        Parameters
        ----------
        motion : Motion
            The moving motion, at any frame rate.
        rate : float, optional
            Frames a second at which the warp's times were taken: the warp of two feature sequences at 30
            frames a second applies to the 120 frames a second of the motion they were computed from. Times
            fall where `motionary.pipeline.features.sample_times` took the samples. Left out, they are frames
            of `motion` itself.

        Returns
        -------
        Motion
            `reference_frames` frames at `rate` frames a second.

        Raises
        ------
        ValueError
            At that rate the motion has another number of frames than the warp was made for.
        """
        samples: FloatArray
        if rate is None:
            rate, samples = motion.fps, np.arange(motion.frames, dtype=np.float64)
        else:
            samples = sample_times(motion.frames, motion.fps, rate)
        if len(samples) != self.moving_frames:
            raise ValueError(
                f"motion {motion.name!r} has {len(samples)} frames at {rate:g} a second; "
                f"this warp was made for {self.moving_frames}: name the rate at which its times were taken"
            )
        return replace(motion.sampled(interpolate(samples, self.source_time)), fps=float(rate))


def interpolate(values: FloatArray, times: FloatArray) -> FloatArray:
    """Sample rows at fractional places, linearly.

    Parameters
    ----------
    values : array (frames, ...)
        One row a frame.
    times : array (samples,)
        In frames, within 0 .. frames - 1.

    Returns
    -------
    array (samples, ...)
        In the dtype of `values` where that is floating, else float64. At whole times the rows themselves,
        and a constant stays constant to the last bit.
    """
    before = times.astype(np.intp)
    after = np.minimum(before + 1, len(values) - 1)
    share = (times - before).reshape(-1, *[1] * (values.ndim - 1))
    start = values[before].astype(np.float64)
    sampled = start + share * (values[after] - start)
    return sampled.astype(values.dtype) if np.issubdtype(values.dtype, np.floating) else sampled


def checked_pair(moving: FloatArray, reference: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a moving sequence and its reference as arrays, after checking that they can be compared.

    Raises
    ------
    ValueError
        As `checked_sequence`, or they have other numbers of DOFs.
    """
    moving, reference = checked_sequence(moving, "moving"), checked_sequence(reference, "reference")
    if moving.shape[1] != reference.shape[1]:
        raise ValueError(
            f"moving has {moving.shape[1]} DOFs and reference {reference.shape[1]}; they must have the same"
        )
    return moving, reference


def checked_sequences(sequences: Sequence[FloatArray]) -> list[FloatArray]:
    """Return two or more sequences, each of any frames and DOFs, as float64 arrays, after checking each.

    Raises
    ------
    ValueError
        As `checked_sequence`, or there are fewer than two.
    """
    arrays: list[FloatArray] = [
        checked_sequence(values, f"sequence {place}").astype(np.float64)
        for place, values in enumerate(sequences)
    ]
    if len(arrays) < 2:
        raise ValueError(f"there are {len(arrays)} sequences; it takes two or more")
    return arrays


def checked_stack(clips: FloatArray) -> FloatArray:
    """Return length-matched sequences as an array (clips, frames, dofs), after checking that they are such.

    Raises
    ------
    ValueError
        They have other than three axes, none is there, or a value is not finite.
    """
    clips = np.asarray(clips)
    if clips.ndim != 3 or not clips.size:
        raise ValueError(
            f"clips have shape {clips.shape}; it needs (clips, frames, dofs), at least one of each"
        )
    if not np.isfinite(clips).all():
        clip, frame, dof = np.argwhere(~np.isfinite(clips))[0]
        raise ValueError(
            f"clip {clip} holds {clips[clip, frame, dof]} at frame {frame}, DOF {dof}; values must be finite"
        )
    return clips


def at_a_clear_size(*sequences: FloatArray) -> tuple[tuple[FloatArray, ...], int]:
    """Bring sequences whose squares would underflow or overflow to a size at which they do not.

    All are multiplied by one power of two, which rounds nothing, so what compares or correlates them finds
    what it would find in any other unit. Sequences of a usual size are left alone.

    Parameters
    ----------
    sequences : array (frames, any dofs)
        Checked sequences; of those that are to keep their proportion, all at once.

    Returns
    -------
    sequences : tuple of array
        In the dtypes given.
    exponent : int
        Of the power of two; 0 where they were left alone. ``np.ldexp(result, -exponent)`` is in the old unit.
    """
    largest = max(float(np.abs(values).max()) for values in sequences)
    limits = np.finfo(np.result_type(*sequences, np.float16))
    if largest == 0 or float(limits.tiny) ** (1 / 3) <= largest <= float(limits.max) ** (1 / 3):
        return sequences, 0
    exponent = -int(np.frexp(largest)[1])
    return tuple(np.ldexp(values, exponent) for values in sequences), exponent


def checked_sequence(values: FloatArray, name: str) -> FloatArray:
    """Return a sequence as an array (frames, dofs), after checking that it is one.

    Raises
    ------
    ValueError
        It has other than two axes, no frame or no DOF, values that are not real numbers, or one that is not
        finite or too large to be squared.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{name} holds values of type {array.dtype}; they must be real numbers")
    if array.ndim != 2 or not array.size:
        raise ValueError(f"{name} has shape {array.shape}; it needs (frames, dofs), at least one of each")
    usable = np.abs(array) <= _LARGEST  # false for what is not a number
    if not usable.all():
        frame, dof = np.argwhere(~usable)[0]
        raise ValueError(
            f"{name} holds {array[frame, dof]} at frame {frame}, DOF {dof}; "
            f"values must be finite, at most {_LARGEST:g}"
        )
    return array
