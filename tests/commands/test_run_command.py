"""``metro run`` calls snakemake with the workflow that came along, in the folder in which it is called."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from metro.cli import app

WORKFLOW = str(Path(__file__).parents[2] / "Snakefile")


@pytest.fixture
def snakemake(monkeypatch):
    """Keep what would be called, and let it end with an exit code."""
    kept = SimpleNamespace(asked=[], code=0)

    def call(command, **_):
        kept.asked.append(command)
        return subprocess.CompletedProcess(command, kept.code)

    monkeypatch.setattr("metro.commands.run.subprocess.run", call)
    return kept


def test_a_folder_without_a_workflow_has_that_of_the_checkout(snakemake, own_campaign):
    assert CliRunner().invoke(app, ["run"]).exit_code == 0
    (command,) = snakemake.asked
    assert command == [
        sys.executable,
        "-m",
        "snakemake",
        "--snakefile",
        WORKFLOW,
        "--cores",
        "all",
    ]


@pytest.mark.parametrize("given", ["late", "data/raw/late"])
def test_a_batch_by_name_or_folder_is_its_report(snakemake, own_campaign, given):
    CliRunner().invoke(app, ["run", given, "--cores", "2", "--dry-run"])
    assert snakemake.asked[0][-4:] == ["--cores", "2", "--dry-run", "reports/late/report.pdf"]


def test_the_exit_code_is_that_of_snakemake(snakemake, own_campaign):
    snakemake.code = 1
    assert CliRunner().invoke(app, ["run"]).exit_code == 1


def test_a_batch_that_is_not_there_is_refused_before_anything_runs(snakemake, own_campaign):
    result = CliRunner().invoke(app, ["run", "lates"])
    assert (result.exit_code, snakemake.asked) == (2, [])
    assert 'did you mean "late"' in result.stderr


def test_a_workflow_that_is_not_there_is_refused(snakemake, own_campaign):
    result = CliRunner().invoke(app, ["run", "--snakefile", "none"])
    assert (result.exit_code, snakemake.asked) == (2, [])
