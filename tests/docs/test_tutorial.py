"""The tutorial is run as it stands: its shell boxes, in an empty folder, one after the other."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pypdfium2
import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "tutorial.md"


def boxes():
    return re.findall(r"^```shell\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.workflow
def test_every_line_of_the_tutorial_works_and_finds_what_was_hidden(tmp_path):
    environment = {
        **os.environ,
        "METRO": str(ROOT),
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)]),
        "COLUMNS": "120",
    }
    assert len(boxes()) >= 8
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", "".join(boxes())],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    lab = tmp_path / "lab"
    verdict = json.loads((lab / "reports/first-slots/verdict.json").read_text())["observables"]["force"]
    assert verdict["status"] == "explained"
    (runout,) = verdict["effects"]
    assert runout["effect"] == "tool_runout"
    low, high = runout["parameters"]["radius_um"]["ci95"]
    assert low < 12 < high
    document = pypdfium2.PdfDocument(lab / "reports/first-slots/report.pdf")
    assert "tool runout" in document[0].get_textpage().get_text_range()
    assert [path.name for path in tmp_path.iterdir()] == ["lab"]
