"""A first run: from folders of raw files to reports."""

import json
import re
import shutil
import subprocess
import sys

import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def test_it_leaves_what_the_contract_promises(finished):
    for batch in ("alpha", "beta"):
        assert (finished / f"reports/{batch}/report.pdf").read_bytes().startswith(b"%PDF")
        for name in ("identified", "verdict"):
            content = json.loads((finished / f"reports/{batch}/{name}.json").read_text())
            assert content["batch"] == batch
    assert (finished / "reports/summary.pdf").read_bytes().startswith(b"%PDF")
    assert (finished / "reports/summary.parquet").exists()


def test_it_shows_its_progress_and_says_what_it_does(finished):
    assert "alpha: checking and reading the raw files" in finished.first_output
    assert re.search(r"\d+ of 14 steps  alpha: writing the report  \(\d+ s\)\n", finished.first_output)


def test_ingest_declares_every_canonical_table(finished):
    from metro.batch.processed import COLUMNS

    declared = set(
        re.findall(r'^ +"(\w+)",$', (finished / "workflow/rules/ingest.smk").read_text(), re.MULTILINE)
    )
    assert declared == {*COLUMNS, "runs"}


def test_no_file_is_written_that_no_rule_declares(finished):
    printed = finished.call("--summary")
    declared = {line.split("\t")[0] for line in printed.splitlines() if "\t" in line}
    written = {
        str(path.relative_to(finished.folder))
        for folder in ("data/processed", "reports")
        for path in (finished / folder).rglob("*")
        if path.is_file() and ".kept" not in path.parts  # hard links to what rules declare
    }
    assert written == {path for path in declared if path.startswith(("data/processed", "reports"))}


def test_it_runs_from_another_folder(checkout, tmp_path):
    snakefile = checkout / "Snakefile"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    arguments = ("--snakefile", str(snakefile), "--directory", str(checkout.folder), "--dry-run")
    assert "Nothing to be done" in checkout.call(*arguments, "--cores", "1", cwd=elsewhere)


def test_a_folder_without_settings_uses_those_of_the_workflow(checkout, tmp_path):
    shutil.copytree(checkout / "data/raw", tmp_path / "lab/data/raw")
    arguments = ("--snakefile", str(checkout / "Snakefile"), "--cores", "1")
    planned = checkout.planned(*arguments, "--directory", str(tmp_path / "lab"))
    assert planned["ingest"] == {"alpha", "beta"}


def test_the_workflow_has_nothing_for_the_linter_to_say(finished):
    assert "good condition" in finished.call("--lint")


def test_reading_the_workflow_imports_nothing_heavy(finished):
    heavy = "{'pandas', 'scipy', 'pyarrow', 'matplotlib'}"
    script = f"import sys, metro.workflow; print(*{heavy} & set(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], env=finished.environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""
