"""What happens when something is wrong: a readable message, and no harm to the rest."""

import json
import os
import signal
import subprocess
import time

import pandas as pd
import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def test_an_invalid_batch_says_why_and_the_others_finish(checkout):
    checkout.add_batch("gamma")
    checkout.add_batch("omega")
    checkout.edit("data/raw/gamma/published.csv", "101.5", "a lot")
    printed = checkout.call(succeeds=False)
    assert "published.csv: row 2" in printed
    assert "column measured" in printed
    assert "a lot" in printed
    assert "Traceback" not in printed
    *_, said, log = (line for line in printed.splitlines() if line)
    assert said.startswith("published.csv: row 2")  # the cause is the last that is said
    assert log == "(logs/ingest/gamma.log)"
    assert "Command '" not in printed
    assert (checkout / "reports/omega/report.pdf").exists()
    assert not (checkout / "data/processed/gamma/batch.json").exists()
    table = pd.read_parquet(checkout / "reports/summary.parquet").set_index("batch")
    assert table.loc["gamma", "status"] == "failed"
    assert "published.csv: row 2" in table.loc["gamma", "error"]
    assert (checkout / "reports/summary.pdf").read_bytes().startswith(b"%PDF")
    assert checkout.planned()["campaign"] == {"all"}
    checkout.edit("data/raw/gamma/published.csv", "a lot", "101.5")
    checkout.call()
    assert "failed" not in set(pd.read_parquet(checkout / "reports/summary.parquet")["status"])
    assert checkout.planned() == {}


def test_a_misspelt_config_key_is_an_error_that_names_the_right_one(checkout):
    checkout.edit("config/config.yaml", "held_out_gain", "held_out_gian")
    printed = checkout.call(succeeds=False)
    assert "config/config.yaml: loop.held_out_gian" in printed
    assert '"held_out_gain"' in printed


def test_a_misspelt_key_on_the_command_line_is_an_error(checkout):
    assert '"raw_roots"' in checkout.call("--config", 'raw_root=["data/raw"]', succeeds=False)


def test_two_batches_of_one_name_are_an_error_that_names_both(checkout, tmp_path):
    checkout.add_batch("alpha", root=tmp_path / "elsewhere")
    roots = f'raw_roots=["data/raw","{tmp_path / "elsewhere"}"]'
    printed = checkout.call("--config", roots, succeeds=False)
    assert "data/raw/alpha" in printed
    assert f"{tmp_path}/elsewhere/alpha" in printed


def test_no_batch_at_all_is_said(checkout):
    checkout.edit("config/config.yaml", "raw_roots: [data/raw]", "raw_roots: [config]")
    assert "config: holds no batch" in checkout.call(succeeds=False)


def test_a_file_name_that_snakemake_cannot_handle_is_named(checkout):
    (checkout / "data/raw/alpha/run{1}.csv").write_text("")
    assert "data/raw/alpha/run{1}.csv" in checkout.call(succeeds=False)


def test_a_stage_refuses_to_run_code_other_than_planned(checkout):
    done = subprocess.run(
        [
            *checkout.metro,
            "predict",
            "--processed",
            "data/processed/alpha",
            "--settings",
            "{}",
            "--code",
            "0" * 64,
        ],
        cwd=checkout.folder,
        env=checkout.environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr == "the code changed since the workflow was planned: call metro run again\n"


def test_a_killed_run_leaves_nothing_half_written_and_the_next_call_finishes(checkout):
    for number in range(2):
        checkout.add_batch(f"extra-{number}")
    head = subprocess.Popen(
        checkout.command(),
        cwd=checkout.folder,
        env=checkout.environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while not list((checkout / "data/processed").glob("extra-*/*")) and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(head.pid, signal.SIGKILL)
    head.wait()
    for file in (checkout / "data/processed").glob("extra-*/[!.]*"):
        content = file.read_bytes()
        if file.suffix == ".parquet":
            assert content[:4] == content[-4:] == b"PAR1", file
        else:
            json.loads(content)
    assert not (checkout / "reports/extra-1/report.pdf").exists()
    checkout.call()
    assert len(list((checkout / "reports").glob("extra-*/report.pdf"))) == 2
    assert checkout.planned() == {}
