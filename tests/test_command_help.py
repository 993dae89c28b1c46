"""Every command's help ends with examples that it understands, and every command speaks JSON."""

import json
import os
import re
import shlex
import subprocess
import sys

import pytest
import typer

from motionary.workflows import cli

GROUP = typer.main.get_command(cli.app)
JSON_OPTIONS = {"--json", "--format"}


def commands(group=GROUP, path=()):
    """List every command with the words that call it."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*path, name))
        else:
            yield (*path, name), command


EVERY_COMMAND = pytest.mark.parametrize(
    ("path", "command"), [pytest.param(*one, id=" ".join(one[0])) for one in commands()]
)


def examples_of(command):
    head, *lines = (command.epilog or "").splitlines()
    assert head == "Examples:"
    assert all(len(line) <= 78 and line[:2] in ("", "# ", "$ ") for line in lines), "a terminal folds it"
    return [line[2:].replace(r"\[", "[") for line in lines if line.startswith("$")]


def words_of(example):
    """Split an example as a shell does, up to its comment, its pipe or the file it writes."""
    lexer = shlex.shlex(example, posix=True, punctuation_chars="|>")
    lexer.whitespace_split = True
    words = []
    for word in lexer:
        if word[0] in "|>":
            break
        words.append(word)
    return words


@EVERY_COMMAND
def test_examples_are_understood(path, command):
    own = 0
    for example in examples_of(command):
        words = words_of(example)
        assert words[0] == "motionary", example
        called, found = words[1:], GROUP
        used = []
        while hasattr(found, "commands"):
            used.append(called[0])
            found, called = found.commands[called[0]], called[1:]
        own += tuple(used) == path
        with found.make_context(" ".join(used), called):  # an option that is not there is a usage error
            pass
    assert own, "no example calls the command itself"


def test_what_looks_like_markup_is_shown(motionary):
    code, out, _ = motionary("run", "--help")
    assert code == 0
    assert "--label-pattern '(?P<action>[a-z]+)_'" in out


def test_an_unknown_option_in_an_example_would_be_seen():
    with pytest.raises(Exception, match="No such option"):
        GROUP.commands["query"].make_context("query", words_of('motionary query CATALOG "x" --formt csv')[2:])


@EVERY_COMMAND
def test_every_command_speaks_json(path, command):
    assert JSON_OPTIONS & {name for option in command.params for name in option.opts}


WALK = "walk/walk_neutral_alex_01.bvh"


@pytest.mark.parametrize(
    "arguments",
    [
        ("status", "CATALOG", "--json"),
        ("status", "CATALOG", "--clip", WALK, "--json"),
        ("query", "CATALOG", "select 1.0 / 0.0 as endless, 'a' as letter", "--format", "json"),
        ("runs", "CATALOG", "--format", "json"),
        ("verify", "CATALOG", "--format", "json"),
        ("doctor", "CATALOG", "--format", "json"),
        ("vacuum", "CATALOG", "--dry-run", "--json"),
        ("run", "LIBRARY", "OUT", "--dry-run", "--json"),
        ("graph", "OUT.svg", "--json"),
        ("label", "list", "CATALOG", "--format", "json"),
        ("label", "review", "CATALOG", "--format", "json"),
        ("similar", "CATALOG", WALK, "--format", "json"),
        ("similar", "CATALOG", WALK, "--within", "--format", "json"),
        ("assign", "CATALOG", "LIBRARY/walk", "--format", "json"),
        ("explain", "CATALOG", WALK, "walk/walk_tired_alex_01.bvh", "--json"),
        ("export", "CATALOG", "OUT", "--clip", WALK, "--json"),
        ("fetch", "--format", "json"),
    ],
    ids=" ".join,
)
def test_what_is_printed_is_json(arguments, demo_catalog, demo_library, tmp_path, motionary):
    given = {"CATALOG": demo_catalog, "LIBRARY": str(demo_library), "OUT": str(tmp_path / "out")}
    words = [re.sub("^(CATALOG|LIBRARY|OUT)", lambda name: given[name[0]], word) for word in arguments]
    code, printed, _ = motionary(*words)
    assert code == 0
    answer = json.loads(printed, parse_constant=pytest.fail)
    assert answer or arguments[:2] == ("label", "list")


@pytest.mark.parametrize(
    ("typed", "offered"), [("motionary sim", "similar"), ("motionary run --label-p", "--label-pattern")]
)
def test_a_shell_can_complete(typed, offered):
    words = typed.split()
    asked = {"_MOTIONARY_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(len(words) - 1)}
    program = [sys.executable, "-c", "from motionary.workflows.cli import main; main()"]
    told = subprocess.run(program, env=os.environ | asked, capture_output=True, text=True, check=False)
    assert offered in told.stdout.split(), told.stderr
