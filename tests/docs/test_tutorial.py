"""The tutorial is run as it stands: its shell boxes, in an empty folder, one after the other."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
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
    page = PAGE.read_text(encoding="utf-8")
    told = re.findall(r"radius ([\d.]+) ± ([\d.]+) µm,\s+angle ([\d.]+) ± ([\d.]+)°", page)
    for batch, values in zip(("first-cuts", "my-slots"), told, strict=True):
        found = runout_of(lab, batch)
        radius, angle = found["radius_um"], found["angle_deg"]
        low, high = radius["ci95"]
        assert low < 12 < high
        assert abs((angle["value"] - 40 + 45) % 90 - 45) < 3 * np.diff(angle["ci95"])[0] / 2
        shown = [radius["value"], np.diff(radius["ci95"])[0] / 2, angle["value"] % 90]
        numbers = [float(value) for value in values]
        assert [*numbers[:2], numbers[2] % 90] == pytest.approx(shown, rel=0.02)
    errors = re.findall(r"falls from\s+([\d.]+)[^(]*(?:\([^)]*\) N)? to ([\d.]+) ", page)
    for batch, printed in zip(("first-cuts", "my-slots"), errors, strict=True):
        force = force_of(lab, batch)
        found = [force[when]["rms"] for when in ("before", "after")]
        assert [float(value) for value in printed] == pytest.approx(found, rel=0.05)
    document = pypdfium2.PdfDocument(lab / "reports/first-cuts/report.pdf")
    assert "tool runout" in document[0].get_textpage().get_text_range()
    assert [path.name for path in tmp_path.iterdir()] == ["lab"]


def force_of(lab, batch):
    return json.loads((lab / f"reports/{batch}/verdict.json").read_text())["observables"]["force"]


def runout_of(lab, batch):
    verdict = force_of(lab, batch)
    assert verdict["status"] == "explained"
    (runout,) = verdict["effects"]
    assert runout["effect"] == "tool_runout"
    return runout["parameters"]


def test_what_the_page_says_is_printed_has_lines_of_commands_that_are_run():
    """A box of what is printed stands below a box that is run, and names the batch as that does."""
    page = PAGE.read_text(encoding="utf-8")
    prints = re.findall(r'^```text title="prints"$', page, re.MULTILINE)
    assert len(prints) >= 8
    for before in re.split(r'^```text title="prints"$', page, flags=re.MULTILINE)[:-1]:
        closed = before.rstrip().rpartition("```")[0]
        assert closed.rpartition("```")[2].startswith("shell\n")
