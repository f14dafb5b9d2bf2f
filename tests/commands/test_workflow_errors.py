"""What is wrong with the settings or the folders of batches is the last thing that snakemake says."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]
ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("settings", "arguments", "told"),
    [
        (None, ["--config", "raw_root=[x]"], 'raw_root: is not a known key (did you mean "raw_roots"?)'),
        (
            "raw_roots: [data/raw\n",
            [],
            "config/config.yaml: line 2: expected ',' or ']', but got '<stream end>'",
        ),
        (None, [], "data/raw: is not a folder: every raw root must be there"),
    ],
)
def test_the_cause_is_the_last_line(tmp_path, settings, arguments, told):
    if settings:
        (tmp_path / "config").mkdir()
        (tmp_path / "config/config.yaml").write_text(settings)
    command = [Path(sys.executable).parent / "snakemake", "--snakefile", ROOT / "Snakefile", "--dry-run"]
    done = subprocess.run(
        [*map(str, command), *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(told)
    assert 'File "' not in done.stderr
