"""An effect whose own interval holds none of it is not claimed, whatever the likelihoods say."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GATES, RIPPLE, Wave, problem

from metro.loop.checks.evidence import Evidence
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search import forward
from metro.loop.search.search import search
from metro.loop.search.significance import least_significant


@pytest.fixture(scope="module")
def bent():
    task = problem(9, truth=Wave(bend=0.2), phased=False)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    return fit(Candidate(task.base, (BEND, RIPPLE)), blocks, prior)


def test_of_what_is_there_and_what_is_not_the_latter_is_least_significant(bent):
    effect, p_value = least_significant(bent)
    assert effect is RIPPLE
    assert p_value > 0.05
    alone = fit(Candidate(bent.candidate.base, (BEND,)), bent.blocks, bent.noise)
    assert least_significant(alone)[1] < 1e-4


def test_the_p_value_is_that_of_the_interval(bent):
    """Of one parameter F is the square of Student's t: at the end of a 95 % interval p is 0.05."""
    from scipy.stats import t

    alone = fit(Candidate(bent.candidate.base, (BEND,)), bent.blocks, bent.noise)
    half = t.ppf(0.975, len(alone.blocks) - 1) * np.sqrt(alone.covariance[-1, -1] * alone.dispersion)
    at_the_end = replace(alone, theta=np.array([BEND.parameters[0].neutral + half]))
    assert least_significant(at_the_end)[1] == pytest.approx(0.05)


def test_what_may_be_so_without_the_effect_is_no_part_of_its_size(bent):
    """Six deviations beside a neutral value known within three are 6/√10 of Student's t."""
    from scipy.stats import t

    alone = fit(Candidate(bent.candidate.base, (BEND,)), bent.blocks, bent.noise)
    sd, dof = float(np.sqrt(alone.covariance[-1, -1] * alone.dispersion)), len(alone.blocks) - 1
    unsure = replace(BEND, parameters=(replace(BEND.parameters[0], neutral_sd=3.0 * sd),))
    far = replace(
        alone,
        candidate=Candidate(bent.candidate.base, (unsure,)),
        theta=np.array([BEND.parameters[0].neutral + 6.0 * sd]),
    )
    assert least_significant(far)[1] == pytest.approx(2.0 * t.sf(6.0 / np.sqrt(10.0), dof))


def test_what_is_significant_stays_and_what_is_not_goes(monkeypatch):
    task = problem(9, truth=Wave(bend=0.2), phased=False)
    assert search(task, (BEND, RIPPLE), GATES).names == ("bend",)
    monkeypatch.setattr(forward, "SIGNIFICANT", 0.0)
    assert search(task, (BEND, RIPPLE), GATES).names == ("bend",)  # it moves the prediction by much
    monkeypatch.setattr(forward, "WORST", np.inf)
    assert search(task, (BEND, RIPPLE), GATES).names == ("bend",)
    monkeypatch.setattr(forward, "MUCH", np.inf)
    found = search(task, (BEND, RIPPLE), GATES)
    assert found.names == ()
    assert {one.effect.name: one.why_not and one.why_not.code for one in found.trials}[
        "bend"
    ] == "holds_nothing"


@pytest.mark.parametrize(
    ("moved", "missed", "budget", "stays"),
    [
        (0.05, 0.022, 0.007, True),  # √(2.2² + 0.7²) % = 2.3 %: twice that is 4.6 %
        (0.045, 0.022, 0.007, False),
        (0.015, 0.0, 0.007, True),
        (0.013, 0.0, 0.007, False),  # what no model gets right may make 1.4 %
        (0.11, 0.1, 0.007, True),  # much, and more than all that is missed
        (0.11, 0.12, 0.007, False),
    ],
)
def test_an_effect_stays_that_all_that_is_missed_could_not_make(moved, missed, budget, stays):
    """By what it moves: what it spares the base parameters moves no prediction."""
    evidence = Evidence(0.0, 0.0, {}, moved, 0.5, missed)
    assert forward._exceeds_all_missed(evidence, budget) == stays


@pytest.mark.parametrize(
    ("stiffness", "deviation", "least", "most"), [(20, 10, 0.05, 0.15), (100, 100, 0.5, 1.0)]
)
def test_the_size_of_a_stiffness_is_its_compliance(bent, stiffness, deviation, least, most):
    """Of 20 ± 10 N/µm the compliance is 0.05 ± 0.025: little, although 20 is 18 deviations from 200."""
    parameter = replace(BEND.parameters[0], lower=0.8, upper=200.0, neutral=200.0, reciprocal=True)
    alone = fit(Candidate(bent.candidate.base, (BEND,)), bent.blocks, bent.noise)
    candidate = replace(alone.candidate, effects=(replace(BEND, parameters=(parameter,)),))
    covariance = alone.covariance.copy()
    covariance[-1, -1] = deviation**2 / alone.dispersion
    there = replace(alone, candidate=candidate, theta=np.array([float(stiffness)]), covariance=covariance)
    assert least < least_significant(there)[1] < most
