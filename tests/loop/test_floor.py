"""Errors on left-out conditions against the floor: what is missing is seen, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from toy import BEND, GATES, SIGMA, Wave, problem

from metro.loop.checks.evidence import missed
from metro.loop.checks.floor import ABOVE, AgainstFloor, against_floor
from metro.loop.checks.left_out import left_out, parameter_errors, unseen
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit, score
from metro.loop.fitting.noise import first_noise


def fitted(task, *effects):
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    return (fit(Candidate(task.base, effects), blocks, prior, base) if effects else base), prior


def ratio(seed, **truth):
    return against_floor(unseen(*fitted(problem(seed, truth=Wave(**truth), phased=False))))


def test_where_nothing_is_missing_the_error_is_the_floor_and_no_p_value_alarms_too_often():
    """The noise is estimated from the same runs: the ratio scatters less than that of strangers."""
    found = [ratio(seed) for seed in range(60)]
    assert np.median([one.ratio for one in found]) == pytest.approx(1.0, abs=0.1)
    p_values = np.array([one.p_value for one in found])
    for level in (0.01, 0.05, 0.2):
        assert np.sum(p_values < level) <= stats.binom.ppf(0.999, len(found), level)
    assert np.median(p_values) == pytest.approx(0.5, abs=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_missing_is_seen_and_as_large_as_it_is(seed):
    found = ratio(seed, spike=0.05)
    assert found.p_value < ABOVE
    assert found.ratio > 1.5
    share = (
        0.05
        * 8.0
        / np.sqrt(2)
        / np.sqrt(np.mean([b.measured @ b.measured / 24 for b in problem(seed).blocks]))
    )
    assert found.relative == pytest.approx(share, rel=0.4)


def test_without_runs_there_is_nothing_to_compare():
    assert against_floor(()) is None


def test_what_a_model_misses_does_not_excuse_its_errors():
    """A model that misses much is fitted with a misfit: its parameters are no less certain for that."""
    task = problem(4, truth=Wave(spike=0.5), phased=False)
    whole, prior = fitted(task)
    assert missed(whole) > 0.1
    for one in unseen(whole, prior):
        assert np.all(np.diag(one.covariance)[:2] <= np.diag(whole.covariance)[:2] * 2.0)
        assert one.nuisance.keys() == {block.run for block in one.blocks}


def test_errors_of_parameters_are_those_of_a_linear_model():
    whole, prior = fitted(problem(6, phased=False), BEND)
    (one, *_) = unseen(whole, prior)
    block = one.blocks[0]
    directions = parameter_errors(one, block)
    model = one.candidate.model(one.theta)
    matrix, _ = model.design(block, np.zeros(0))
    bend = block.setting.feed * one.beta[0] * np.cos(3 * np.radians(block.coordinates["angle_deg"]))
    columns = np.column_stack([matrix, bend])
    expected = columns @ one.covariance @ columns.T
    np.testing.assert_allclose(directions @ directions.T, expected, atol=0.02 * np.abs(expected).max())


def test_each_condition_is_left_out_once_and_no_fit_has_seen_what_it_is_scored_on():
    whole, prior = fitted(problem(7, phased=False))
    parts = [part for each in left_out(whole, prior).values() for part in each]
    assert sorted(b.run for part in parts for b in part.blocks) == sorted(b.run for b in whole.blocks)
    for part in parts:
        assert not {b.run for b in part.blocks} & {b.run for b in part.others.blocks}
        assert len({b.condition for b in part.blocks}) == 1


def test_one_condition_is_left_out_run_by_run_and_one_run_not_at_all():
    whole, prior = fitted(problem(8, phased=False, feeds=(2.0,)))
    assert [len(parts) for parts in left_out(whole, prior).values()] == [1, 1, 1]
    alone = replace(whole, blocks=whole.blocks[:1])
    assert list(left_out(alone, prior).values()) == [()]
    assert SIGMA > 0


def test_the_noise_is_scaled_by_what_left_out_conditions_show_of_it_and_not_by_what_is_missing():
    few, many = (AgainstFloor(0.5, freedom, 0.9, 0.0, "c") for freedom in (1.0, 400.0))
    assert few.scale == pytest.approx(np.sqrt((4 + 0.25) / 5))  # the declared noise is worth four values
    assert many.scale == pytest.approx(0.5, abs=0.01)
    assert AgainstFloor(1.0, 9.0, 0.4, 0.0, "c").scale == 1.0
    assert AgainstFloor(4.0, 9.0, ABOVE / 2, 0.1, "c").scale == 1.0


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_floor_that_is_declared_wrong_comes_out_right_on_the_runs_that_verify(factor):
    """The noise of every sample is that many times as large as declared."""
    over = []
    for seed in range(12):
        task = problem(seed, phased=False)
        whole, prior = fitted(replace(task, blocks=tuple(wrongly_declared(b, factor) for b in task.blocks)))
        error = against_floor(unseen(whole, prior))
        held = tuple(wrongly_declared(b, factor) for b in task.role("validate"))
        found = against_floor([score(whole, (block,)) for block in held])
        over.append(found.ratio / error.scale)
    assert np.median(over) == pytest.approx(1.0, abs=0.2)


def wrongly_declared(block, factor):
    """The block with a declared noise that is ``factor`` times too small."""
    return replace(block, sigma=block.sigma / factor)
