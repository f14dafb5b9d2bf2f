"""What the Snakefile is told: batches, settings, and that it is alone at work."""

import json
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from metro.batch.findings import BatchError, ConfigError
from metro.workflow import Plan, only_one_at_work, remove_leftovers

ROOT = Path(__file__).parents[1]


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """Return a working folder with two batches and no settings of its own."""
    for name in ("one", "one-more"):
        (tmp_path / "data/raw" / name).mkdir(parents=True)
        (tmp_path / "data/raw" / name / "batch.yaml").write_text(f"batch: {name}\ncell: kr160\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_names_of_the_batches_and_nothing_else_match(lab):
    plan = Plan.read(ROOT, {})
    assert plan.batches == ["one", "one-more"]
    assert [
        name for name in ("one", "one-more", "on", "one-", "two") if re.fullmatch(plan.any_batch, name)
    ] == plan.batches


def test_the_inputs_of_a_batch_are_its_files_and_its_cell(lab):
    plan = Plan.read(ROOT, {})
    inputs = plan.raw_files(SimpleNamespace(batch="one"))
    assert inputs == ["data/raw/one/batch.yaml", str(ROOT / "config/cells/kr160.yaml")]


def test_settings_of_the_working_folder_go_before_those_of_the_checkout(lab):
    text = (ROOT / "config/config.yaml").read_text()
    (lab / "config").mkdir()
    (lab / "config/config.yaml").write_text(re.sub("share: [0-9.]+", "share: 0.25", text))
    assert json.loads(Plan.read(ROOT, {}).settings("ingest")) == {"holdout": {"share": 0.25, "seed": 1}}


def test_a_stage_is_given_the_settings_that_it_reads_and_no_others(lab):
    plan = Plan.read(ROOT, {"holdout": {"share": 0.5, "seed": 7}})
    assert json.loads(plan.settings("ingest")) == {"holdout": {"share": 0.5, "seed": 7}}
    assert json.loads(plan.settings("identify")) == {
        "model_form_budget": plan.config["loop"]["model_form_budget"]
    }
    assert json.loads(plan.settings("loop")) == plan.config["loop"]
    assert json.loads(plan.settings("report")) == {}


def test_a_section_from_the_command_line_replaces_the_whole_section(lab):
    with pytest.raises(ConfigError, match=r"holdout\.seed: is missing"):
        Plan.read(ROOT, {"holdout": {"share": 0.5}})


def test_a_folder_without_batches_is_an_error_that_names_it(lab):
    with pytest.raises(BatchError, match="data: holds no batch"):
        Plan.read(ROOT, {"raw_roots": ["data"]})


def test_a_second_process_cannot_work_in_the_same_folder(tmp_path):
    (tmp_path / ".snakemake").mkdir()
    script = "\n".join(
        [
            "import pathlib, sys, metro.workflow",
            "metro.workflow.only_one_at_work(pathlib.Path(sys.argv[1]))",
            "print('in', flush=True)",
            "input()",
        ]
    )
    first = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert first.stdout.readline() == b"in\n"
    with pytest.raises(RuntimeError, match="another snakemake is at work"):
        only_one_at_work(tmp_path)
    first.kill()
    first.communicate()
    only_one_at_work(tmp_path)


def test_leftovers_of_killed_jobs_go_and_everything_else_stays(tmp_path):
    from metro.batch.processed import write_atomically

    def killed(stream):
        stream.write(b"half")
        raise KeyboardInterrupt

    (tmp_path / "a/.scan.k2x_8dq0").mkdir(parents=True)
    (tmp_path / "a/.force.parquet.abcd1234").write_text("")
    for name in (".gitkeep", "a/force.parquet", "a/.hidden.txt", "a/x.abcdefgh"):
        (tmp_path / name).write_text("")
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a/new.json", killed)
    remove_leftovers(tmp_path, tmp_path / "not-there")
    left = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    assert left == [".gitkeep", "a/.hidden.txt", "a/force.parquet", "a/x.abcdefgh"]
    assert not (tmp_path / "a/.scan.k2x_8dq0").exists()
