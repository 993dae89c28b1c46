"""The command line, from the program itself: every command with its arguments, options and examples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer

from motionary.workflows.cli import app
from motionary.workflows.documentation.markdown import code, plain, table

Words = tuple[str, ...]


def commands_text() -> str:
    """Write a section a command, in the order of `motionary --help`."""
    return "\n\n".join(_section(words, command) for words, command in commands())


def commands() -> Iterator[tuple[Words, Any]]:
    """List every command, with the words that call it."""
    yield from _under(typer.main.get_command(app), ("motionary",))


def _under(group: Any, words: Words) -> Iterator[tuple[Words, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _under(command, (*words, name))
        else:
            yield (*words, name), command


def _section(words: Words, command: Any) -> str:
    context = command.context_class(command, info_name=" ".join(words))
    usage = command.get_usage(context).removeprefix("Usage: ")
    records = [one.get_help_record(context) for one in command.params if not getattr(one, "hidden", False)]
    rows = [[code(term), plain(said)] for term, said in records]
    return "\n\n".join(
        [
            f"({'-'.join(words)})=\n\n## {' '.join(words)}",
            "\n\n".join(plain(one) for one in (command.help or "").split("\n\n")),
            f"```text\n{usage}\n```",
            table(["argument or option", "meaning"], rows),
            f"```console\n{_examples(command)}\n```",
        ]
    )


def _examples(command: Any) -> str:
    """Return the lines of a command's examples, what each gives above it."""
    return command.epilog.removeprefix("Examples:").replace(r"\[", "[").strip()
