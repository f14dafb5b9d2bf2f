"""A model is at least as likely as one that it contains, or it is fitted again."""

from dataclasses import replace

import pytest
from toy import BEND, GATES, RIPPLE, Wave, problem

from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search.trial import parted


def fitted(truth, seed, *effects):
    """Fit of the base model, and of each effect on it."""
    task = problem(seed, truth=truth, phased=False)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    return prior, base, [fit(Candidate(task.base, (one,)), blocks, prior, base) for one in effects]


def test_a_model_less_likely_than_one_it_contains_is_fitted_again_from_there():
    prior, base, (larger, other) = fitted(Wave(bend=0.1), 3, BEND, RIPPLE)
    both = fit(Candidate(base.candidate.base, (BEND, RIPPLE)), base.blocks, prior, larger)
    astray = replace(both, theta=both.theta + 1.0, log_likelihood={"all": other.total - 1.0})
    smaller, again = parted(base, astray, BEND, prior)
    assert smaller.candidate.effects == (RIPPLE,)
    assert smaller.total > astray.total
    assert again.total == pytest.approx(both.total, abs=0.1)
    assert set(again.candidate.effects) == {BEND, RIPPLE}


def test_a_model_more_likely_than_what_it_contains_stays_as_it_is():
    prior, base, (larger,) = fitted(Wave(bend=0.1), 3, BEND)
    assert parted(base, larger, BEND, prior) == (base, larger)
