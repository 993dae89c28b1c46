"""The command that serves a catalog as pages."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motionary.workflows.commands.options import (
    AsJson,
    CatalogUrl,
    compile_first,
    open_catalog,
    stderr_console,
)

if TYPE_CHECKING:
    from motionary.catalog.writer_lock import Writer
    from motionary.workflows.browse import Place

EXAMPLES = {
    "browse": (
        "motionary browse CATALOG",
        "motionary browse CATALOG --edit --open  # labels may be changed, and a browser shows it",
        "motionary browse CATALOG --port 0 --json  # any free port, and which it is",
        "motionary browse CATALOG --host 0.0.0.0 --token-file TOKEN  # for others, who know the token",
    )
}


def browse(
    catalog: CatalogUrl,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="0 takes one that is free.")] = 8765,
    host: Annotated[
        str, typer.Option("--host", help="Address to listen on; any but this machine's own asks for a token.")
    ] = "127.0.0.1",
    edit: Annotated[bool, typer.Option("--edit", help="Let labels be changed.")] = False,
    token_file: Annotated[
        Path | None,
        typer.Option(
            "--token-file",
            help="Ask for the token in this file, else for that in MOTIONARY_BROWSE_TOKEN.",
            show_default="one is made where it is needed",
        ),
    ] = None,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Show it in a browser.")] = False,
    as_json: AsJson = False,
) -> None:
    """Serve CATALOG as pages: look, search, compare, review, drop a file; until Ctrl-C.

    Other users of this machine can open it too, unless a token is given.
    """
    from motionary.workflows.browse import LabelEditor, find_token, serve, take_place
    from motionary.workflows.commands.label import current_user

    with open_catalog(catalog) as opened:
        opened.files("labels" if edit else "clips")
    compile_first()
    place = take_place(host, port)
    with place.socket:
        token = find_token(token_file, place.loopback)
        editor = LabelEditor(catalog, current_user(), _taking_over) if edit else None
        address = f"{place.url}?token={token.value}" if token.made else place.url
        told = "" if token.value is None or token.made else "; it asks for the token"
        serve(catalog, place, token, editor, lambda: _tell(address, told, place, open_, as_json))


def _tell(address: str, told: str, place: Place, open_: bool, as_json: bool) -> None:
    import json

    if as_json:  # a line, at once: what waits for it reads a pipe
        print(json.dumps({"url": address, "host": place.host, "port": place.port}), flush=True)
    else:
        _say(f"{address}{told}; Ctrl-C ends it")
    if open_:
        import threading
        import webbrowser

        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def _taking_over(dead: Writer) -> None:
    _say(f"taking over from a run that died: {dead}")


def _say(remark: str) -> None:
    stderr_console().print(remark, highlight=False, soft_wrap=True, markup=False)
