"""The style of one clip of a catalog on another, and how much its feet slide."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
from rich.console import RenderableType

from motionary.catalog import Catalog
from motionary.catalog.export_plan import refuse_library
from motionary.pipeline.motion import Motion
from motionary.pipeline.style import fastest_joint, foot_sliding, transfer
from motionary.pipeline.style.contact import USUAL_LEG
from motionary.pipeline.writers import write_bvh
from motionary.workflows.errors import UserError
from motionary.workflows.tables import text_table


@dataclass(frozen=True, eq=False)
class StyleTransfer:
    """A motion with the style of another.

    Parameters
    ----------
    motion : Motion
        In the reference's time.
    reference_id : str
        The clip that both are aligned to.
    sliding : dict of str to float
        Foot sliding, cm/s, of `style` and `onto`, both aligned, and of `result`.
    fastest : dict of str to float
        Greatest speed of a joint, leg lengths a second, of the same.
    """

    motion: Motion
    reference_id: str
    sliding: dict[str, float]
    fastest: dict[str, float]

    def record(self) -> dict[str, Any]:
        """Say as plain values what is printed of it."""
        return {
            "frames": self.motion.frames,
            "reference_id": self.reference_id,
            "sliding": self.sliding,
            "fastest": self.fastest,
            "is_jerky": self.is_jerky,
        }

    @property
    def is_jerky(self) -> bool:
        """Whether some joint of the result is more than twice as fast as any of the sources'."""
        return self.fastest["result"] > 2 * max(self.fastest["style"], self.fastest["onto"])


def transfer_to_bvh(catalog: Catalog, out: Path, style: str, onto: str) -> StyleTransfer:
    """Write what `transfer_style` makes; the parameters are those, and the file is replaced in one step.

    Raises
    ------
    CatalogError
        The catalog has no such clip, or `out` lies in its library.
    UserError
        `out` does not end in .bvh or cannot be written, or the clips are not of one cluster and skeleton.
    """
    if out.suffix.lower() != ".bvh":
        raise UserError(f"{out} ends in {out.suffix or 'nothing'!r}; the result is written as .bvh")
    refuse_library(catalog, [out])
    made = transfer_style(catalog, style, onto)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_bvh(made.motion, out)
    except ValueError as error:
        raise UserError(f"{out} cannot be written: {error}") from error
    except OSError as error:
        raise UserError(f"{out} cannot be written: {error.strerror}") from error
    return made


def transfer_style(catalog: Catalog, style: str, onto: str) -> StyleTransfer:
    """Give a clip what another does differently from the reference of their cluster.

    Parameters
    ----------
    catalog : Catalog
    style, onto : str
        clip_id of the clip whose style is taken and of the clip that gets it.

    Raises
    ------
    CatalogError
        The catalog has no such clip.
    UserError
        The clips are not of one cluster, or of different skeletons.
    """
    styled, plain = catalog.aligned(style), catalog.aligned(onto)
    reference_id = _reference(catalog, style, onto)
    conventions = catalog.config.features.conventions
    try:
        motion = transfer(styled, catalog.aligned(reference_id), plain, conventions)
    except ValueError as error:
        raise UserError(f"style cannot be transferred in the time of {reference_id}: {error}") from error
    motions = {"style": styled, "onto": plain, "result": motion}
    sliding, fastest = (
        {role: measure(one, conventions) for role, one in motions.items()}
        for measure in (foot_sliding, fastest_joint)
    )
    return StyleTransfer(motion, reference_id, sliding, fastest)


def sliding_table(made: StyleTransfer) -> RenderableType:
    """List the foot sliding and the fastest joint of the sources and the result."""
    rows = [[role, f"{speed:.2f}", f"{made.fastest[role]:.1f}"] for role, speed in made.sliding.items()]
    guess = "" if made.motion.unit is not None else f", a leg taken to be {USUAL_LEG:.2f} m"
    title = f"Foot sliding while the foot stands{guess}; the fastest joint"
    return text_table(["motion", "sliding, cm/s", "fastest, legs/s"], rows, title)


def _reference(catalog: Catalog, style: str, onto: str) -> str:
    alignments = catalog.alignments.to_arrow().select(["clip_id", "cluster_id", "reference_id"])
    both = alignments.filter(pc.is_in(alignments["clip_id"], pa.array([style, onto]))).to_pylist()
    rows = {row["clip_id"]: row for row in both}
    if rows[style]["cluster_id"] != rows[onto]["cluster_id"]:
        names = {row["cluster_id"]: row["label"] for row in catalog.references.to_arrow().to_pylist()}
        numbers = [(clip, rows[clip]["cluster_id"]) for clip in (style, onto)]
        places = [f"{clip} is in cluster {number} ({names[number] or 'unnamed'})" for clip, number in numbers]
        raise UserError(f"{', '.join(places)}; style is transferred between clips of one cluster")
    return rows[style]["reference_id"]
