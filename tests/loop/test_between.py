"""Differences of the base parameters between conditions, against those between repeats."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from toy import BEND, GATES, SCATTER, Wave, problem
from worded import in_words

from metro.loop.checks.between import Between, between_conditions
from metro.loop.checks.signature import share_left
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.fitting.noise import first_noise
from metro.loop.search.search import search
from metro.loop.verdict.verdict import judge


def fitted(task):
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    return fit(Candidate(task.base), blocks, prior)


def scaled(task, feed, factor):
    """The problem with the signal of one condition times a factor: a depth that is not the nominal one."""
    blocks = tuple(
        replace(block, measured=factor * block.measured) if block.setting.feed == feed else block
        for block in task.blocks
    )
    return replace(task, blocks=blocks)


def test_where_conditions_differ_as_repeats_do_the_p_values_are_even():
    found = [between_conditions(fitted(problem(seed, phased=False))).p_value for seed in range(40)]
    assert stats.kstest(found, "uniform").pvalue > 0.01


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_condition_with_another_depth_is_found_with_its_size(factor):
    seen = between_conditions(fitted(scaled(problem(3, scatter=0.002), 2.0, factor)))
    assert seen.p_value < 1e-4
    assert seen.condition == "identify-2"
    # one of four is off by a tenth: the fit takes part of it, spread over the others
    assert 0.02 < seen.relative < 0.06


def test_one_run_of_each_condition_tells_nothing():
    assert between_conditions(fitted(problem(4, repeats=1))) is None


def closed(task):
    outcome = search(task, (BEND,), GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    return in_words(judge(task, outcome, rows, GATES))


def test_what_passes_for_scatter_is_unexplained_where_repeats_do_not_scatter():
    task = problem(5, phased=False, scatter=0.002)
    assert closed(task)["status"] == "clean"
    verdict = closed(scaled(task, 3.0, 1.08))
    assert verdict["status"] == "unexplained"
    assert "differ between the conditions" in verdict["unexplained"]["signature"]
    assert "largest in identify-3" in verdict["unexplained"]["signature"]
    signal = np.sqrt(np.mean([block.measured**2 for block in task.role("validate")]))
    assert verdict["unexplained"]["rms"] == pytest.approx(0.035 * signal, rel=0.3)


def test_runs_that_scatter_by_themselves_are_no_difference_between_conditions():
    task = problem(6, phased=False, scatter=5 * SCATTER)
    assert fitted(task).noise.scatter.max() > 2 * SCATTER
    assert between_conditions(fitted(task)).p_value > 0.01


def test_a_rest_between_conditions_that_an_effect_lays_bare_is_no_evidence_against_it():
    """Of the base model's residual it is no part: misfit within the runs hides it until the effect is in."""
    task = problem(7, truth=Wave(bend=0.08), phased=False, scatter=0.002)
    alone, beside = (search(each, (BEND,), GATES) for each in (task, scaled(task, 3.0, 1.08)))
    assert beside.base_between is None
    assert beside.between is not None
    assert beside.explained == alone.explained > 0.99
    verdict = closed(scaled(task, 3.0, 1.08))
    assert verdict["status"] == "partly_explained"
    assert "differ between the conditions" in verdict["unexplained"]["signature"]


def test_differences_between_conditions_that_stay_are_unexplained():
    """Where the base model shows them, too, an effect that leaves them explains that much less."""
    outcome = search(problem(7, truth=Wave(bend=0.08), phased=False, scatter=0.002), (BEND,), GATES)
    shown = Between(0.03, "identify-3", 1e-6)
    left = replace(outcome, base_between=shown, between=replace(shown, relative=0.05))
    within = share_left(outcome.base_lines) ** 2
    assert left.explained == pytest.approx(within / (within + 0.03**2))
    assert left.probability("bend") == pytest.approx(left.weight["bend"] * left.explained)
