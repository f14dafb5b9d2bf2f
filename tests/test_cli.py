"""The command line: its help, its messages, its exit codes."""

import json

import pytest
from checkout import Checkout
from typer.testing import CliRunner

from metro import __version__, cli
from metro.batch.findings import BatchError, Finding
from metro.codehash import code_hash
from metro.formats import FormatError

COMMANDS = ("check", "new-batch", "simulate", "run", "status", "explain", "next", "watch")
COMMANDS += ("query", "verify", "export", "frf-export")
STAGES = ("ingest", "identify", "predict", "loop", "verdict", "report", "campaign")


def call(*arguments):
    return CliRunner(env={"COLUMNS": "200", "TERMINAL_WIDTH": "200"}).invoke(
        cli.app, [str(one) for one in arguments]
    )


def test_it_says_its_version():
    assert call("--version").output == f"metro {__version__}\n"


def test_the_help_shows_every_command_what_people_call_first():
    output = call("--help").output
    places = [output.index(f"│ {name} ") for name in (*COMMANDS, *STAGES)]
    assert places == sorted(places)


@pytest.mark.parametrize("command", [*COMMANDS, *STAGES])
def test_every_command_and_option_has_a_help_text(command):
    import typer

    group = typer.main.get_command(cli.app)
    chosen = group.commands[command]
    assert chosen.help
    assert all(param.help for param in chosen.params if param.name != "help")


@pytest.mark.parametrize("command", [*COMMANDS, *STAGES])
def test_the_help_shows_every_placeholder(command):
    """Markdown eats what stands in angle brackets: reports/<batch> was shown as reports/."""
    import typer

    chosen = typer.main.get_command(cli.app).commands[command]
    told = [chosen.help, *(param.help for param in chosen.params)]
    assert not [text for text in told if "<" in text or text.rstrip(".").endswith("/")]


def test_the_help_says_where_a_batch_is_looked_for():
    assert "data/raw/BATCH" in call("verify", "--help").output
    assert "reports/BATCH" in call("loop", "--help").output


def test_a_query_of_two_forms_is_a_wrong_call():
    result = call("query", "SELECT 1", "--csv", "--json")
    assert (result.exit_code, result.stderr) == (2, "--json: found --csv, too, expected one of them\n")


@pytest.mark.parametrize("given", ["late", "data/raw/late", "reports/late", "data/processed/late"])
def test_frfs_are_exported_of_a_batch_however_it_is_named(given, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file in ("data/raw/late/batch.yaml", "data/processed/late/batch.json", "reports/late/verdict.json"):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).write_text("")
    monkeypatch.setattr("metro.stages.frf_export.frf_export", lambda *asked: [str(asked[0])])
    assert call("frf-export", given, "out.uff").output == "data/processed/late\n"


def test_a_new_batch_lacks_nothing_but_a_measurement(tmp_path):
    made = call("new-batch", "first-cut", "--root", tmp_path)
    assert made.exit_code == 0
    assert f"metro check {tmp_path}/first-cut" in made.output.replace("\n", "")
    checked = call("check", tmp_path / "first-cut")
    assert checked.exit_code == 1
    assert "1 error" in checked.output
    assert "it holds no measurement" in " ".join(checked.output.split())


def test_a_new_batch_of_a_wrong_name_is_refused_in_one_line(tmp_path):
    result = call("new-batch", "First Cut", "--root", tmp_path)
    assert result.exit_code == 2
    assert result.stderr.startswith("First Cut: is no name for a batch")
    assert not list(tmp_path.iterdir())


def test_the_check_of_several_batches_fails_when_one_of_them_does(tmp_path):
    for name in ("good", "bad"):
        Checkout(tmp_path).add_batch(name, root="")
    (tmp_path / "bad/batch.yaml").write_text("format: 2\n")
    assert call("check", tmp_path / "good", tmp_path / "bad").exit_code == 1
    assert call("check", tmp_path / "good").exit_code == 0


@pytest.mark.parametrize(
    "error",
    [
        BatchError([Finding("error", "runs.csv", "found x"), Finding("error", "runs.csv", "found y")]),
        FormatError("force/r01.csv", "row 3: found x"),
    ],
)
def test_the_users_errors_are_printed_without_a_traceback(error, tmp_path, monkeypatch):
    def ingest(**arguments):
        raise error

    monkeypatch.setattr("metro.stages.ingest.ingest", ingest)
    code = code_hash("ingest")
    result = call(
        "ingest", tmp_path, "--cells", tmp_path, "--out", tmp_path, "--settings", "{}", "--code", code
    )
    assert result.exit_code == 1
    assert result.stderr == f"{error}\n"


def test_a_bug_keeps_its_traceback(tmp_path, monkeypatch):
    def ingest(**arguments):
        raise ZeroDivisionError

    monkeypatch.setattr("metro.stages.ingest.ingest", ingest)
    code = code_hash("ingest")
    result = call(
        "ingest", tmp_path, "--cells", tmp_path, "--out", tmp_path, "--settings", "{}", "--code", code
    )
    assert isinstance(result.exception, ZeroDivisionError)


def test_a_stage_gets_its_folders_settings_and_code(tmp_path, monkeypatch):
    given = {}
    monkeypatch.setattr("metro.stages.ingest.ingest", lambda **arguments: given.update(arguments))
    code, settings = code_hash("ingest"), {"holdout": {"share": 0.5}}
    call(
        *("ingest", tmp_path, "--cells", tmp_path / "cells", "--out", tmp_path / "out"),
        *("--settings", json.dumps(settings), "--code", code),
    )
    assert given == {
        "folder": tmp_path,
        "cells": tmp_path / "cells",
        "out": tmp_path / "out",
        "settings": settings,
        "code": code,
    }


def test_a_stage_does_nothing_when_the_code_is_not_the_planned_one(tmp_path, monkeypatch):
    monkeypatch.setattr("metro.stages.ingest.ingest", lambda **_: pytest.fail("it ran"))
    result = call(
        "ingest", tmp_path, "--cells", tmp_path, "--out", tmp_path, "--settings", "{}", "--code", "0"
    )
    assert result.exit_code == 1
    assert "call metro run again" in result.stderr


@pytest.mark.parametrize(
    "command", ["check", "new-batch", "simulate", "status", "explain", "next", "query", "verify"]
)
def test_a_command_that_people_call_shows_an_example_and_can_print_json(command):
    output = call(command, "--help").output
    assert f"Example: metro {command}" in output
    assert "--json" in output


def test_checks_and_new_batches_can_be_read_by_programs(tmp_path):
    made = json.loads(call("new-batch", "first-cut", "--root", tmp_path, "--json").stdout)
    assert made == {"batch": "first-cut", "folder": str(tmp_path / "first-cut")}
    (found,) = json.loads(call("check", tmp_path / "first-cut", "--json").stdout)
    assert found["ok"] is False
    assert {"name", "source", "missing", "measured"} <= set(found["observables"][0])
    (tmp_path / "first-cut/batch.yaml").write_text("format: 2\n")
    result = call("check", tmp_path / "first-cut", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)[0]["problems"][0]["severity"] == "error"
