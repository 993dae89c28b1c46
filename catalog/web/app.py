"""The application: which address is answered by what, and how errors look."""

from __future__ import annotations

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from motionary.catalog.errors import CatalogError
from motionary.catalog.web import pages
from motionary.catalog.web.access import Guard, middleware
from motionary.catalog.web.chart_data import send_chart
from motionary.catalog.web.clip_page import clip
from motionary.catalog.web.cluster_pages import cluster, cluster_map
from motionary.catalog.web.compare_page import compare
from motionary.catalog.web.data import send_figure, send_pair, send_scene, send_thumbnail, suggest
from motionary.catalog.web.desk import Desk, Editor
from motionary.catalog.web.drop import Tables, drop_routes
from motionary.catalog.web.edits import edit_routes
from motionary.catalog.web.opened import CatalogGone, Opened
from motionary.catalog.web.render import render
from motionary.catalog.web.review_pages import review_routes
from motionary.catalog.web.review_queue import ReviewQueue
from motionary.catalog.web.static_files import send_static

_ROUTES = [
    Route("/", pages.start),
    Route("/search", pages.search),
    Route("/clusters", pages.clusters),
    Route("/cluster", cluster),
    Route("/clip", clip),
    Route("/compare", compare),
    Route("/map", cluster_map),
    Route("/data/figure", send_figure),
    Route("/data/scene", send_scene),
    Route("/data/pair", send_pair),
    Route("/data/thumbnail", send_thumbnail),
    Route("/data/chart", send_chart),
    Route("/data/search", suggest),
    Route("/static/{name}", send_static),
]


def create_app(url: str, *, guard: Guard, editor: Editor | None = None) -> Starlette:
    """Make the application over one catalog.

    Functions that answer are plain ones, which Starlette runs in threads: a slow page keeps no other waiting.

    Parameters
    ----------
    url : str
        The catalog: a folder, or any fsspec URL.
    guard : Guard
        Who may ask.
    editor : Editor, optional
        Changes labels; without one everything is read only.

    Raises
    ------
    CatalogError
        There is no catalog, or it cannot be opened.
    """
    opened = Opened(url)
    opened.shown()
    app = Starlette(
        routes=[*_ROUTES, *review_routes, *edit_routes, *drop_routes],
        middleware=middleware(guard),
        exception_handlers={kind: _explained for kind in (HTTPException, CatalogError, Exception)},
    )
    app.state.opened = opened
    app.state.desk = None if editor is None else Desk(editor, opened.look)
    app.state.review_queue = ReviewQueue()
    app.state.drop_tables = Tables()
    return app


def _explained(request: Request, error: Exception) -> Response:
    """Answer what went wrong, with the mend where there is one."""
    match error:
        case HTTPException(status_code=404, detail="Not Found"):
            return _told(request, 404, "There is no such page.")
        case HTTPException():
            return _told(request, error.status_code, error.detail)
        case CatalogGone():
            return _told(request, 503, str(error))
        case CatalogError():
            return _told(request, 500, str(error))
    what = f"motionary failed: {type(error).__name__}; the terminal it was started in tells more"
    return _told(request, 500, what)


def _told(request: Request, status: int, what: str) -> Response:
    """Tell what is wrong: scripts in JSON, people on a page."""
    if request.url.path.startswith("/data/"):
        return JSONResponse({"error": what}, status)
    return render(request, "error.html", status=status, what=what)
