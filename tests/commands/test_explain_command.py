"""The first page of a report, in a terminal."""

import json

import pytest
from typer.testing import CliRunner

from metro.cli import app
from metro.commands.explain import bar
from metro.report.sections.verdict import sentence


@pytest.fixture
def explain(campaign):
    def explain(*arguments):
        folders = ("--processed", campaign / "data/processed", "--reports", campaign / "reports")
        return CliRunner(env={"COLUMNS": "400"}).invoke(app, ["explain", *arguments, *map(str, folders)])

    return explain


def test_it_says_what_the_report_says(explain, campaign):
    printed = explain("late").stdout
    entry = json.loads((campaign / "reports/late/verdict.json").read_text())["observables"]["force"]
    assert sentence("force", entry) in printed
    assert "Batch late" in printed
    assert "Measure next: a slot at twice the feed." in printed


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
    ("arguments", "told"),
    [
        (("late", "lobes"), "found verdicts on force, expected one on lobes"),
        (("nobody",), "nobody: there are no results of such a batch; batches with results: "),
        (("nobody",), "late"),
    ],
)
def test_what_is_not_there_is_an_error(explain, arguments, told):
    result = explain(*arguments)
    assert result.exit_code == 1
    assert told in result.stderr


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
