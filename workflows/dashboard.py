"""Where Dask's dashboard is, if it leads anywhere from here."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.error import HTTPError
from urllib.request import urlopen

if TYPE_CHECKING:
    from distributed import Client

_NEEDS_BOKEH = b"needs bokeh"  # what a scheduler without it shows instead


def dashboard_hint(client: Client) -> str:
    """Say where to watch the workers of a client, or what is missing for that.

    Parameters
    ----------
    client : Client

    Returns
    -------
    str
        Without a full stop.
    """
    try:
        link = client.dashboard_link
        with urlopen(link, timeout=3) as page:
            shown = page.read()
    except (KeyError, HTTPError):
        return "the scheduler was started without a dashboard"
    except (OSError, ValueError):
        return f"the scheduler's dashboard, {link}, cannot be reached from here"
    if _NEEDS_BOKEH in shown:
        return "for a dashboard install motionary[dashboard] where the scheduler runs"
    return f"dashboard {link}"
