"""What makes predictions surer: the parameter that brings most of their error, and the runs that lower it."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BETA, GATES, block, problem

from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.planning.experiment import information
from metro.loop.planning.tighten import tighter
from metro.observables.problem import Made, Proposal

NOISY = 0.6  # sd of an element: the parameters are known badly


def noisy(each):
    return replace(each, sigma=np.full(len(each.sigma), NOISY))


def task_and_fit(*, feeds, held, scatter=1e-4):
    task = problem(3, phased=False, feeds=feeds, repeats=1, held=held, scatter=scatter)
    task = replace(task, scatter=np.full(2, scatter), blocks=tuple(map(noisy, task.blocks)))
    # The runs to be predicted are measured well: what is off there is the parameters.
    blocks = tuple(
        each if each.role == "identify" else replace(each, sigma=np.full(len(each.sigma), 0.01))
        for each in task.blocks
    )
    task = replace(task, blocks=blocks)
    prior = first_noise(1e-6, task.scatter, task.role("identify"))
    return task, fit(Candidate(task.base), task.role("identify"), prior)


def proposal(feed):
    made = noisy(block(f"p{feed:g}", feed, "identify", np.random.default_rng(9), phased=False))
    return Proposal(f"feed {feed:g}", (replace(made, condition=f"next {feed:g}"),), (Made("r1"),))


def test_information_is_that_of_the_normal_equations():
    task, fitted = task_and_fit(feeds=(0.3, 0.4), held=(8.0,))
    one = proposal(2.0)
    matrix, _ = task.base.design(one.blocks[0], np.zeros(0))
    expected = 3 * matrix.T @ matrix / NOISY**2
    assert information(fitted, one, 3) == pytest.approx(expected, rel=0.02, abs=0.02 * expected.max())


def test_at_a_large_feed_the_slope_brings_the_error_and_a_run_at_large_feed_lowers_it():
    task, fitted = task_and_fit(feeds=(0.3, 0.4), held=(8.0,))
    found = tighter(task, fitted, [proposal(feed) for feed in (0.2, 0.4, 4.0)], 12)
    assert found.parameter == "a"
    assert found.kind.proposal.words == "feed 4"
    assert found.kind.repeats == 1
    assert found.share > 0.9
    # Brute force: the mean variance of the prediction at feed 8, by hand.
    rows = np.vstack([task.base.design(b, np.zeros(0))[0] for b in task.role("identify")]) / NOISY
    more = np.vstack([rows, task.base.design(proposal(4.0).blocks[0], np.zeros(0))[0] / NOISY])
    there, _ = task.base.design(task.role("validate")[0], np.zeros(0))
    now, then = (np.trace(there @ np.linalg.inv(m.T @ m) @ there.T) for m in (rows, more))
    assert found.left == pytest.approx(then / now, rel=0.5)
    assert found.left < 0.1


def test_where_the_parameters_bring_little_nothing_is_open():
    task = problem(3, phased=False)
    prior = first_noise(GATES.model_form_budget, task.scatter, task.role("identify"))
    fitted = fit(Candidate(task.base), task.role("identify"), prior)
    assert np.allclose(fitted.beta, BETA, rtol=0.02)
    assert tighter(task, fitted, [proposal(4.0)], 12) is None


def test_runs_that_tell_nothing_of_it_are_not_worth_making():
    task, fitted = task_and_fit(feeds=(1.0, 2.0), held=(8.0,))
    assert tighter(task, fitted, [proposal(0.01)], 2) is None
