"""Machine code is kept, and never older than any of the modules it was built from."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from motionary import pipeline

PRINT_COST = (
    "from motionary.pipeline.distances import cost_matrix; print(cost_matrix([[0.0]], [[3.0]])[0, 0])"
)


def printed(folder: Path) -> float:
    environment = os.environ | {"PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", PRINT_COST],
        env=environment, capture_output=True, text=True, check=True, cwd=folder,
    )  # fmt: skip
    return float(done.stdout)


def test_a_change_in_a_module_that_a_kernel_calls_counts(tmp_path):
    """The kernel of `cost.py` is built from the operations of `lanes.py`."""
    copy = tmp_path / "motionary" / "pipeline"
    shutil.copytree(Path(pipeline.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    assert printed(tmp_path) == 3.0
    kept = sorted((tmp_path / "cache").rglob("*.nbc"))
    assert printed(tmp_path) == 3.0
    assert sorted((tmp_path / "cache").rglob("*.nbc")) == kept
    module = copy / "distances" / "lanes.py"
    module.write_text(module.read_text().replace('"sqrt"', '"fabs"'))
    assert printed(tmp_path) == 9.0
