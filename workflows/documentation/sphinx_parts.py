"""What Sphinx lacks for a site that fetches nothing: equations as MathML, scripts where they are needed.

Its own way of showing equations in HTML loads MathJax from another host, or wants LaTeX; docutils converts
TeX to MathML, which browsers show by themselves.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NoReturn

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

_WIDE = re.compile(r'<(pre|div class="(?:cell_output|table-wrapper|picture)[^"]*")(?=>)')
_BETWEEN_BARS = re.compile(r"(?<![\w`])\|(\w+)\|")

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, Any]:
    """Join these parts to Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("html-page-context", _mend_page, priority=900)  # after the theme's own
    app.connect("autodoc-process-docstring", _keep_bars)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _inline(translator: Any, node: Any) -> NoReturn:
    translator.body.append(tex2mathml(node.astext()))
    raise SkipNode


def _block(translator: Any, node: Any) -> NoReturn:
    translator.body.append(
        f'<div class="equation" tabindex="0">{tex2mathml(node.astext(), as_block=True)}</div>'
    )
    raise SkipNode


def _mend_page(app: Sphinx, name: str, template: str, context: dict[str, Any], tree: Any) -> None:
    """Load Plotly and the player where they are needed; let keys scroll what is wide, and levels be told."""
    body = _WIDE.sub(r'<\1 tabindex="0"', context.get("body", ""))
    if "plotly-graph-div" in body:  # before the charts' own scripts: the theme's stand at the page's end
        body = f'<script src="{context["pathto"]("_static/plotly.js", 1)}"></script>\n{body}'
    if 'class="motionary-player"' in body:
        from motionary.catalog.views.player import player_script

        body += player_script()
    context["body"] = body
    navigation = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = navigation.replace('role="heading"', 'role="heading" aria-level="2"')


def _keep_bars(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Escape the bars of an absolute value, |h|, which reStructuredText reads as a substitution."""
    lines[:] = [_BETWEEN_BARS.sub(r"\|\1\|", line) for line in lines]
