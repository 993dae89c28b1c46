"""The pictures of the pages: charts and players of the embedded library, made when the site is built."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from motionary.catalog import Catalog

if TYPE_CHECKING:
    import plotly.graph_objects as go

    from motionary.catalog.views.figures import Colour

WALKS = ("walk/walk_tired_alex_01.bvh", "walk/walk_sneaky_emil_01.bvh")
RUNS = ("run/run_neutral_dora_02.bvh", "run/run_sneaky_alex_01.bvh")
_FENCE = "`" * 6


_SHOWN_ALIGNERS = ("dtw", "derivative-dtw", "generalized-time-warping", "cotw")  # more would hide each other


def picture_text(catalog: Catalog, name: str) -> str:
    """Make a picture, as Markdown that holds it.

    Raises
    ------
    KeyError
        There is no such picture.
    """
    made = PICTURES[name](catalog)
    html = made if isinstance(made, str) else _chart(made, f"picture-{name}")
    return f'{_FENCE}{{raw}} html\n<div class="picture">\n{html}\n</div>\n{_FENCE}'


def _chart(figure: go.Figure, name: str) -> str:
    from motionary.catalog.views.charts import chart_html

    return chart_html(figure, name)


def _walks(catalog: Catalog) -> str:
    return _player(catalog, "walks", *WALKS)


def _runs(catalog: Catalog) -> str:
    return _player(catalog, "runs", *RUNS)


def _aligned_pair(catalog: Catalog) -> str:
    reference, clip = _most_gained(catalog)
    return _player(catalog, "aligned-pair", reference, clip, aligned=True)


def _residual(catalog: Catalog) -> str:
    reference, clip = _most_gained(catalog)
    return _player(catalog, "residual", reference, clip, aligned=True, colour="residual")


def _player(
    catalog: Catalog, name: str, *clip_ids: str, aligned: bool = False, colour: Colour = "plain"
) -> str:
    from motionary.catalog.views.figures import clip_figure, scene
    from motionary.catalog.views.player import player_html

    figures = [clip_figure(catalog, clip_id, slim=True) for clip_id in clip_ids]
    return player_html(scene(figures, aligned=aligned, colour=colour), name=f"picture-{name}")


def _dendrogram(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.dendrogram import dendrogram_figure

    return dendrogram_figure(catalog)


def _mu_kappa(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.mu_kappa import mu_kappa_figure

    return mu_kappa_figure(catalog)


def _map(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.cluster_map import cluster_map_figure

    return cluster_map_figure(catalog)


def _confusion(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.label_confusion import confusion_figure

    figure = confusion_figure(catalog)
    assert figure is not None  # the embedded library has labels
    return figure


def _cost_matrix(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.cost_matrix import cost_matrix_figure

    return cost_matrix_figure(catalog, catalog.explain(*RUNS), threshold=0.35)


def _curve(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.curve_chart import curve_figure

    return curve_figure([catalog.explain(*RUNS), catalog.explain(RUNS[0], WALKS[0])])


def _warps(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.warp_chart import warp_figure

    reference, _ = _most_gained(catalog)
    rows = catalog.sql(
        "select clip_id from alignments where reference_id = $1 and clip_id <> $1 order by clip_id limit 4",
        [reference],
    )
    return warp_figure(catalog, rows["clip_id"].to_pylist())


def _aligners(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.alignment_chart import warps_figure
    from motionary.workflows.align_pair import align_pair, read_pair

    reference, clip = _most_gained(catalog)
    return warps_figure(align_pair(read_pair(clip, reference, catalog), _SHOWN_ALIGNERS).pair)


def _trajectory(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.trajectory_chart import trajectory_figure

    return trajectory_figure(catalog, _most_gained(catalog)[1], "left_ankle")


def _styles(catalog: Catalog) -> go.Figure:
    from motionary.catalog.views.style_chart import style_figure

    rows = catalog.sql("select cluster_id from clusters where clip_id = ?", [WALKS[0]])
    return style_figure(catalog, rows["cluster_id"][0].as_py())


def _most_gained(catalog: Catalog) -> tuple[str, str]:
    """Find a reference and the clip whose correlation with its reference the alignment has raised most."""
    (row,) = catalog.sql(
        """select reference_id, clip_id from alignments where clip_id <> reference_id
        order by correlation - correlation_before desc, clip_id limit 1"""
    ).to_pylist()
    return row["reference_id"], row["clip_id"]


PICTURES: Mapping[str, Callable[[Catalog], go.Figure | str]] = {
    "walks": _walks,
    "runs": _runs,
    "cost-matrix": _cost_matrix,
    "curve": _curve,
    "dendrogram": _dendrogram,
    "mu-kappa": _mu_kappa,
    "map": _map,
    "confusion": _confusion,
    "warps": _warps,
    "aligners": _aligners,
    "trajectory": _trajectory,
    "aligned-pair": _aligned_pair,
    "styles": _styles,
    "residual": _residual,
}
"""Every picture that a page may ask for, a chart or the HTML of a player."""
