"""In a contest, the model without an effect: nothing is left out of it where that could decide nothing."""

import numpy as np
import pytest
from toy import BEND, GAIN, GATES, RIPPLE, Wave, problem

from metro.loop.checks.evidence import by_condition, leave_out, most_left_out, weights
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search import rivals

CLEAR, FAINT = 0.4, 0.001  # sizes of an effect: the model without it is hopeless, and is nearly as good


def fits(ripple, effects):
    """Fits of the runs of a wave with this ripple: of the model with none of the effects, and with each."""
    task = problem(11, truth=Wave(ripple=ripple), phased=False, repeats=2)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    smaller = fit(Candidate(task.base), blocks, prior)
    return smaller, [fit(Candidate(task.base, (one,)), blocks, prior, smaller) for one in effects], prior


def shares(smaller, others, prior, monkeypatch):
    """Weights in the contest, and the fits that conditions were left out of."""
    asked = []
    monkeypatch.setattr(rivals, "leave_out", lambda one, noise: asked.append(one) or leave_out(one, noise))
    return rivals._shares(smaller, others, [1.0] * (1 + len(others)), prior, GATES), asked


@pytest.mark.parametrize(("ripple", "hopeless"), [(CLEAR, True), (FAINT, False)])
def test_conditions_are_left_out_of_the_smaller_model_only_where_its_weight_could_count(
    ripple, hopeless, monkeypatch
):
    smaller, others, prior = fits(ripple, [RIPPLE, BEND, GAIN])
    found, asked = shares(smaller, others, prior, monkeypatch)
    assert (smaller in asked) is not hopeless
    assert all(one in asked for one in others)
    known = [leave_out(one, prior) for one in (smaller, *others)]
    within = [by_condition(one) for one in (smaller, *others)]
    whole = np.mean([weights(each, GATES.seed, prior=[1.0] * 4) for each in (known, within)], axis=0)[1:]
    np.testing.assert_allclose(found, whole, atol=rivals.NEGLIGIBLE)


@pytest.mark.parametrize("ripple", [CLEAR, FAINT])
def test_a_model_describes_what_it_has_seen_no_worse_than_it_predicts_what_is_left_out(ripple):
    smaller, _, prior = fits(ripple, [])
    left_out = leave_out(smaller, prior)
    seen = most_left_out(smaller, left_out)
    assert seen.keys() == left_out.keys()
    assert sum(seen.values()) >= sum(left_out.values())
