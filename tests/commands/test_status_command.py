"""What must run, as snakemake says it, and the verdicts that are there."""

import json
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from checkout import Checkout
from typer.testing import CliRunner

from metro.batch.findings import ContractError
from metro.cli import app
from metro.commands.status import planned

ROOT = Path(__file__).parents[2]
HEADER = "output_file\tdate\trule\tlog-file(s)\tstatus\tplan"
LINES = [
    HEADER,
    "reports/late/report.pdf\tnow\treport\t\tok\tupdate pending",
    "data/processed/late/force.parquet\tnow\tingest\t\tok\tno update",
    "data/processed/late/lobes.parquet\tnow\tidentify\t\tparams changed\tupdate pending",
    "data/processed/late/modes.parquet\tnow\tidentify\t\tparams changed\tupdate pending",
    "data/processed/early/force.parquet\tnow\tingest\t\tok\tno update",
    "reports/early/report.pdf\tnow\treport\t\tok\tno update",
    "reports/summary.pdf\t-\tcampaign\t\tmissing\tupdate pending",
]


@pytest.fixture
def snakemake(own_campaign, monkeypatch):
    """Put an answer in snakemake's place; return what was asked."""
    (own_campaign / "Snakefile").write_text("")
    answer = SimpleNamespace(returncode=0, stdout="\n".join(LINES), stderr="", asked=[])

    def run(command, **_):
        answer.asked.append(command)
        return answer

    monkeypatch.setattr(subprocess, "run", run)
    return answer


def test_stages_stand_in_their_order_with_snakemakes_reason():
    batches, summary = planned(LINES)
    assert list(batches) == ["early", "late"]
    assert batches["early"].needs == {}
    assert batches["late"].needs == {"identify": "params changed", "report": "a stage before it"}
    assert summary


def test_nothing_waits_where_every_line_says_so():
    batches, summary = planned([line.replace("update pending", "no update") for line in LINES])
    assert not summary
    assert not any(batch.needs for batch in batches.values())


def test_a_summary_of_another_form_is_refused_not_misread():
    with pytest.raises(ContractError, match="lacks the columns plan"):
        planned([line.rpartition("\t")[0] for line in LINES])


def test_verdicts_stand_beside_what_must_run(snakemake):
    result = CliRunner().invoke(app, ["status", "--json"])
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)
    assert content["up_to_date"] is False
    assert content["batches"]["early"] == {"up_to_date": True, "needs": {}, "verdicts": {"force": "clean"}}
    assert content["batches"]["late"]["verdicts"] == {"force": "explained"}
    assert "--summary" in snakemake.asked[0]


def test_people_are_told_in_a_table(snakemake):
    printed = CliRunner(env={"COLUMNS": "120"}).invoke(app, ["status"]).stdout
    assert "identify, report (params changed)" in printed
    assert "1 of 2 batches need snakemake, and so does the summary" in printed


def test_what_snakemake_complains_of_is_passed_on(snakemake):
    snakemake.returncode, snakemake.stderr = 1, "Building\nBatchError: data/raw: holds no batch"
    result = CliRunner().invoke(app, ["status"])
    assert result.exit_code == 1
    assert "data/raw: holds no batch" in result.stderr


def test_a_workflow_that_is_not_there_is_a_wrong_call(snakemake):
    result = CliRunner().invoke(app, ["status", "--snakefile", "nope"])
    assert (result.exit_code, result.stderr) == (2, "--snakefile: nope is not there\n")
    assert snakemake.asked == []


def test_a_folder_of_its_own_has_the_workflow_of_the_checkout(snakemake, own_campaign):
    (own_campaign / "Snakefile").unlink()
    assert CliRunner().invoke(app, ["status"]).exit_code == 0
    assert snakemake.asked[0][-1] == str(ROOT / "Snakefile")


def test_a_folder_without_any_workflow_says_what_to_do(snakemake, own_campaign, monkeypatch):
    (own_campaign / "Snakefile").unlink()
    monkeypatch.setattr("metro.commands.workflow_file.CHECKOUT", own_campaign / "none")
    monkeypatch.setattr("metro.commands.workflow_file.DISTRIBUTION", "not-installed")
    result = CliRunner().invoke(app, ["status"])
    assert result.exit_code == 2
    assert "--snakefile" in result.stderr


@pytest.fixture
def unread(snakemake, own_campaign):
    """Let the raw files of one batch, of two in the folder, wait to be read; both have nothing but them."""
    for name in ("late", "early"):
        shutil.rmtree(own_campaign / "data/raw" / name)
    shutil.copytree(ROOT / "config", own_campaign / "config")
    for name in ("late", "early"):
        Checkout(own_campaign).add_batch(name)
    snakemake.stdout += "\ndata/processed/late/qc.parquet\t-\tingest\t\tmissing\tupdate pending"
    return own_campaign / "data/raw"


def test_a_batch_that_the_check_refuses_is_told_with_the_first_error(unread):
    (unread / "late/batch.yaml").write_text("format: [1\n")
    (unread / "early/batch.yaml").write_text("format: [1\n")  # it need not be read: its tables are there
    printed = CliRunner(env={"COLUMNS": "200"}).invoke(app, ["status"]).stdout
    assert "refused: batch.yaml: line 2: expected" in printed
    assert "1 refused: metro check says all" in printed
    content = json.loads(CliRunner().invoke(app, ["status", "--json"]).stdout)["batches"]
    assert content["late"]["refused"].startswith("batch.yaml: line 2")
    assert "refused" not in content["early"]


def test_a_batch_that_waits_and_is_sound_is_not_refused(unread):
    printed = CliRunner(env={"COLUMNS": "200"}).invoke(app, ["status"]).stdout
    assert "refused" not in printed
    assert "ingest, identify, report (not made yet)" in printed


STOPPED = "reports/late/findings.json\t-\tloop\tlogs/loop/late.log\tmissing\tupdate pending"


@pytest.mark.parametrize(
    ("log", "told"),
    [
        (
            "Traceback (most recent call last):\n  …\nIndexError: too many indices\n\n",
            "IndexError: too many indices",
        ),
        ("closing the loop\nMemoryError\n", "MemoryError"),
        (
            "metro.batch.findings.ContractError: runs.csv: row 3\n",
            "metro.batch.findings.ContractError: runs.csv: row 3",
        ),
        ("closing the loop 10/10\n", ""),  # it ran to its end; its output was removed later
        ("", ""),
    ],
)
def test_a_stage_that_failed_is_told_with_the_end_of_its_log(snakemake, own_campaign, log, told):
    snakemake.stdout += f"\n{STOPPED}"
    (own_campaign / "logs/loop").mkdir(parents=True)
    (own_campaign / "logs/loop/late.log").write_text(log, encoding="utf-8")
    content = json.loads(CliRunner().invoke(app, ["status", "--json"]).stdout)["batches"]
    printed = CliRunner(env={"COLUMNS": "200"}).invoke(app, ["status"]).stdout
    if told:
        assert content["late"]["failed"] == f"loop failed: {told} (logs/loop/late.log)"
        assert f"loop failed: {told}" in printed
        assert "1 failed: after mending the cause" in printed
    else:
        assert "failed" not in content["late"]
        assert "failed" not in printed


def test_a_log_that_is_not_there_says_nothing(snakemake):
    snakemake.stdout += f"\n{STOPPED}"
    assert "failed" not in CliRunner(env={"COLUMNS": "200"}).invoke(app, ["status"]).stdout
