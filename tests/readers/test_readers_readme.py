"""The readers' README is what the code says."""

import re
import tomllib
from pathlib import Path

import pytest

from motionary.pipeline.canonical import CANONICAL_JOINTS, CONVENTIONS, Convention
from motionary.pipeline.readers import FORMATS
from motionary.pipeline.readers.markers import MARKER_SETS, terms_of

FOLDER = Path(__file__).resolve().parents[2] / "pipeline" / "readers"
TEXT = (FOLDER / "README.md").read_text()


def rows(header: str) -> list[list[str]]:
    """Return the cells of the table whose header begins so."""
    _, _, after = TEXT.partition(f"| {header} |")
    table = after.split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table]


def test_every_module_is_named() -> None:
    named = set(re.findall(r"`(\w+\.py)`", TEXT))
    assert named == {file.name for file in FOLDER.glob("*.py")} - {"__init__.py"}


def test_every_format_has_a_row() -> None:
    table = {re.match(r"`(\.\w+)`", row[0])[1]: row[1] for row in rows("file")}
    assert table.keys() == FORMATS.keys()
    assert {suffix: kind for suffix, kind in table.items() if suffix != ".zip"} == {
        suffix: kind for suffix, kind in FORMATS.items() if suffix != ".zip"
    }


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda one: one.name)
def test_every_convention_has_its_row(convention: Convention) -> None:
    (row,) = [row for row in rows("convention") if row[0] == f"`{convention.name}`"]
    left = [joint for joint in CANONICAL_JOINTS if not joint.startswith("right_")]
    assert " ".join(row[2:]).split() == [convention.joints[joint] for joint in left]


def test_the_order_is_that_of_the_code() -> None:
    assert [row[0].strip("`") for row in rows("convention")] == [one.name for one in CONVENTIONS]
    assert [row[0].strip("`") for row in rows("set")] == [one.name for one in MARKER_SETS]


@pytest.mark.parametrize("one", MARKER_SETS, ids=lambda one: one.name)
def test_the_markers_that_are_named_are_those_of_the_set(one: Convention) -> None:
    (row,) = [row for row in rows("set") if row[0] == f"`{one.name}`"]
    needed = {name.upper() for mean in one.joints.values() for name in terms_of(mean)}
    assert set(re.findall(r"\b[A-Z][A-Z0-9]{2,3}\b", "".join(re.findall(r"`[^`]*`", row[1])))) <= needed


def test_the_example_of_a_set_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", TEXT, flags=re.DOTALL)
    own = tomllib.loads(text)["conventions"]["our-markers"]
    assert own.keys() < set(CANONICAL_JOINTS)
    assert terms_of(own["left_hip"]) == {"waistl": 3, "kneel": 1}
