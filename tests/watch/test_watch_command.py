"""``metro watch`` as it is called: killed and begun again, for programs, and as a page."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from metro.watch.judgement import Judgement
from metro.watch.page import page
from virtual_cell.recipes.slot import PLANS

SLOT = next(plan for plan in PLANS if plan.condition == "slot-0.11")
# As a terminal starts it: what a script starts in the background ignores Ctrl-C, and so do its children.
LISTEN = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
CALL = [sys.executable, "-c", f"{LISTEN}; from metro.cli import app; app()", "watch", "clean-slot"]


def call(place, *options):
    return subprocess.run([*CALL, *options], cwd=place.root, capture_output=True, text=True, check=False)


def watching(place):
    """Start a watch, and wait until it looks."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(
        CALL, cwd=place.root, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    )
    lines = []
    for line in process.stdout:
        lines.append(line)
        if line.startswith("Watching"):
            return process, lines
    raise AssertionError("".join(lines))


def test_it_is_killed_and_goes_on_without_saying_or_losing_anything_twice(place):
    for run in ("r90", "r91"):
        place.plan(run, SLOT)
    process, _ = watching(place)
    place.drop("r90", place.record("r90", SLOT))
    first = process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert "force/r90.parquet (r90): as predicted" in first
    assert first.rstrip().endswith("Go on.")
    table = place.record("r91", SLOT, seed=2)
    table[["fx_n", "fy_n", "fz_n"]] *= 1.2
    place.drop("r91", table)
    done = call(place, "--once")
    assert done.returncode == 1, done.stderr
    assert "r90" not in done.stdout
    assert "force/r91.parquet (r91): differs by" in done.stdout
    again = call(place, "--once")
    assert (again.returncode, again.stdout) == (0, "")
    process, lines = watching(place)
    process.send_signal(signal.SIGINT)
    rest = process.communicate(timeout=60)[0]
    assert process.returncode == 0
    assert [line.split()[3] for line in lines if line.startswith("Judged before")] == [
        "force/r90.parquet",
        "force/r91.parquet",
    ]
    assert "Stopped" in rest
    kept = json.loads((place.reports / "watch.json").read_text())["judged"]
    assert [each["run"] for each in kept] == ["r90", "r91"]


def test_a_file_that_is_dropped_in_is_judged_within_three_seconds(place):
    place.plan("r90", SLOT)
    table = place.record("r90", SLOT)
    process, _ = watching(place)
    place.drop("r90", table)
    last_byte = time.monotonic()
    line = process.stdout.readline()
    seconds = time.monotonic() - last_byte
    process.kill()
    process.wait()
    assert "as predicted" in line
    assert seconds < 3.0


def test_programs_get_json_and_the_page_is_written_beside_the_report(place):
    place.plan("r90", SLOT)
    place.drop("r90", place.record("r90", SLOT))
    done = call(place, "--once", "--json", "--page")
    assert done.returncode == 0, done.stderr
    (row,) = map(json.loads, done.stdout.splitlines())
    assert (row["run"], row["status"]) == ("r90", "as predicted")
    text = (place.reports / "watch.html").read_text()
    assert "force/r90.parquet" in text
    assert "as predicted" in text


@pytest.mark.parametrize(("name", "code"), [("clean-slit", 2), ("../nowhere", 2)])
def test_a_wrong_folder_is_a_wrong_call(place, name, code):
    done = subprocess.run(
        [*CALL[:-1], name, "--once"], cwd=place.root, capture_output=True, text=True, check=False
    )
    assert done.returncode == code
    assert len(done.stderr.splitlines()) == 1


def test_the_page_shows_the_newest_first_reloads_itself_and_needs_no_network():
    at = "2026-01-02T10:00:0{}+00:00"
    first = Judgement("force/a<b.csv", "r1", "as predicted", "as predicted: 1 N", at=at.format(1))
    last = Judgement(
        "force/c.csv", "r2", "differs", "differs by 9 N", ("By axis: …",), "Cut again.", at=at.format(2)
    )
    text = page("some-batch", [first, last])
    assert text.index("differs by 9 N") < text.index("as predicted: 1 N")
    assert "force/a&lt;b.csv" in text
    assert re.search(r'http-equiv="refresh" content="\d"', text)
    assert 'name="viewport" content="width=device-width' in text
    assert "http:" not in text.replace("http-equiv", "")
    assert "https:" not in text
    assert "src=" not in text
    assert "No new file yet" in page("some-batch", [])
