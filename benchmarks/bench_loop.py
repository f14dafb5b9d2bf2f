"""Closing the loop on a force batch: the time of the search, and how it grows with runs and candidates.

From the order averages to the verdict: all effects of the library tried, conditions left out, rivals fitted.
The batch hides runout. Run: ``pytest benchmarks/bench_loop.py -o python_files='bench_*.py' -s``.
"""

import math
import time
from dataclasses import replace

import pytest

from metro.batch.processed import Processed, read_batch
from metro.effects.library import library
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.verdict import judge
from metro.observables.force import observable as force
from metro.stages.ingest import ingest
from virtual_cell.recipes import force as recipe

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
HIDDEN = {"tool_runout": {"radius_um": 9.0, "angle_deg": 40.0}}
FEW = ("charge_drift", "tool_runout", "tool_wear")
PLANS = recipe._plans


def task_of(folder, repeats, held):
    """A batch of six conditions to identify on and four held out, so often each."""

    def plans(*arguments):
        return tuple(
            replace(plan, replicates=repeats if plan.role == "identify" else held)
            for plan in PLANS(*arguments)
        )

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recipe, "_plans", plans)
        recipe.make(folder / "blind-test", HIDDEN, 3)
    ingest(folder / "blind-test", folder, folder / "out", {}, "test")
    batch = read_batch(folder / "out")
    observed = force.observe(batch, Processed(folder / "out"), {})
    return force.problem(batch, observed, {})


def closed(task, effects):
    """CPU seconds, and the verdict."""
    start = time.process_time()
    outcome = search(task, effects, GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    verdict = judge(task, outcome, rows, GATES)
    return time.process_time() - start, verdict


def test_the_loop_of_36_runs_with_all_candidates_takes_less_than_a_minute(tmp_path):
    effects = library("force")
    times = {}
    for repeats, held in ((2, 1), (4, 3), (8, 6)):
        task = task_of(tmp_path / f"{repeats}", repeats, held)
        times[len(task.blocks)], verdict = closed(task, effects)
        assert [entry["effect"] for entry in verdict["effects"]] == ["tool_runout"]
        if len(task.blocks) == 36:
            few, _ = closed(task, [effect for effect in effects if effect.name in FEW])
    (first, *_, last), names = sorted(times), {effect.name for effect in effects}
    growth = math.log(times[last] / times[first]) / math.log(last / first)
    print(
        ", ".join(f"{runs} runs: {spent:.1f} s" for runs, spent in times.items()), f"(exponent {growth:.2f})"
    )
    print(f"36 runs: {len(FEW)} effects {few:.1f} s, all {len(names)} {times[36]:.1f} s")
    assert times[36] < 60.0
    assert growth < 1.2
    assert times[36] / few < 1.5 * len(names) / len(FEW)
