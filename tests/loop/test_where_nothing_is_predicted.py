"""A search does not go where a model predicts nothing, and does not begin there."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from toy import BEND, GATES, Wave, problem

from metro.loop.fitting.candidate import Candidate, predicting, unpredicted
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise

TRUTH, LIMIT = 0.2, 0.15


@dataclass(frozen=True)
class Soft(Wave):
    """A wave without a prediction where it is bent by more than ``LIMIT``."""

    def beyond(self, _block, _beta):
        return "it snaps" if self.bend > LIMIT else ""


@pytest.fixture
def soft():
    task = problem(3, truth=Wave(bend=TRUTH), phased=False)
    return replace(task, base=Soft(**vars(task.base)))


def bent(task, start):
    """The fit of a bend that begins at ``start``."""
    effect = replace(BEND, parameters=tuple(replace(p, starts=(start,)) for p in BEND.parameters))
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    return fit(Candidate(task.base, (effect,)), blocks, prior, base)


@pytest.mark.parametrize("start", [0.01, 0.14, 0.6])
def test_a_fit_ends_on_the_side_where_it_predicts(soft, start):
    found = bent(soft, start)
    assert 0.5 * LIMIT < found.theta[0] <= LIMIT
    model = found.candidate.model(found.theta)
    assert not any(unpredicted(model, block, found.beta) for block in found.blocks)


def test_without_a_limit_it_ends_at_the_truth(soft):
    free = replace(soft, base=Wave(**vars(soft.base)))
    assert bent(free, 0.6).theta[0] == pytest.approx(TRUTH, rel=0.05)


def test_effects_are_eased_from_the_first_new_parameter_on(soft):
    blocks, beta = soft.role("identify"), np.ones(2)
    candidate = Candidate(soft.base, (BEND,))
    assert predicting(candidate, blocks, np.array([0.6]), beta, 0) == pytest.approx([0.15])
    assert predicting(candidate, blocks, np.array([0.1]), beta, 0) == pytest.approx([0.1])
    known = predicting(candidate, blocks, np.array([0.6]), beta, 1)  # nothing is new
    assert known == pytest.approx([0.6])


def test_what_acts_by_its_reciprocal_is_eased_by_that(soft):
    (bend,) = BEND.parameters
    spring = replace(bend, reciprocal=True, neutral=200.0, lower=0.01, upper=200.0)
    effect = replace(BEND, parameters=(spring,), apply=lambda m, v: replace(m, bend=1.0 / v[bend.name]))
    eased = predicting(Candidate(soft.base, (effect,)), soft.role("identify"), np.array([4.0]), np.ones(2), 0)
    assert 1.0 / eased[0] - 1.0 / 200.0 == pytest.approx(0.5 * (1.0 / 4.0 - 1.0 / 200.0))
