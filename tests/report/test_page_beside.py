"""Another run's curve at the places of the one that is drawn: by the page's own script."""

import json
import shutil
import subprocess
from importlib.resources import files

import pytest

NODE = shutil.which("node")
SCRIPT = files("metro.report.page") / "assets" / "beside.js"


@pytest.mark.skipif(NODE is None, reason="node is not installed")
def test_a_curve_is_straight_between_its_places_and_nothing_over_a_gap_or_beyond_its_ends():
    """Places 2 and 8 are parted by a gap: nothing was measured between them."""
    calls = [
        f"between([0, 1, 2, 8, 9], [0, 10, 20, 80, 70], new Set([3]), {x})" for x in (-1, 1, 1.5, 5, 8.5, 10)
    ]
    script = f"{SCRIPT.read_text()}; console.log(JSON.stringify([{', '.join(calls)}]))"
    said = subprocess.run([NODE, "-e", script], capture_output=True, text=True, check=True)
    assert json.loads(said.stdout) == [None, 10, 15, None, 75, None]
