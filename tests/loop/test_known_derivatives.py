"""Derivatives that are known beforehand serve a descent on its way, and do not decide where it ends."""

import numpy as np
import pytest
from toy import BEND, GATES, RIPPLE, Wave, problem

from metro.loop.fitting import descent as room
from metro.loop.fitting import reestimate
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.descent import descend
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import alike, first_noise
from metro.loop.fitting.system import State, effect_slopes, linearised


@pytest.fixture
def both():
    """The fit with the first effect, and a state with the second one at a start, far from its end."""
    task = problem(3, truth=Wave(bend=0.2, ripple=0.3))
    blocks = task.role("identify")
    base = fit(Candidate(task.base), blocks, first_noise(GATES.model_form_budget, task.scatter, blocks))
    one = fit(Candidate(task.base, (BEND,)), blocks, base.noise, base)
    state = State(np.append(one.theta, 0.1), one.beta.copy(), dict(one.nuisance))
    return one, Candidate(task.base, (BEND, RIPPLE)), state


def test_they_take_the_place_of_the_first_columns_and_no_other(both):
    one, candidate, state = both
    known = effect_slopes(one.candidate, one.blocks, State(one.theta, one.beta, dict(one.nuisance)))
    marked = [np.full_like(columns, 7.0) for columns in known]
    plain = linearised(candidate, one.blocks, one.noise, state)
    given = linearised(candidate, one.blocks, one.noise, state, slopes=marked)
    for (rest, base, effect, own), row, whiten in zip(plain.rows, given.rows, given.whiteners, strict=True):
        assert row[2][:, 0] == pytest.approx(whiten(np.full(len(rest), 7.0)))
        assert row[2][:, 1] == pytest.approx(effect[:, 1])
        assert (row[1] == base).all()
        assert (row[3] == own).all()


def test_a_descent_from_wrong_ones_ends_where_it_ends_without(both):
    one, candidate, state = both
    right = descend(candidate, one.blocks, one.noise, state)
    for factor in (0.3, 1.0, 3.0):
        wrong = [factor * columns for columns in effect_slopes(one.candidate, one.blocks, state_of(one))]
        found = descend(candidate, one.blocks, one.noise, state, slopes=wrong)
        assert found[1] == pytest.approx(right[1], abs=0.05)
        assert found[0].theta == pytest.approx(right[0].theta, abs=1e-3)


def state_of(fitted):
    return State(fitted.theta, fitted.beta, dict(fitted.nuisance))


def test_they_are_computed_for_the_new_effect_alone_on_the_way(both, monkeypatch):
    one, candidate, state = both
    asked, ask = [], room.linearised

    def counted(*arguments, **options):
        asked.append(options.get("slopes") is not None)
        return ask(*arguments, **options)

    monkeypatch.setattr(room, "linearised", counted)
    known = effect_slopes(one.candidate, one.blocks, state_of(one))
    descend(candidate, one.blocks, one.noise, state, slopes=known)
    assert asked[0]
    assert not asked[-1]  # what ends the descent is known anew


def test_the_noise_is_estimated_until_it_stays(monkeypatch):
    task = problem(4, truth=Wave(ripple=0.3))
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    fitted = fit(Candidate(task.base), blocks, prior)
    steps, step = [], reestimate.updated

    def counted(*arguments):
        steps.append(step(*arguments))
        return steps[-1]

    monkeypatch.setattr(reestimate, "updated", counted)
    first = reestimate.reestimated(fitted.candidate, blocks, prior, prior, state_of(fitted))
    for _ in range(6):
        first = reestimate.reestimated(fitted.candidate, blocks, prior, first, state_of(fitted))
    steps.clear()
    again = reestimate.reestimated(fitted.candidate, blocks, prior, first, state_of(fitted))
    assert len(steps) < 2 * reestimate.EM_STEPS
    assert alike(first, again)
    assert not alike(prior, again)
