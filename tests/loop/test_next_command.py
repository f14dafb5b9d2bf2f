"""``metro next``: what is said, and the run table that is written."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest
from test_decide import STOP, Knee
from toy import BEND, GATES, RIPPLE, block, problem
from typer.testing import CliRunner

from metro import cli
from metro.batch.batch import Batch
from metro.batch.columns import RUNS
from metro.batch.runs import filled
from metro.loop.causes.witnesses import Closed
from metro.loop.search.search import search
from metro.observables.problem import Made, Proposal

NAME = "toy-batch"


def faster(feed):
    """A run at another feed than that of r1, whose feed is one."""
    run = block(f"p{feed:g}", feed, "identify", np.random.default_rng(99), condition=f"next-{feed:g}")
    return Proposal(f"feed {feed:g}", (run,), (Made("r1", {"feed_per_tooth_mm": feed}),))


@dataclass
class Closing:
    """What the loop stage knows of a batch, without its files."""

    batch: Batch
    closed: dict
    verdicts: dict
    stories: dict
    gates = GATES


def run_table(task):
    blank = {column.name: np.nan if column.numeric else "" for column in RUNS}
    rows = [
        {**blank, "run": each.run, "role": each.role, "condition": each.condition, "order": each.order}
        | {"operation": "slot", "spindle_rpm": 5000.0, "axial_depth_mm": 1.0, "cut_length_mm": 50.0}
        | {"feed_per_tooth_mm": 0.1 * each.setting.feed, "dynamometer": f"{each.run}.csv"}
        for each in task.blocks
    ]
    return filled(pd.DataFrame(rows), {"tool": {"diameter_mm": 10.0}}).set_index("run")


@pytest.fixture
def ask(monkeypatch, tmp_path):
    """Ask about a batch with one observable: ``ask(task, library, *options)``."""
    monkeypatch.setattr("metro.stages.next_runs._gates", lambda *_: GATES)
    (tmp_path / "reports" / NAME).mkdir(parents=True)
    (tmp_path / NAME).mkdir()
    (tmp_path / NAME / "batch.json").write_text(json.dumps({"manifest": {}}))
    verdict = tmp_path / "reports" / NAME / "verdict.json"
    verdict.write_text(json.dumps({"observables": {"force": {}}}))

    def asked(task, library, *options):
        state = Closing(
            Batch(NAME, {}, {}, run_table(task), {}),
            closed={"force": Closed(task, search(task, library, GATES))},
            verdicts={"force": {}},
            stories={},
        )
        monkeypatch.setattr("metro.stages.next_runs.closed", lambda *_: state)
        folders = ("--processed", str(tmp_path), "--reports", str(tmp_path / "reports"))
        return CliRunner().invoke(cli.app, ["next", NAME, *folders, *map(str, options)])

    return asked


def undecided():
    feasible = tuple(map(faster, (0.5, 4.5, 8.0)))
    return replace(problem(2, truth=Knee(bend=0.2)), base=Knee(), feasible=feasible)


def test_an_undecided_batch_gets_its_runs_as_a_run_table(ask, tmp_path):
    out = tmp_path / "next.csv"
    result = ask(undecided(), (BEND, STOP), "--out", out)
    assert result.exit_code == 0, result.output
    assert "force: feed 8: this distinguishes" in result.output
    assert "more than 0.99" in result.output
    table = pd.read_csv(out)
    assert list(table.columns) == [column.name for column in RUNS]
    assert table["feed_per_tooth_mm"].tolist() == [0.8] * len(table)
    assert table["role"].eq("identify").all()
    assert table["order"].min() == len(undecided().blocks) + 1
    assert table["dynamometer"].isna().all()


def test_limits_keep_the_runs_to_what_the_user_can_set(ask, tmp_path):
    out = tmp_path / "next.csv"
    result = ask(undecided(), (BEND, STOP), "--limit", "feed_per_tooth_mm=:0.5", "--out", out)
    assert result.exit_code == 0, result.output
    assert pd.read_csv(out)["feed_per_tooth_mm"].max() <= 0.5


def test_limits_of_the_manifest_hold_unless_the_call_says_otherwise(ask, tmp_path):
    (tmp_path / NAME / "batch.json").write_text(
        json.dumps({"manifest": {"limits": {"feed_per_tooth_mm": [0.01, 0.5]}}})
    )
    assert "feed 8" not in ask(undecided(), (BEND, STOP)).output
    assert "feed 8" in ask(undecided(), (BEND, STOP), "--limit", "feed_per_tooth_mm=:2").output


def test_where_nothing_is_open_it_says_so_and_writes_nothing(ask, tmp_path):
    out = tmp_path / "next.csv"
    result = ask(replace(problem(5), feasible=(faster(2.0),)), (BEND, RIPPLE), "--out", out)
    assert result.exit_code == 0, result.output
    assert "force: nothing is open" in result.output
    assert not out.exists()


def test_programs_can_read_the_plan(ask):
    plan = json.loads(ask(undecided(), (BEND, STOP), "--json").stdout)
    (question,) = plan["questions"]
    assert question["question"] == "decide"
    assert question["runs"] == len(plan["runs"]) > 0
    assert question["chance"] >= 0.95
    assert plan["runs"][0]["orbit_rpm"] is None


def test_a_file_that_is_there_is_not_overwritten(ask, tmp_path):
    out = tmp_path / "runs.csv"
    out.write_text("mine")
    result = ask(undecided(), (BEND, STOP), "--out", out)
    assert result.exit_code == 1
    assert "is there already" in result.stderr
    assert out.read_text() == "mine"


def test_an_observable_without_a_verdict_is_refused(ask):
    result = ask(undecided(), (BEND, STOP), "--observable", "lobes")
    assert result.exit_code == 1
    assert "found verdicts on force, expected one on lobes" in result.stderr


def test_a_batch_that_has_not_been_through_the_loop_is_refused(tmp_path):
    result = CliRunner().invoke(cli.app, ["next", "none", "--processed", str(tmp_path)])
    assert result.exit_code == 1
    assert "call metro run" in result.stderr
