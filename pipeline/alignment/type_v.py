"""The Type V continuity constraint for a path that is plotted forwards [FP 6].

A live frame advances the prerecorded motion by 0 to 3 frames, and never more than two in a row by 0: slopes
of 1/3 to 3. The advance can be bounded frame by frame; how often the motion may still stay has to be
remembered from one live frame to the next, so the constraint is a machine of three states, the stays so far:

===========  =======  ================
stays        advance  next state
===========  =======  ================
0            0        1
0            1 to 3   0
1            0        2
1            1 to 3   0
2            1 to 3   0
===========  =======  ================

Rabiner and Juang's Type V, from which the paper starts, joins stays with an advance of 1 alone, not with one
of 2 or 3; that rival would keep a motion that has waited from catching up at once, and has the same slopes.
"""

from __future__ import annotations

from dataclasses import dataclass

MOST_STAYS = 2
"""Live frames in a row that may show one prerecorded frame again."""

MOST_ADVANCE = 3
"""Prerecorded frames that one live frame may advance by."""


@dataclass(frozen=True)
class TypeV:
    """A state of the constraint.

    Parameters
    ----------
    stays : int
        Live frames in a row, up to the last one, that did not advance the prerecorded motion.
    """

    stays: int = 0

    @property
    def least(self) -> int:
        """The least advance that the next live frame may make."""
        return 1 if self.stays == MOST_STAYS else 0

    def after(self, advance: int) -> TypeV:
        """Return the state that an advance leads to.

        Raises
        ------
        ValueError
            The state does not allow it.
        """
        if not self.least <= advance <= MOST_ADVANCE:
            raise ValueError(
                f"an advance of {advance} after {self.stays} stays; it may be {self.least} to {MOST_ADVANCE}"
            )
        return TypeV(0 if advance else self.stays + 1)
