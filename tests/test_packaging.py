"""The house: what is installed, and that what the documents name exists."""

import io
import os
import re
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from rich.console import Console

from motionary.catalog import Catalog
from motionary.workflows.cli import app
from motionary.workflows.settings import load_settings
from motionary.workflows.summary import print_summary

ROOT = Path(__file__).resolve().parents[1]
CODE = ("pipeline", "catalog", "workflows")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_every_package_is_listed():
    listed = set(PROJECT["tool"]["setuptools"]["packages"])
    present = {
        "motionary." + file.parent.relative_to(ROOT).as_posix().replace("/", ".")
        for top in CODE
        for file in (ROOT / top).rglob("__init__.py")
    }
    files_alone = set(PROJECT["tool"]["setuptools"]["package-data"]) - {"*"} - present
    for name in files_alone:
        assert (ROOT / name.removeprefix("motionary.").replace(".", "/")).is_dir()
    assert listed == present | files_alone


def test_every_folder_of_modules_is_a_package():
    for top in CODE:
        for module in (ROOT / top).rglob("*.py"):
            assert (module.parent / "__init__.py").exists(), module


@pytest.mark.parametrize("top", CODE)
def test_every_module_imports_and_says_what_it_is(top):
    for file in (ROOT / top).rglob("*.py"):
        parts = file.relative_to(ROOT).with_suffix("").parts
        name = ".".join(["motionary", *(part for part in parts if part != "__init__")])
        assert import_module(name).__doc__, name


@pytest.mark.parametrize("top", [*CODE, "pipeline/alignment", "catalog/views", "catalog/web"])
def test_a_folders_readme_names_its_modules(top):
    text = (ROOT / top / "README.md").read_text()
    for named in re.findall(r"`([\w/]+\.py)`", text):
        assert (ROOT / top / named).exists(), named
    for file in (ROOT / top).glob("*.py"):
        if file.name != "__init__.py":
            assert f"`{file.name}`" in text, file.name
    for folder in (ROOT / top).iterdir():
        if (folder / "__init__.py").exists():
            assert f"`{folder.name}/`" in text, folder.name


def test_the_readmes_commands_and_paths_exist():
    text = (ROOT / "README.md").read_text()
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    assert set(re.findall(r"(?:`|\$ )make ([a-z-]+)", text)) <= targets
    commands = set(re.findall(r"(?:`|\$ )motionary ([a-z]+) ", text))
    known = {(one.name or one.callback.__name__) for one in app.registered_commands}
    known |= {one.name for one in app.registered_groups}
    assert commands
    assert commands <= known
    for path in re.findall(r"\]\(((?!http)[^)#]+)\)", text):
        assert (ROOT / path).exists(), path


def test_constraints_hold_versions_only():
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        assert re.fullmatch(r"[\w.-]+==[\w.!+]+", line), line


def run_snippet(readme: str, catalog: str) -> dict:
    """Run the Python that a README shows, on a catalog of the embedded library."""
    (snippet,) = re.findall(r"```python\n(.*?)```", (ROOT / readme).read_text(), flags=re.DOTALL)
    names: dict = {}
    exec(snippet.replace("motionary-demo/catalog", catalog), names)
    return names


def test_the_catalogs_readme_shows_how_to_read_it_with_pandas_alone(demo_catalog):
    assert len(run_snippet("catalog/README.md", demo_catalog)["clusters"]) >= 60


def test_the_readmes_python_runs(demo_catalog):
    assert run_snippet("README.md", demo_catalog)["motion"].fps == 30


def test_the_readmes_configuration_is_valid(tmp_path):
    (text,) = re.findall(r"```toml\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    file = tmp_path / "motionary.toml"
    file.write_text(text)
    config = load_settings(file, {})
    assert [one.name for one in config.features.conventions] == ["our-rig"]


def test_the_readme_shows_what_the_demo_prints(demo_catalog):
    printed = io.StringIO()
    print_summary(Catalog.open(demo_catalog), Console(file=printed, width=200))
    lines = {" ".join(line.split()) for line in printed.getvalue().splitlines()}
    (block,) = re.findall(r"```\n(80 clips.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    shown = [" ".join(line.split()) for line in block.splitlines() if line.strip() not in ("", "...")]
    assert len(shown) > 5
    assert set(shown) <= lines


def test_the_readmes_questions_get_the_readmes_answers(demo_library, demo_catalog):
    """The block is run in a shell, line by line, where `make demo` leaves library and catalog."""
    blocks = re.findall(r"```console\n\$ cd motionary-demo\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    asked = re.split(r"^\$ ", blocks[0], flags=re.M)[1:]
    assert len(asked) == 3
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    for one in asked:
        command, _, shown = one.partition("\n")
        shell, folder = ["bash", "-c", command], demo_library.parent
        told = subprocess.run(shell, check=False, cwd=folder, env=environment, capture_output=True, text=True)
        lines = [line.rstrip() for line in told.stdout.splitlines()]
        assert lines == shown.splitlines(), told.stderr
