"""The names of a package that users import, for Sphinx to take their docstrings."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from inspect import isclass, isroutine


def python_text(module: str, *names: str) -> str:
    """Ask for the docstrings of names, or of all that a package gives out.

    Parameters
    ----------
    module : str
        Name of a module.
    *names : str
        What of it is public; left out, its `__all__`.

    Raises
    ------
    AttributeError
        The module has no such name.
    """
    held = import_module(module)
    shown: Sequence[str] = names or held.__all__
    entries = [_entry(module, name, getattr(held, name)) for name in shown]
    return "\n\n".join([f"In `{module}`:", *entries])


def _entry(module: str, name: str, value: object) -> str:
    kind = "autoclass" if isclass(value) else "autofunction" if isroutine(value) else "autodata"
    options = {"autoclass": "\n   :members:", "autodata": "\n   :no-value:"}.get(kind, "")
    return f"```{{eval-rst}}\n.. {kind}:: {module}.{name}{options}\n```"
