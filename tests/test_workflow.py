"""What the Snakefile is told: batches and settings."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from metro.batch.findings import BatchError, ConfigError
from metro.workflow import Plan

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


@given(st.sets(st.text("ab.-+(1", min_size=1, max_size=6), min_size=1, max_size=12), st.text("ab.-+(1"))
def test_names_that_begin_alike_or_hold_signs_of_expressions_are_told_apart(names, other):
    plan = Plan(dict.fromkeys(names), {}, "")
    found = {name for name in {*names, other} if re.fullmatch(plan.any_batch, name)}
    assert found == names
    for name in names:  # as snakemake uses it: within a path
        assert re.fullmatch(f"reports/(?P<batch>{plan.any_batch})/x", f"reports/{name}/x")["batch"] == name


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
