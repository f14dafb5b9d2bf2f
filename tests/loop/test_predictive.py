"""The likelihood of unseen runs against a dense Gaussian, Monte Carlo and quadrature."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp
from toy import BEND, GATES, RIPPLE, Wave, block, problem

from metro.loop.checks.evidence import leave_out
from metro.loop.checks.evidence import missed as missed_by
from metro.loop.checks.left_out import most_missed
from metro.loop.checks.predictive import estimated, predictive
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit, refit, score
from metro.loop.fitting.noise import first_noise


def fitted(task, effects=()):
    blocks = task.role("identify")
    noise = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, noise)
    found = fit(Candidate(task.base, effects), blocks, noise, base) if effects else base
    return replace(found, noise=replace(found.noise, misfit={}))


def test_of_a_linear_model_it_is_the_gaussian_with_the_errors_of_the_parameters():
    task = problem(3, phased=False, feeds=(1.0, 1.5), repeats=1)
    found, held = fitted(task), task.role("validate")
    whole = found.covariance * found.dispersion
    expected, rows, measured, noises, constant = [], [], [], [], 0.0
    for one in held:
        matrix, _ = task.base.design(one, np.zeros(0))
        shared = noise_room.shared(one, found.noise, matrix, found.beta)
        alone = noise_room.diagonal(one, found.noise)
        noises.append(np.diag(alone) + shared @ shared.T)
        rows.append(matrix)
        measured.append(one.measured)
        constant += 0.5 * np.sum(np.log(2 * np.pi * alone) + 1.0)
    design = np.vstack(rows)
    noise = np.zeros((len(design),) * 2)
    noise[:24, :24], noise[24:, 24:] = noises
    expected = stats.multivariate_normal(design @ found.beta, noise + design @ whole @ design.T)
    plain = score(found, held).total
    told = predictive(found, held)
    assert told == pytest.approx(expected.logpdf(np.concatenate(measured)) + constant, abs=0.05)
    assert abs(told - plain) > 0.3  # what the parameters leave open counts here


def test_with_an_effect_it_is_the_likelihood_averaged_over_the_parameters():
    task = problem(5, truth=Wave(ripple=0.05), phased=False, feeds=(1.0, 2.0), repeats=2)
    found, held = fitted(task, (RIPPLE,)), task.role("validate")
    known = estimated(found)
    rng = np.random.default_rng(1)
    drawn = rng.multivariate_normal(known.mean, np.linalg.inv(known.precision), size=4000)
    totals = [score(replace(found, beta=one[:2], theta=one[2:]), held).total for one in drawn]
    assert predictive(found, held) == pytest.approx(logsumexp(totals) - np.log(len(totals)), abs=0.1)


def test_an_effect_that_the_fit_has_not_seen_may_be_anywhere_in_its_bounds():
    rng = np.random.default_rng(7)
    task = problem(7, phased=False, feeds=(1.0, 2.0), repeats=3)
    blocks = task.role("identify")
    noise = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, noise)
    found = fit(Candidate(task.base, (BEND,)), blocks, noise, base)
    found = replace(found, covariance=np.diag([0.0, 0.0, np.inf]))  # the base parameters stay
    held = [block("v", 2.5, "validate", rng, truth=Wave(bend=0.3), phased=False, scatter=0.0)]
    places = np.linspace(-2.0, 2.0, 40_001)
    step = places[1] - places[0]
    totals = [score(replace(found, theta=np.array([place])), held).total for place in places[22_000:24_000]]
    averaged = logsumexp(totals) + np.log(step / 4.0)
    # A normal of the variance of the bounds stands for them: at its middle it is denser by (6/π)^½.
    assert predictive(found, held) == pytest.approx(averaged, abs=np.log(2.0))
    assert predictive(found, held) > score(found, held).total + 100.0


def test_what_a_model_misses_in_the_condition_left_out_alone_is_known_there_too():
    """A gap closes in one pose: that the model lacks it is no news about an effect of another kind."""
    task, rng = problem(3, phased=False, feeds=(1.0, 2.0, 3.0), repeats=2), np.random.default_rng(3)
    missed = [
        block(f"s{i}", 4.0, "identify", rng, truth=Wave(spike=0.3), phased=False, order=20 + i)
        for i in range(2)
    ]
    task = replace(task, blocks=(*task.blocks, *missed))
    blocks = task.role("identify")
    noise = first_noise(GATES.model_form_budget, task.scatter, blocks)
    found = fit(Candidate(task.base), blocks, noise)
    others = refit(found, [one for one in blocks if one not in missed], noise)
    known = most_missed(others, found.noise)
    assert missed_by(known) > 2.0 * missed_by(others)
    (name,) = {one.condition for one in missed}
    assert leave_out(found, noise)[name] == pytest.approx(predictive(known, missed))
    assert leave_out(found, noise)[name] > predictive(others, missed) + 10.0
