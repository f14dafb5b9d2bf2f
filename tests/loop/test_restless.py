"""Scatter from run to run against the usual one."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from toy import BEND, GATES, SCATTER, problem
from worded import in_words

from metro.loop.checks.restless import restless
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.fitting.noise import first_noise
from metro.loop.search.search import search
from metro.loop.verdict.verdict import judge


def seen(task):
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    return restless(fit(Candidate(task.base), blocks, prior), prior)


def closed(task):
    outcome = search(task, (BEND,), GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    return in_words(judge(task, outcome, rows, GATES))


def drifting(task, per_run):
    """The problem with a signal that grows from run to run, cut in an order that mixes the conditions."""
    blocks = tuple(
        replace(block, measured=(1.0 + per_run * (place - 6)) * block.measured)
        for place, block in enumerate(task.blocks)
    )
    return replace(task, blocks=blocks)


def test_the_usual_scatter_is_one_times_the_usual():
    found = [seen(problem(seed, phased=False)) for seed in range(30)]
    assert np.mean([one.times for one in found]) == pytest.approx(1.0, abs=0.1)
    assert min(one.p_value for one in found) > 0.01


@pytest.mark.parametrize("factor", [5.0, 20.0])
def test_a_larger_scatter_is_found_with_its_size(factor):
    found = [seen(problem(seed, phased=False, scatter=factor * SCATTER)) for seed in range(10)]
    assert np.mean([one.times for one in found]) == pytest.approx(factor * np.sqrt(12 / 16), rel=0.2)
    assert np.mean([one.relative for one in found]) == pytest.approx(factor * SCATTER, rel=0.3)


def test_a_session_that_drifts_while_repeats_are_mixed_is_not_called_clean():
    task = problem(5, phased=False, repeats=2)
    assert closed(task)["status"] == "clean"
    verdict = closed(drifting(task, 0.05))
    assert verdict["status"] == "unexplained"
    assert "times the usual value" in verdict["unexplained"]["signature"]
    assert not verdict["effects"]


@pytest.mark.parametrize("factor", [0.0, 2.0, 5.0])
def test_the_p_value_is_that_of_the_runs_own_scatter_without_what_the_prior_pulled(factor):
    """Twelve runs over what four are worth: the estimate that the p-value stands for is the true ratio."""
    found = [seen(problem(seed, phased=False, scatter=factor * SCATTER)) for seed in range(20)]
    ratio = stats.f.isf([one.p_value for one in found], 12, 4)
    assert np.mean(ratio) == pytest.approx(factor**2, rel=0.15, abs=0.1)
