"""Effects that are far behind are not followed: neither when they are tried, nor as rivals."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GAIN, GATES, RIPPLE, TWIN, Wave, problem

from metro.loop.fitting import fit as fit_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Race, cost_under, fit
from metro.loop.fitting.noise import first_noise
from metro.loop.fitting.race import raced
from metro.loop.search import forward as forward_room
from metro.loop.search import rivals as rivals_room
from metro.loop.search import trial as room
from metro.loop.search.strategy import SearchSpace
from metro.loop.search.trial import HOPELESS, tried


@pytest.fixture
def base():
    task = problem(2, truth=Wave(bend=0.2, ripple=0.15), phased=False)
    blocks = task.role("identify")
    return fit(Candidate(task.base), blocks, first_noise(GATES.model_form_budget, task.scatter, blocks))


@pytest.fixture
def left_out(monkeypatch):
    """Names of the effects of the models for which conditions were left out."""
    asked, leave_out = [], room.hold_out

    def counted(evidence, out, larger, prior):
        asked.append(larger.candidate.effects[-1].name)
        return leave_out(evidence, out, larger, prior)

    monkeypatch.setattr(room, "hold_out", counted)
    return asked


def trials(base, effects, prior_of, **options):
    prior = first_noise(GATES.model_form_budget, prior_of, base.blocks)
    return {one.effect.name: one for one in tried(base, effects, prior, GATES, 0.001, **options)}


def test_no_condition_is_left_out_for_an_effect_that_is_far_behind(base, left_out):
    found = trials(base, (BEND, TWIN, RIPPLE), np.full(2, 0.01))
    assert set(left_out) == {"bend", "twin"}
    assert found["bend"].why_not is None
    behind = found["bend"].fit.total - found["ripple"].fit.total
    assert behind > HOPELESS
    assert found["ripple"].why_not.code == "far_behind"
    assert found["ripple"].why_not.values["behind"] == pytest.approx(behind, rel=0.01)


def test_all_are_weighed_where_that_is_asked_for(base, left_out):
    found = trials(base, (BEND, RIPPLE), np.full(2, 0.01), behind=np.inf)
    assert set(left_out) == {"bend", "ripple"}
    assert getattr(found["ripple"].why_not, "code", "") != "far_behind"


def test_those_behind_are_weighed_after_all_where_the_foremost_does_not_pass(base, left_out, monkeypatch):
    monkeypatch.setattr(
        room, "_not_held_out", lambda evidence, _: "no gain" if evidence.statistic > 30.0 else None
    )
    found = trials(base, (BEND, RIPPLE), np.full(2, 0.01))
    assert found["bend"].why_not == "no gain"
    assert found["ripple"].why_not is None
    assert set(left_out) == {"bend", "ripple"}


def test_a_fit_is_given_up_above_its_bound_and_followed_to_its_end_below(base, monkeypatch):
    prior = first_noise(GATES.model_form_budget, np.full(2, 0.01), base.blocks)
    start = replace(base, noise=base.noise.sound)  # it hides nothing of what is missed
    whole = fit(Candidate(base.candidate.base, (BEND,)), base.blocks, prior, start)
    bound = cost_under(whole, start.noise) + 2.0 * HOPELESS
    near = fit(Candidate(base.candidate.base, (TWIN,)), base.blocks, prior, start, Race(bound))
    estimated, estimate = [], fit_room._reestimated
    monkeypatch.setattr(fit_room, "_reestimated", lambda *a: estimated.append(a) or estimate(*a))
    hopeless = fit(Candidate(base.candidate.base, (RIPPLE,)), base.blocks, prior, start, Race(bound))
    assert len(estimated) == 1  # where it was given up
    assert hopeless.total < whole.total - HOPELESS
    assert near.noise is not start.noise
    assert near.total == pytest.approx(whole.total, abs=0.01)


def test_what_is_behind_under_the_noise_of_the_smaller_model_alone_is_followed_to_its_end(base):
    """What the smaller model misses makes that noise large where an effect may gain most."""
    prior = first_noise(GATES.model_form_budget, np.full(2, 0.01), base.blocks)
    candidate = Candidate(base.candidate.base, (BEND,))
    whole = fit(candidate, base.blocks, prior, base)
    bound = cost_under(whole, base.noise) - 1.0  # nobody comes below it
    for least in (whole.total + 1.0, whole.total - HOPELESS):
        fitted, given_up = raced(candidate, base, prior, Race(bound, least))
        assert given_up == (least > whole.total)
    assert fitted.total == pytest.approx(whole.total, abs=0.01)
    assert fitted.converged


def test_what_gains_too_little_to_come_up_is_not_refined_to_its_end(base, monkeypatch):
    """It is given up where it gains less than a thirtieth of what it lacks; else all is followed."""
    monkeypatch.setattr(fit_room, "SETTLED", -np.inf)  # no gain is too small
    prior = first_noise(GATES.model_form_budget, np.full(2, 0.01), base.blocks)
    candidate, rounds = Candidate(base.candidate.base, (RIPPLE,)), []
    descend = fit_room.descend

    def counted(*arguments, **options):
        rounds.append(options)
        return descend(*arguments, **options)

    monkeypatch.setattr(fit_room, "descend", counted)
    given_up = fit(candidate, base.blocks, prior, base, Race(least=1000.0))
    short = len(rounds)
    rounds.clear()
    whole = fit(candidate, base.blocks, prior, base)
    assert whole is not given_up
    assert given_up.total <= whole.total + 0.01
    assert short <= len(rounds) - fit_room.ROUNDS + 2
    assert fit(candidate, base.blocks, prior, base, Race(least=1000.0)) is given_up
    rounds.clear()
    assert fit(candidate, base.blocks, prior, base, Race(least=whole.total - 1.0)) is whole
    assert not rounds


def test_rivals_are_the_same_as_without_a_bound(base, monkeypatch):
    prior = first_noise(GATES.model_form_budget, np.full(2, 0.01), base.blocks)
    current = fit(Candidate(base.candidate.base, (BEND,)), base.blocks, prior, base)
    library = (BEND, TWIN, RIPPLE, GAIN)
    bounded = rivals_room._replaced(current, base, library, prior)
    monkeypatch.setattr(rivals_room, "cost_under", lambda *_: np.inf)
    unbounded = rivals_room._replaced(current, base, library, prior)
    assert [one.candidate.effects for one in bounded] == [one.candidate.effects for one in unbounded]
    assert [one.total for one in bounded] == pytest.approx([one.total for one in unbounded], abs=0.02)
    assert bounded


def test_what_gained_no_more_than_chance_waits_until_no_other_may_be_added_at_once(base, monkeypatch):
    prior = first_noise(GATES.model_form_budget, np.full(2, 0.01), base.blocks)
    asked, ask = [], forward_room.tried

    def counted(current, effects, *options):
        asked.append({effect.name for effect in effects})
        return ask(current, effects, *options)

    monkeypatch.setattr(forward_room, "tried", counted)
    space = SearchSpace(base, (BEND, RIPPLE, GAIN), prior, GATES, 0.001)
    current, _, _ = forward_room._added(base, space, {})
    assert {effect.name for effect in current.candidate.effects} == {"bend", "ripple"}
    assert [names for names in asked if names][:3] == [{"bend", "ripple", "gain"}, {"ripple"}, {"gain"}]


def test_what_is_given_up_is_said_to_be_far_behind_and_not_followed(base, monkeypatch):
    prior = first_noise(GATES.model_form_budget, np.full(2, 0.01), base.blocks)
    clear = replace(base, noise=base.noise.sound)  # it hides nothing of what is missed
    followed, refine = [], fit_room._refined

    def counted(candidate, *arguments, rounds, **least):
        followed.extend((effect.name, rounds) for effect in candidate.effects)
        return refine(candidate, *arguments, rounds=rounds, **least)

    monkeypatch.setattr(fit_room, "_refined", counted)
    found = {one.effect.name: one for one in tried(clear, (RIPPLE, BEND), prior, GATES, 0.001)}
    assert found["bend"].why_not is None
    assert found["ripple"].why_not.code == "far_behind"
    assert ("ripple", 0) in followed  # it came after the more promising one, although it was named before
    assert all(rounds == 0 for name, rounds in followed if name == "ripple")
    space = [BEND, RIPPLE]
    assert forward_room._promising(space, {found["ripple"].effect.key: found["ripple"]}) == space


def test_what_was_given_up_is_followed_where_the_foremost_does_not_pass(base, monkeypatch):
    prior = first_noise(GATES.model_form_budget, np.full(2, 0.01), base.blocks)
    clear = replace(base, noise=base.noise.sound)
    monkeypatch.setattr(room, "beyond_left_out", lambda fitted, _: refused(fitted))

    def refused(fitted):
        return "no prediction" if fitted.candidate.effects[-1] is BEND else None

    found = {one.effect.name: one for one in tried(clear, (RIPPLE, BEND), prior, GATES, 0.001)}
    assert found["bend"].why_not == "no prediction"
    assert found["ripple"].fit.noise is not clear.noise
    assert getattr(found["ripple"].why_not, "code", "") != "far_behind"
