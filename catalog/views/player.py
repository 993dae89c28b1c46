"""The player in a page, and in a notebook.

A notebook with a running kernel and anywidget shows a widget; one that was rendered, or is opened where no
widget can live, shows the same player in a frame of its own that holds all it needs. Both travel together,
and whoever displays them takes what it can.
"""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from motionary.catalog.views.assets import asset
from motionary.catalog.views.figure_data import Figure
from motionary.catalog.views.figures import Colour, Layout, clip_figures, figure_of, scene
from motionary.catalog.views.page import page
from motionary.pipeline.motion import Motion

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog

_HEIGHT = 600  # pixels of the frame in a notebook: the canvas, two rows of controls, names


def player_html(shown: dict[str, Any], *, name: str) -> str:
    """Return a player as HTML, for a page that has `player_script()`.

    Parameters
    ----------
    shown : dict
        As `motionary.catalog.views.figures.scene` makes it.
    name : str
        An id that no other element of the page has, nor has it with `-scene` behind.
    """
    own = html.escape(name)
    return (
        f'<div class="motionary-player" id="{own}" data-scene="{own}-scene"></div>\n'
        f'<script type="application/json" id="{own}-scene">{json_in_script(shown)}</script>'
    )


def player_script() -> str:
    """Return the player's script as an element; it builds each player of the page when it comes into view."""
    return f'<script type="module">\n{asset("player.js")}\nmountAll();\n</script>'


def json_in_script(value: object) -> str:
    """Write JSON that no text in it can end the script element of."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")


class Player:
    """A player that a notebook displays.

    Parameters
    ----------
    shown : dict
        As `motionary.catalog.views.figures.scene` makes it.
    """

    def __init__(self, shown: dict[str, Any]) -> None:
        self.scene = shown
        self._widget: Any = None

    def __repr__(self) -> str:
        return f"<Player of {', '.join(one['name'] for one in self.scene['figures'])}>"

    def page(self) -> str:
        """Return a whole HTML page that plays it, and needs nothing from outside itself."""
        title = ", ".join(one["name"] for one in self.scene["figures"])
        style = "<style>body { padding: 0; max-width: none; }</style>"
        return page(title, [player_html(self.scene, name="player"), player_script()], head=style)

    def _repr_html_(self) -> str:
        return (
            f'<iframe title="Motion player" srcdoc="{html.escape(self.page())}" loading="lazy" '
            f'style="width: 100%; height: {_HEIGHT}px; border: 0"></iframe>'
        )

    def _repr_mimebundle_(self, **_kwargs: object) -> dict[str, Any]:
        made = {"text/plain": repr(self), "text/html": self._repr_html_()}
        widget = self.widget()
        if widget is not None:
            data = widget._repr_mimebundle_()
            made |= data[0] if isinstance(data, tuple) else data or {}
            made |= {"text/plain": repr(self)}
        return made

    def widget(self) -> Any:
        """Return the player as a widget, or None where anywidget is not installed.

        Its `scene` can be set, and the page follows.
        """
        if self._widget is None:
            self._widget = _widget_of(self.scene)
        return self._widget


def play(
    *motions: Motion | Figure,
    layout: Layout = "side",
    aligned: bool = False,
    trails: Sequence[str] = (),
    colour: Colour = "plain",
) -> Player:
    """Play motions in a notebook, from the viewer's left.

    Parameters
    ----------
    *motions : Motion or Figure
        One or more.
    layout, aligned, trails, colour
        See `motionary.catalog.views.figures.scene`.

    Raises
    ------
    ValueError
        No motion is given.
    """
    figures = [one if isinstance(one, Figure) else figure_of(one) for one in motions]
    return Player(scene(figures, layout=layout, aligned=aligned, trails=trails, colour=colour))


def play_clips(
    catalog: Catalog,
    *clip_ids: str,
    layout: Layout = "side",
    aligned: bool = False,
    trails: Sequence[str] = (),
    colour: Colour = "plain",
) -> Player:
    """Play clips of a catalog in a notebook, with their warps to their references and what they differ by.

    Parameters
    ----------
    catalog : Catalog
    *clip_ids : str
        One or more, from the viewer's left.
    layout, aligned, trails, colour
        See `motionary.catalog.views.figures.scene`.

    Raises
    ------
    CatalogError
        The catalog has no such clip.
    ValueError
        No clip is given.
    """
    made = {figure.clip_id: figure for figure in clip_figures(catalog, set(clip_ids))} if clip_ids else {}
    figures = [made[clip_id] for clip_id in clip_ids]
    return play(*figures, layout=layout, aligned=aligned, trails=trails, colour=colour)


def _widget_of(shown: dict[str, Any]) -> Any:
    try:
        import anywidget
        import traitlets
    except ImportError:
        return None

    class MotionPlayer(anywidget.AnyWidget):
        _esm = asset("player.js")
        scene = traitlets.Dict().tag(sync=True)

    return MotionPlayer(scene=shown)
