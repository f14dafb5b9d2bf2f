"""The first page of a report, in a terminal."""

import json

import pandas as pd
import pytest
from rich.console import Console, Group
from small_campaign import q
from typer.testing import CliRunner

from metro.batch.processed import write_json, write_table
from metro.cli import app
from metro.commands.bars import bar, error_bars
from metro.report.sections.verdict import next_words, verdict_words


@pytest.fixture
def explain(campaign):
    def explain(*arguments):
        folders = ("--processed", campaign / "data/processed", "--reports", campaign / "reports")
        return CliRunner(env={"COLUMNS": "400"}).invoke(app, ["explain", *arguments, *map(str, folders)])

    return explain


def test_it_says_what_the_report_says(explain, campaign):
    printed = explain("late").stdout
    entry = json.loads((campaign / "reports/late/verdict.json").read_text())["observables"]["force"]
    assert verdict_words("force", entry) in printed
    assert "Batch late" in printed
    assert f"What to do next: {next_words(entry)}." in printed
    assert "a slot at twice the feed" in printed


def test_the_recommended_cut_of_page_one_is_there(explain, campaign):
    file = campaign / "reports/late/verdict.json"
    verdict = json.loads(file.read_text())
    cut = {
        "position": "1",
        "spindle_rpm": 2500.0,
        "axial_depth_mm": 0.061,
        "removal_cm3_min": 1.2,
        "torque_nm": 2.3,
        "probability_stable": 0.975,
        "advice": "use",
        "why": "tests_confirm_the_band",
    }
    write_json(file, {**verdict, "recommended_cuts": [cut]})
    try:
        assert "Recommended cut: 2500 rpm, 0.061 mm deep" in explain("late").stdout
    finally:
        write_json(file, verdict)


def test_errors_are_drawn_to_one_scale_with_the_floor(explain):
    lines = explain("late").stdout.splitlines()
    before = next(line for line in lines if line.startswith("base model"))
    after = next(line for line in lines if line.startswith("with effects"))
    assert before.count("█") > 4 * after.count("█") > 0
    assert before.index("│") == after.index("│")
    assert "11.8 ± 1.2 N (12 % of the signal)" in before


def test_candidates_stand_with_the_reason_why_not_the_most_probable_first(explain):
    printed = explain("late", "force").stdout
    places = [printed.index(f"\n{name}") for name in ("tool runout ", "tool wear ", "pitch error ")]
    assert places == sorted(places)
    assert "no gain" in printed


def test_programs_get_the_verdict_and_the_words(explain):
    content = json.loads(explain("late", "--json").stdout)
    assert content["observables"]["force"]["status"] == "explained"
    assert "tool runout (radius 9.80 ± 0.50 µm" in content["observables"]["force"]["words"]


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (("late", "lobes"), 1, "late: found verdicts on force, expected one on lobes"),
        (("late", "forse"), 2, 'forse: is no observable (did you mean "force"?)'),
        (("lates",), 2, 'lates: there is no such batch (did you mean "late"?)'),
        (("nobody",), 2, "nobody: there is no such batch; there are: early, late"),
    ],
)
def test_what_is_not_there_is_an_error_in_one_line(explain, arguments, code, told):
    result = explain(*arguments)
    assert (result.exit_code, result.stderr) == (code, f"{told}\n")


@pytest.fixture
def two_observables(own_campaign):
    """Return a function that prints a batch with a cause behind two verdicts, and a check that failed."""
    processed, reports = own_campaign / "data/processed/late", own_campaign / "reports/late"
    content = json.loads((reports / "verdict.json").read_text())
    (entry,) = content["observables"].values()
    observables = {"force": entry, "deformation": entry, "flatness": entry}
    write_json(reports / "verdict.json", {**content, "observables": observables})
    cause = {
        "cause": "stiffness_scale",
        "where": {},
        "seen_in": ["deformation", "force"],
        "parameters": {"factor": q(0.85, 0.04, "1")},
        "probability": 0.9999,
        "status": "confirmed",
        "words": "",
    }
    write_json(processed / "loop.json", {"format": 1, "observables": {}, "causes": [cause]})
    failed = {"check": "clipping", "value": 9.0, "limit": 3.0, "ok": False, "message": "saturated"}
    sound = {**failed, "ok": True, "message": ""}
    rows = [{**row, "file": f"force/r{i}.csv", "run": f"r{i}"} for i, row in enumerate((failed, sound), 1)]
    write_table(processed / "qc.parquet", pd.DataFrame(rows))

    def explain(*arguments):
        return CliRunner(env={"COLUMNS": "400"}).invoke(app, ["explain", "late", *arguments]).stdout

    return explain


def test_the_causes_behind_several_verdicts_and_the_flags_of_the_first_page_are_told(two_observables):
    printed = two_observables()
    (row,) = (line for line in printed.splitlines() if "confirmed" in line)
    assert "deformation of the wall and cutting force" in row
    assert "factor 0.850 ± 0.040" in row
    assert "Flagged in the raw data: force/r1.csv: saturated." in printed
    assert "r2.csv" not in printed


def test_of_one_observable_only_its_causes_are_told(two_observables):
    assert "confirmed" in two_observables("deformation")
    assert "confirmed" not in two_observables("flatness")


def test_programs_get_causes_and_flags(two_observables):
    content = json.loads(two_observables("--json"))
    assert [cause["cause"] for cause in content["causes"]] == ["stiffness_scale"]
    assert content["flags"] == ["Flagged in the raw data: force/r1.csv: saturated."]


@pytest.mark.parametrize("width", [64, 80, 100, 200])
def test_bars_are_whole_with_their_numbers_in_one_line_each(campaign, width):
    entry = json.loads((campaign / "reports/late/verdict.json").read_text())["observables"]["force"]
    console = Console(width=width, color_system=None)
    with console.capture() as caught:
        console.print(Group(*error_bars(entry, width)))
    before, after, floor = caught.get().splitlines()
    assert "…" not in before + after
    assert before.index("│") == after.index("│")
    assert "█ 11.8 ± 1.2 N (12 % of the signal)" in before
    assert "│ noise floor" in floor


def test_a_terminal_too_narrow_for_bar_and_numbers_keeps_the_bar():
    errors = {"rms": 11.8, "nrmse": 0.1, "ci95": [10.0, 13.0]}
    entry = {"before": errors, "after": errors, "noise_floor": 5.9, "unit": "N"}
    console = Console(width=40, color_system=None)
    with console.capture() as caught:
        console.print(Group(*error_bars(entry, 40)))
    assert "base model   ██████│██████" in caught.get()


@pytest.mark.parametrize(
    ("size", "mark", "drawn"),
    [
        (1.0, None, "████"),
        (0.5, None, "██  "),
        (0.0, None, "    "),
        (0.53125, None, "██▏ "),
        (0.5, 1.0, "██ │"),
        (1.0, 0.0, "│███"),
        (2.0, None, "████"),
    ],
)
def test_a_bar_is_as_long_as_its_value_to_an_eighth(size, mark, drawn):
    assert bar(size, 1.0, 4, mark) == drawn
