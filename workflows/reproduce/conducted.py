"""An experiment that was conducted: what was measured, and on what."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

Measured = TypeVar("Measured")


@dataclass(frozen=True, eq=False)
class Conducted(Generic[Measured]):
    """What an experiment measured, and notes on what it was made on.

    Parameters
    ----------
    study : object
        The measurements, with `to_arrow`.
    notes : list of str
        On what they were made: where it comes from, how much of it, by which seed.
    """

    study: Measured
    notes: list[str]
