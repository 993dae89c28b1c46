"""What is imported when: a command that only reads must not wait for compilers and schedulers."""

import subprocess
import sys

import pytest

HEAVY = {"numba", "dask", "distributed", "sklearn", "plotly", "duckdb"}


@pytest.mark.parametrize(
    "module",
    [
        "motionary.catalog",
        "motionary.pipeline.alignment",
        "motionary.pipeline.clustering",
        "motionary.pipeline.distances",
        "motionary.pipeline.readers",
        "motionary.workflows.summary",
    ],
)
def test_heavy_libraries_wait_until_they_are_needed(module):
    script = f"import sys, {module}; print(sorted({HEAVY} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_name_that_is_not_there():
    script = "import motionary.pipeline.distances as d; assert 'dtw_curve' in dir(d); d.dtw_swerve"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert "has no attribute 'dtw_swerve'" in done.stderr
