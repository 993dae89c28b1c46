"""Experiment of [FP] 4 to 6: how well forward plotting follows a live motion that is not known to its end.

**[FP]** Randall, Harvey, Williams, *Online alignment of human motion using forward plotting-DTW*, CAVW 34
(2023). Ordered pairs of takes of one action: one is prerecorded, the other comes live, frame by frame. Every
algorithm is scored by how alike the two are afterwards (Kendall's tau of joint trajectories, eq. 2), for
which UTW is the mark, and by how far it lies from DTW (eq. 3), for which 150 milliseconds are. Both UTW and
DTW know the live take to its end.

The paper has all pairs of each of 44 movements, 3248 in all; here every action gives the same number of pairs
at most, so that none outweighs the others. Where the paper tests 60 frames a second with method C alone, all
algorithms are tested at both rates, on the same pairs.
"""

from __future__ import annotations

import numpy as np

from motionary.catalog import Catalog
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.fp_dtw_clips import (
    Takes,
    TurningClip,
    catalog_takes,
    draw_pairs,
    embedded_takes,
    read_take,
)
from motionary.workflows.reproduce.fp_dtw_measures import Alignment, FpStudy, measure_pair
from motionary.workflows.reproduce.pairs import Pair


def study_fp_dtw(
    catalog: Catalog | None, label_column: str, draws: int, seed: int, show: Show
) -> Conducted[FpStudy]:
    """Align pairs of takes of one action online, by every method, window and constraint.

    Parameters
    ----------
    catalog : Catalog, optional
        Its labelled clips are paired, those of them that were recorded fast enough; left out, takes of the
        embedded library.
    label_column : str
        The catalog's column that holds the actions.
    draws : int
        Pairs of every action, at most.
    seed : int
        Of the draws, and of the embedded takes. The same seed gives the same result, but for the times.
    show : callable
        Shows progress, see `motionary.workflows.progress`.

    Raises
    ------
    UserError
        The catalog has no such labels, or no two takes that can be paired.
    """
    takes = embedded_takes(seed) if catalog is None else catalog_takes(catalog, label_column)
    drawn = draw_pairs(takes, draws, seed)
    names = sorted({name for pairs in drawn.values() for pair in pairs for name in pair})
    aligned = sum(map(len, drawn.values())) * len(takes.rates)
    rows: list[Alignment] = []
    with show({"read": len(names), "align": aligned}) as advance:
        clips: dict[str, dict[int, TurningClip]] = {}
        for name in names:
            clips[name] = read_take(takes, name)
            advance("read")
        _load_kernels(clips[names[0]][takes.rates[-1]])
        for rate in takes.rates:
            for action, pairs in drawn.items():
                for moving, reference in pairs:
                    both = clips[moving][rate], clips[reference][rate]
                    rows += measure_pair(rate, action, (moving, reference), *both)
                    advance("align")
    return Conducted(FpStudy(rows), _notes(takes, drawn, clips, seed))


def _load_kernels(clip: TurningClip) -> None:
    """Align a clip once for nothing: what is compiled takes its time when it is first called."""
    measure_pair(0, "", ("", ""), clip, clip)


def _notes(
    takes: Takes, drawn: dict[str, list[Pair]], clips: dict[str, dict[int, TurningClip]], seed: int
) -> list[str]:
    counts = {action: len(pairs) for action, pairs in drawn.items()}
    rate = takes.rates[0]
    live = [len(clips[reference][rate].rotations) for pairs in drawn.values() for _, reference in pairs]
    return [
        takes.note,
        f"{sum(counts.values())} ordered pairs, seed {seed}: "
        f"{', '.join(f'{action} {count}' for action, count in counts.items())}. "
        f"The live takes have {min(live)} to {max(live)} frames at {rate} a second, {np.mean(live):.0f} on "
        "average.",
    ]
