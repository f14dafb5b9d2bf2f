"""Load tests among the conditions left out: what a fit says of one that it has not seen, to first order."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GAIN, GATES, Wave, problem

from metro.loop.checks.evidence import leave_out
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit, score
from metro.loop.fitting.noise import first_noise

TESTS = 5


def posed(seed, truth=None):
    """Fit of the base model, with ``BEND``, to as many cuts as tests that belong to no cut; and the prior."""
    task = problem(
        seed, truth=truth, phased=False, repeats=1, feeds=tuple(np.linspace(1.0, 4.0, 2 * TESTS)), scatter=0.0
    )
    blocks = tuple(
        replace(block, role="calibrate", condition=f"test {i}") if i % 2 else block
        for i, block in enumerate(task.role("identify"))
    )
    return task, blocks, first_noise(GATES.model_form_budget, task.scatter, blocks)


def test_a_test_counts_as_if_the_fit_had_not_seen_it():
    """Against fits that leave out one test each. A test that was seen is likelier."""
    far, seen = [], []
    for seed in range(12):
        task, blocks, prior = posed(seed)
        candidate = Candidate(task.base, (BEND,))
        whole = fit(candidate, blocks, prior)
        counted = leave_out(whole, prior)
        for block in (one for one in blocks if one.role == "calibrate"):
            others = fit(candidate, tuple(one for one in blocks if one is not block), prior)
            exact = score(others, [block]).log_likelihood[block.run]
            far.append(counted[block.condition] - exact)
            seen.append(whole.log_likelihood[block.run] - exact)
    far, seen = (np.reshape(each, (-1, TESTS)).sum(axis=1) for each in (far, seen))
    error = far.std() / np.sqrt(len(far))
    assert abs(far.mean()) < 3.0 * error + 0.1
    assert seen.mean() > 1.2  # three parameters, half of them by the tests, of which each says a fifth


def test_an_effect_that_shows_in_tests_gains_by_them_and_one_that_does_not_gains_nothing():
    task, blocks, prior = posed(3, Wave(bend=0.02))
    blocks = tuple(
        replace(block, measured=straight.measured) if block.role == "identify" else block
        for block, straight in zip(blocks, posed(3)[1], strict=True)
    )
    base = fit(Candidate(task.base), blocks, prior)
    tests = [block.condition for block in blocks if block.role == "calibrate"]

    def gains(effect):
        larger = fit(Candidate(task.base, (effect,)), blocks, prior, base)
        before, after = leave_out(base, prior), leave_out(larger, prior)
        return sum(after[name] - before[name] for name in tests)

    assert gains(BEND) > 3.0
    assert gains(GAIN) == pytest.approx(0.0, abs=1.5)
