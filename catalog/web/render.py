"""Templates to pages: every value that is put into one is escaped."""

from __future__ import annotations

from importlib.resources import files
from urllib.parse import urlencode

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import HTMLResponse

from motionary.catalog.description import duration
from motionary.catalog.views.colours import cluster_character, cluster_colour
from motionary.catalog.views.page import isolated
from motionary.catalog.views.sections import catalog_name
from motionary.catalog.web.opened import Opened, Shown
from motionary.catalog.web.static_files import static_url


def render(request: Request, template: str, *, status: int = 200, **context: object) -> HTMLResponse:
    """Fill in a template; it also knows the catalog's name, the snapshot and whether it can be edited.

    Parameters
    ----------
    request : Request
    template : str
        A file of `templates/`.
    status : int
        Of the response.
    **context
        What the template names.
    """
    opened: Opened = request.app.state.opened
    shown = getattr(request.state, "shown", None)
    common = {
        "catalog": catalog_name(opened.url),
        "snapshot": shown.catalog.snapshot.snapshot_id if shown else None,
        "edition": shown.edition if shown else "",
        "motions_edition": shown.motions_edition if shown else "",
        "editable": request.app.state.desk is not None,
        "here": request.url.path,
        "words": "",
    }
    return HTMLResponse(_TEMPLATES.get_template(template).render(common | context), status)


def shown_to(request: Request) -> Shown:
    """Return the snapshot that a request is answered from, the same one however often it is asked."""
    if not hasattr(request.state, "shown"):
        request.state.shown = request.app.state.opened.shown()
    return request.state.shown


def link(path: str, **query: object) -> str:
    """Write a URL of this application; what is None or empty is left out of its query."""
    given = {name: value for name, value in query.items() if value not in (None, "")}
    return f"{path}?{urlencode(given, doseq=True)}" if given else path


def _isolated(name: str) -> Markup:
    return Markup(isolated(name).text)


_TEMPLATES = Environment(
    loader=FileSystemLoader(str(files(__package__).joinpath("templates"))),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_TEMPLATES.globals.update(
    link=link, static=static_url, cluster_colour=cluster_colour, cluster_character=cluster_character
)
_TEMPLATES.filters.update({"duration": duration, "isolated": _isolated})
