"""Fixtures that more than one test module uses."""

from pathlib import Path

import pytest

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real motion capture that lies beside the project, where it does."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"no real motion capture at {SHARED_DATA}")
    return SHARED_DATA
