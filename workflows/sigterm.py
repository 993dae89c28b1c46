"""What SIGTERM does, for as long as something must be left in order."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def on_sigterm(handler: Callable[..., object]) -> Iterator[None]:
    """Have SIGTERM call a handler meanwhile."""
    before = signal.signal(signal.SIGTERM, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
