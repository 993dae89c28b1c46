"""The largest clusters at a glance, the picture of the README.

`python -m motionary.workflows.documentation.contact_sheet motionary-demo/catalog OUT.svg` draws it anew.
"""

from __future__ import annotations

import sys
from html import escape
from pathlib import Path

from motionary.catalog import Catalog
from motionary.catalog.views.colours import GREY
from motionary.catalog.views.thumbnail import HEIGHT, WIDTH, thumbnail_svg

CLUSTERS, COLUMNS = 8, 4

_GAP, _CAPTION = 24, 26


def contact_sheet(catalog: Catalog) -> str:
    """Draw the references of the largest clusters, each with its cluster's name and how many takes it has.

    Returns
    -------
    str
        An SVG that shows on light and on dark ground.
    """
    largest = catalog.sql(
        f"""select clip_id, coalesce(label, 'cluster ' || cluster_id) as name, size
            from "references" order by size desc, cluster_id limit {CLUSTERS}"""
    ).to_pylist()
    across, down = WIDTH + _GAP, HEIGHT + _CAPTION + _GAP
    cells = []
    for number, row in enumerate(largest):
        x, y = number % COLUMNS * across, number // COLUMNS * down
        strip = thumbnail_svg(catalog, row["clip_id"])
        caption = (
            f'<text x="{WIDTH / 2:g}" y="{HEIGHT + 18}">{escape(row["name"])}, {row["size"]} takes</text>'
        )
        cells.append(f'<g transform="translate({x} {y})">{strip}{caption}</g>')
    width = across * min(COLUMNS, len(largest)) - _GAP
    height = down * -(-len(largest) // COLUMNS) - _GAP
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" role="img" font-family="system-ui, sans-serif" font-size="14" fill="{GREY}" '
        'text-anchor="middle">\n' + "\n".join(cells) + "\n</svg>\n"
    )


if __name__ == "__main__":
    with Catalog.open(sys.argv[1]) as opened:
        Path(sys.argv[2]).write_text(contact_sheet(opened), encoding="utf-8")
