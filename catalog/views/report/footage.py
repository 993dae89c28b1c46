"""The takes that a report shows and plays: a thumbnail each, and a figure as long as there is room.

A report is one file, so what it can play is bounded in bytes. What is asked for first gets room first; a take
that does not fit is shown by its thumbnail alone, and shorter ones after it are still taken.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

from motionary.catalog.motions import stream_motions
from motionary.catalog.query import Catalog
from motionary.catalog.views.figures import clip_figures
from motionary.catalog.views.player import json_in_script
from motionary.catalog.views.report.packed import data_element
from motionary.catalog.views.thumbnail import thumbnail_of

MOST_BYTES = 5_000_000


@dataclass(frozen=True, eq=False)
class Footage:
    """What is there to see of some clips.

    Parameters
    ----------
    thumbnails : mapping of str to str
        SVG by clip_id.
    figures : mapping of str to str
        Id of the element that holds a clip's figure, by clip_id.
    elements : sequence of str
        Those elements.
    """

    thumbnails: Mapping[str, str]
    figures: Mapping[str, str]
    elements: Sequence[str]

    def plays(self, *clip_ids: str) -> bool:
        """Tell whether there was room for all of some clips."""
        return all(one in self.figures for one in clip_ids)

    def no_room(self, pictures: Iterable[Sequence[str]]) -> str:
        """Say how many pictures, each given by the clips that it would play, do not play; "" where all do."""
        still = sum(not self.plays(*one) for one in pictures)
        return f"Takes that have no room on this page and are pictures only: {still}." if still else ""

    def button(self, stage: str, said: str, caption: str, *clip_ids: str) -> str:
        """Write the last clip's thumbnail as a button that plays all of them, from the left, in a stage.

        Parameters
        ----------
        stage : str
            Id of the element that the player is built in.
        said : str
            What the button does, in plain text; the caption's words come in it.
        caption : str
            HTML that stands below the picture.
        *clip_ids : str
            Clips with a thumbnail; where one cannot be played the picture is no button.
        """
        picture = f'<span class="still" aria-hidden="true">{self.thumbnails[clip_ids[-1]]}</span>{caption}'
        if not self.plays(*clip_ids):
            return picture
        figures = " ".join(self.figures[one] for one in clip_ids)
        return (
            f'<button type="button" class="take" aria-label="{escape(said)}" data-stage="{escape(stage)}" '
            f'data-figures="{escape(figures)}">{picture}</button>'
        )


def footage_of(catalog: Catalog, clip_ids: Iterable[str], most_bytes: int = MOST_BYTES) -> Footage:
    """Make thumbnails of clips, and figures as long as there is room.

    Parameters
    ----------
    catalog : Catalog
    clip_ids : iterable of str
        The most important first; one may be named twice.
    most_bytes : int
        Of all figures together.
    """
    wanted = list(dict.fromkeys(clip_ids))
    thumbnails = {
        motion.name: thumbnail_of(motion, conventions=catalog.config.features.conventions)
        for motion in stream_motions(catalog, wanted)
    }
    made = {one.clip_id: json_in_script(one.to_dict()) for one in clip_figures(catalog, wanted, slim=True)}
    figures: dict[str, str] = {}
    elements: list[str] = []
    room = most_bytes
    for clip_id in wanted:
        name = f"figure-{len(figures)}"
        element = data_element(made[clip_id], name)
        if len(element.encode()) <= room:
            room -= len(element.encode())
            figures[clip_id] = name
            elements.append(element)
    return Footage(thumbnails, figures, elements)
