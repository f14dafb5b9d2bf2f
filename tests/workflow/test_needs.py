"""What jobs ask of a scheduler: more for more data, and more at each further attempt."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from metro.workflow import NEEDS, Plan

ROOT = Path(__file__).parents[2]
ALPHA, ALL = SimpleNamespace(batch="alpha"), SimpleNamespace()


@pytest.fixture
def plan(tmp_path, monkeypatch):
    for name, size in (("alpha", 3_000_000), ("beta", 10)):
        folder = tmp_path / "data/raw" / name
        folder.mkdir(parents=True)
        (folder / "batch.yaml").write_text(f"batch: {name}\ncell: none\n")
        (folder / "record.bin").write_bytes(bytes(size))
    monkeypatch.chdir(tmp_path)
    return Plan.read(ROOT, {})


def test_a_job_asks_for_more_where_its_batch_is_larger(plan):
    base, each = NEEDS["ingest"][:2]
    assert plan.memory("ingest")(ALPHA, 1) == pytest.approx(base + 3 * each, abs=1.0)
    assert plan.memory("ingest")(SimpleNamespace(batch="beta"), 1) == pytest.approx(base, abs=1.0)
    assert (
        plan.minutes("identify")(ALPHA, 1) >= NEEDS["identify"].minutes + 3 * NEEDS["identify"].minutes_each
    )


def test_the_summary_asks_by_the_number_of_batches(plan):
    need = NEEDS["campaign"]
    assert plan.memory("campaign")(ALL, 1) == need.memory_mb + 2 * need.memory_mb_each


@pytest.mark.parametrize("stage", NEEDS)
def test_a_further_attempt_asks_for_more_of_everything(plan, stage):
    for asked in (plan.memory(stage), plan.minutes(stage)):
        assert asked(ALPHA, 3) >= 3 * asked(ALPHA, 1) - 3
        assert asked(ALPHA, 1) > 0


def test_every_rule_says_what_it_needs():
    rules = {path.stem: path.read_text() for path in (ROOT / "workflow/rules").glob("*.smk")}
    assert set(rules) == set(NEEDS)
    for stage, text in rules.items():
        assert f'mem_mb=plan.memory("{stage}")' in text
        assert f'runtime=plan.minutes("{stage}")' in text
