"""Fits that gain no more than chance does are not followed to their end."""

from dataclasses import replace

import pytest
from scipy.stats import chi2
from toy import BEND, RIPPLE, Wave, problem

from metro.loop.fitting import fit as fitting
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.noise import first_noise, within_budget


@pytest.fixture
def descents(monkeypatch):
    """The most steps that each descent was allowed."""
    allowed = []
    descend = fitting.descend

    def counted(candidate, blocks, noise, state, steps=fitting.ITERATIONS, **options):
        allowed.append(steps)
        return descend(candidate, blocks, noise, state, steps, **options)

    monkeypatch.setattr(fitting, "descend", counted)
    return allowed


def started(truth, effect, budget=0.002):
    """Return candidate, blocks and prior of an effect, and the fit without it."""
    task = problem(6, truth=truth)
    blocks = task.role("identify")
    prior = first_noise(budget, task.scatter, blocks)
    base = fitting.fit(Candidate(task.base, ()), tuple(blocks), prior)
    return Candidate(task.base, (effect,)), tuple(blocks), prior, base


@pytest.mark.parametrize("count", [1, 3, 7])
def test_chance_gains_the_mean_of_one_place_and_of_many_what_the_best_exceeds_more_often_than_not(count):
    candidate, *_ = started(Wave(), BEND)
    sought = replace(candidate, effects=(replace(BEND, sought=1000.0),))
    assert fitting._by_chance(candidate, count) == count
    assert fitting._by_chance(sought, count) == pytest.approx(chi2.isf(1e-3, count))
    assert 1.0 - chi2.cdf(fitting._by_chance(sought, count), count) ** 1000 > 0.5


@pytest.mark.parametrize(("sought", "followed"), [(1.0, True), (1e9, False)])
def test_what_one_place_gains_is_followed_and_the_best_of_many_is_not_where_chance_gains_it(
    descents, sought, followed
):
    candidate, blocks, prior, base = started(Wave(bend=0.02), replace(BEND, sought=sought), budget=0.03)
    assert within_budget(blocks, base.noise)
    descents.clear()
    found = fitting.fit(candidate, blocks, prior, base)
    assert 1.0 < 2.0 * (found.total - base.total) < chi2.isf(1e-9, 1)
    assert (fitting.ITERATIONS in descents) is followed


@pytest.mark.parametrize(("ripple", "followed"), [(0.0, False), (0.4, True)])
def test_beside_a_large_residual_a_gain_counts_by_the_noise_that_the_fit_itself_leaves(
    descents, ripple, followed
):
    candidate, blocks, prior, base = started(Wave(spike=0.4, ripple=ripple), replace(RIPPLE, sought=1000.0))
    assert not within_budget(blocks, base.noise)
    descents.clear()
    fitting.fit(candidate, blocks, prior, base)
    assert (fitting.ITERATIONS in descents) is followed


def test_what_ends_above_the_simpler_model_is_not_refined(monkeypatch):
    """An effect that is never off, and is not there: each round would estimate the noise anew."""
    (ripple,) = RIPPLE.parameters
    never_off = replace(RIPPLE, parameters=(replace(ripple, lower=0.5, starts=(0.6, 0.9)),))
    candidate, blocks, prior, base = started(Wave(spike=0.4), never_off)
    assert not within_budget(blocks, base.noise)
    estimates = []
    estimate = fitting._reestimated
    monkeypatch.setattr(fitting, "_reestimated", lambda *given: estimates.append(1) or estimate(*given))
    found = fitting.fit(candidate, blocks, prior, base)
    assert found.theta == pytest.approx([0.5])
    assert found.total < base.total
    assert len(estimates) == 1
