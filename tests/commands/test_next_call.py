"""``metro next`` refuses a wrong call before the search, and leaves standard output to its answer."""

import pytest
from typer.testing import CliRunner

from metro.cli import app
from metro.commands.next_runs import at_work


def call(*arguments):
    return CliRunner(env={"TTY_COMPATIBLE": "1"}).invoke(app, ["next", *arguments])


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (("lates",), 2, 'lates: there is no such batch (did you mean "late"?)'),
        (("late", "--observable", "forse"), 2, 'forse: is no observable (did you mean "force"?)'),
        (("late", "--observable", "lobes"), 1, "late: found verdicts on force, expected one on lobes"),
        (("late", "--limit", "axial=1:2"), 2, '--limit: found "axial=1:2", expected COLUMN=LOW:HIGH'),
    ],
)
def test_a_wrong_call_is_told_at_once(own_campaign, monkeypatch, arguments, code, told):
    monkeypatch.setattr("metro.stages.next_runs.next_runs", lambda *_, **__: pytest.fail("it searched"))
    result = call(*arguments)
    assert result.exit_code == code
    assert result.stderr.startswith(told)


@pytest.mark.parametrize("given", ["late", "data/raw/late", "reports/late"])
def test_a_terminal_is_told_what_takes_so_long_and_the_answer_stands_alone(own_campaign, monkeypatch, given):
    monkeypatch.setattr("metro.stages.next_runs.next_runs", lambda name, *_, **__: print(f"answer on {name}"))
    result = call(given)
    assert result.stdout == "answer on late\n"
    assert "late: planning runs" in result.stderr
    assert "0:00:0" in result.stderr


def test_what_is_no_terminal_is_told_nothing(own_campaign, monkeypatch):
    monkeypatch.setattr("metro.stages.next_runs.next_runs", lambda *_, **__: print("answer"))
    assert CliRunner().invoke(app, ["next", "late"]).output == "answer\n"


def test_what_was_said_before_an_error_is_not_lost(capsys):
    def breaks():
        with at_work("planning"):
            print("half of the answer")
            raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        breaks()
    assert capsys.readouterr().out == "half of the answer\n"
