"""The table of foreign files: what agrees, what does not, what cannot be said, and what ended wrongly."""

import json
from pathlib import Path

import pytest

from field.run import Result
from field.sets import SETS
from field.table import page, summary
from field.taking import FieldSet, Known, effect, face, held_out, mode

MODES = {"modes": [{"frequency": {"value": 99.0, "ci95": [98.9, 99.1]}}, {"frequency": None}]}


def row(known, identified=None, verdict=None):
    found = {"identified": identified or {}, "verdict": verdict or {}}
    result = Result(FieldSet("a-set", ("*",), known=(known,)), 3, 12.3, found=found)
    (line,) = [line for line in page([result]).splitlines() if line.startswith("| `a-set`")]
    return [cell.strip() for cell in line.strip("|").split("|")]


@pytest.mark.parametrize(
    ("value", "half", "agreement"),
    [(99.05, 0.0, "within"), (99.15, 0.1, "within"), (99.3, 0.0, "off by 3.0 half widths"), (None, 0.0, "–")],
)
def test_a_value_agrees_where_the_intervals_overlap(value, half, agreement):
    cells = row(Known("mode", "Hz", value, "", mode(99.0), half), MODES)
    assert cells[:4] == ["`a-set`", "3", "12", "report"]
    assert cells[-2:] == ["99.00 ± 0.10 Hz", agreement]


def test_what_was_not_found_cannot_be_said():
    assert row(Known("mode", "Hz", 200.0, "", mode(200.0)), MODES)[-2:] == ["none", "cannot say"]
    assert row(Known("X_m", "µm", 1.0, "", face("xm")), {"faces": {"r": {}}})[-1] == "cannot say"


def test_effects_and_held_out_errors_are_read_from_the_verdict():
    entry = {
        "after": {"rms": 2.0, "nrmse": 0.1, "ci95": [1.0, 3.0]},
        "effects": [{"effect": "tool_runout", "parameters": {"radius_um": {"value": 5.0, "ci95": [4, 6]}}}],
    }
    verdict = {"observables": {"force": entry}}
    share = row(Known("error", "%", None, "", held_out("force")), verdict=verdict)
    assert share[-2] == "10.0 ± 5.0 %"
    runout = row(Known("runout", "µm", 5.0, "", effect("force", "tool_runout", "radius_um")), verdict=verdict)
    assert runout[-1] == "within"


def test_a_set_that_ends_otherwise_than_it_should_is_wrong_and_said_so():
    copied = FieldSet("copied", ("*",), refused="bit for bit")
    right, wrong = (Result(copied, 0, 1.0, refusal=said) for said in ("the same, bit for bit", "no idea"))
    assert (right.wrong, wrong.wrong) == (False, True)
    assert Result(FieldSet("b", ("*",)), 0, 1.0, refusal="error: no").wrong
    assert "refusal (should not)" in summary([wrong])


def test_every_folder_of_the_field_files_is_a_set():
    """So that a set that is added is not forgotten."""
    import os

    data = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")).parent
    if not (data / "field").is_dir():
        pytest.skip("the field files are not there")
    folders = {path.name for path in (data / "field").iterdir() if path.is_dir()}
    assert folders <= {one.name for one in SETS}


@pytest.mark.slow
def test_every_set_ends_as_it_should(tmp_path):
    import os

    from field.run import compared

    data = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")).parent
    if not (data / "field").is_dir():
        pytest.skip("the field files are not there")
    results = compared(SETS, data, tmp_path / "field")
    assert [(one.set.name, one.refusal) for one in results if one.wrong] == []
    assert json.dumps([one.found for one in results])
