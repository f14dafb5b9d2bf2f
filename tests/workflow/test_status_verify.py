"""What people ask about a finished run: is it up to date, is it still that of its files."""

import json
import subprocess

import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def metro(checkout, *arguments):
    """Call metro in a checkout; return its exit code and what its JSON says."""
    done = subprocess.run(
        [*checkout.metro, *arguments, "--json"],
        cwd=checkout.folder,
        env=checkout.environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.stdout, done.stderr
    return done.returncode, json.loads(done.stdout)


def test_a_finished_run_is_up_to_date_and_verified(finished):
    _, status = metro(finished, "status")
    assert status["up_to_date"]
    assert set(status["batches"]) == {"alpha", "beta"}
    code, verified = metro(finished, "verify", "reports/alpha")
    assert code == 0
    assert verified["differences"] == []
    assert verified["recorded"]["stages"]["loop"]["settings"]["materiality"] == 0.004


def test_a_changed_raw_file_is_told_by_both(checkout):
    with (checkout / "data/raw/alpha/published.csv").open("a") as stream:
        stream.write("\n")
    _, status = metro(checkout, "status")
    assert list(status["batches"]["alpha"]["needs"]) == [
        "ingest",
        "identify",
        "predict",
        "loop",
        "verdict",
        "report",
    ]
    assert status["batches"]["beta"]["up_to_date"]
    code, verified = metro(checkout, "verify", "reports/alpha")
    assert code == 1
    assert [(d["kind"], d["name"]) for d in verified["differences"]] == [("raw", "published.csv")]


def test_code_and_settings_that_changed_are_told_by_stage(checkout):
    checkout.edit("config/config.yaml", "materiality: 0.004", "materiality: 0.005")
    with (checkout / "src/metro/stages/predict.py").open("a") as stream:
        stream.write("\n\ndef added() -> int:\n    return 1\n")
    code, verified = metro(checkout, "verify", "reports/beta")
    assert code == 0
    assert [(d["kind"], d["name"]) for d in verified["differences"]] == [
        ("code", "predict"),
        ("settings", "loop"),
    ]
