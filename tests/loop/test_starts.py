"""Which starts of a new effect are followed to the end, and which are given up."""

import inspect
from dataclasses import replace

import pytest
from toy import BEND, GATES, RIPPLE, Wave, problem

from metro.loop.fitting import fit as fit_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.descent import ITERATIONS
from metro.loop.fitting.fit import FIRST_STEPS, HOPELESS, fit
from metro.loop.fitting.noise import first_noise


def fitted(effect, truth, seed=1):
    """Fits of a batch without and with the effect, the second from the first."""
    task = problem(seed, truth=truth, phased=False)
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    return base, fit(Candidate(task.base, (effect,)), blocks, prior, base)


@pytest.fixture
def longest(monkeypatch):
    """Most steps that any descent of an effect was allowed."""
    allowed, descend = [0], fit_room.descend

    def counted(*arguments, **options):
        bound = inspect.signature(descend).bind(*arguments, **options)
        bound.apply_defaults()
        if bound.arguments["candidate"].effects:
            allowed[0] = max(allowed[0], bound.arguments["steps"])
        return descend(*arguments, **options)

    monkeypatch.setattr(fit_room, "descend", counted)
    return allowed


@pytest.mark.parametrize("seed", range(10, 14))
def test_starts_that_gain_what_chance_does_are_given_up_after_the_first_steps(longest, seed):
    base, larger = fitted(BEND, Wave(), seed)
    assert longest == [FIRST_STEPS]
    assert 2.0 * (larger.total - base.total) < HOPELESS
    assert larger.covariance.shape == (3, 3)


@pytest.mark.parametrize("seed", range(10, 14))
def test_starts_that_gain_more_are_followed_to_the_end(longest, seed):
    base, larger = fitted(BEND, Wave(bend=0.002), seed)
    assert base.noise.misfit["x"] < base.noise.budget  # as little is left as where nothing is hidden
    assert longest == [ITERATIONS]
    assert larger.theta[0] == pytest.approx(0.002, abs=0.001)


def squared(lower):
    """Ripple that is the square of the parameter, whose negative sign a bound may keep from the optimum."""
    parameter = replace(RIPPLE.parameters[0], lower=lower, starts=(-0.19, 0.31))
    return replace(
        RIPPLE,
        parameters=(parameter,),
        apply=lambda model, values: replace(model, ripple=values["ripple"] ** 2),
    )


@pytest.mark.parametrize(
    ("lower", "signs"), [(-2.0, {1}), (-0.3, {-1, 1}), (-0.28, {1})], ids=["alike", "undecided", "decided"]
)
def test_starts_are_followed_that_the_likelihood_leaves_undecided_but_not_the_same_twice(
    monkeypatch, lower, signs
):
    refined, refine = [], fit_room._refined

    def recorded(*arguments, **options):
        found = refine(*arguments, **options)
        if arguments[0].effects and options["rounds"]:  # else it was only looked at
            refined.append(found)
        return found

    monkeypatch.setattr(fit_room, "_refined", recorded)
    _, found = fitted(squared(lower), Wave(ripple=0.1), seed=20)
    assert {round(each.theta[0] / abs(each.theta[0])) for each in refined} == signs
    assert len(refined) == len(signs)
    assert abs(found.theta[0]) == pytest.approx(0.1**0.5, rel=0.05)
    assert found.total == max(each.total for each in refined)
