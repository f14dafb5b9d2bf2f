"""The same bytes in another folder, hash order, time zone and language, and with more threads of BLAS."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from outputs import bytes_lost

HERE = Path(__file__).parent
SCRIPT = """
import sys, pathlib, stage_runs
if __name__ == "__main__":
    stage_runs.Undisturbed(pathlib.Path(sys.argv[1]))
"""


@pytest.mark.parametrize(
    "other",
    [
        {"PYTHONHASHSEED": "1", "OPENBLAS_NUM_THREADS": "1", "TZ": "Asia/Kathmandu", "LC_ALL": "C"},
        pytest.param({"PYTHONHASHSEED": "2", "OPENBLAS_NUM_THREADS": "2"}, marks=pytest.mark.slow),
    ],
)
def test_the_bytes_depend_on_the_batch_alone(undisturbed, other, tmp_path):
    search = os.pathsep.join([str(HERE), str(HERE.parent / "shared"), os.environ.get("PYTHONPATH", "")])
    subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "elsewhere and deeper")],
        env={**os.environ, **other, "PYTHONPATH": search},
        check=True,
    )
    assert bytes_lost(tmp_path / "elsewhere and deeper/work", undisturbed.after["campaign"]) == []
