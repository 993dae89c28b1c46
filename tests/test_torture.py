"""A small share of `make torture`, in a process of its own: it forks, and this one may have threads."""

import subprocess
import sys
from pathlib import Path

import pytest

TRIALS = Path(__file__).parent / "torture" / "trials.py"


@pytest.mark.timeout(1800)
@pytest.mark.slow
@pytest.mark.parametrize("share", ["not slow", "slow"])
def test_a_share_of_torture(share):
    pytest_anew = [sys.executable, "-m", "pytest", "-q", "-m", share, str(TRIALS)]
    done = subprocess.run(pytest_anew, cwd=TRIALS.parents[2], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
