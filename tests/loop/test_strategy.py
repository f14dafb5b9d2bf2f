"""The seam for search: another way to choose effects, and the same description of the outcome."""

from dataclasses import replace

import pytest
from toy import BEND, GAIN, GATES, RIPPLE, Wave, problem

from metro.loop.search.search import search
from metro.loop.search.strategy import Choice
from metro.loop.search.trial import tried


def best_single(space):
    """Return the one effect that fits best among those that pass the gates, or none."""
    trials = tried(space.base, space.effects, space.prior, space.gates, space.least)
    passed = [trial for trial in trials if not trial.why_not]
    best = max(passed, key=lambda trial: trial.fit.total, default=None)
    chosen = best.fit if best else space.base
    steps, weight = ((best.fit,), {best.effect.name: best.weight}) if best else ((), {})
    return Choice(chosen, steps, tuple(trials), weight, ())


def test_a_strategy_of_one_effect_adds_the_better_of_two_and_leaves_the_other_in_the_residual():
    task = problem(2, truth=Wave(bend=0.5, ripple=0.15))
    outcome = search(task, (BEND, RIPPLE), GATES, strategy=best_single)
    assert outcome.names == ("bend",)
    assert len(outcome.steps) == 1
    assert {trial.effect.name for trial in outcome.trials} == {"bend", "ripple"}
    assert any(line.significant for line in outcome.lines)
    assert set(search(task, (BEND, RIPPLE), GATES).names) == {"bend", "ripple"}


def test_what_no_strategy_can_show_is_kept_from_it():
    outcome = search(problem(5, truth=Wave(gain=0.3)), (GAIN, BEND), GATES, strategy=best_single)
    assert set(outcome.not_visible) == {"gain"}
    assert [trial.effect.name for trial in outcome.trials] == ["bend"]


@pytest.mark.parametrize("share", [0.0, 0.7, 1.0])
def test_what_a_strategy_chooses_is_claimed_with_its_weight_and_the_share_that_it_explains(share):
    def doubting(space):
        choice = best_single(space)
        return replace(choice, weight=dict.fromkeys(choice.weight, share))

    outcome = search(problem(1, truth=Wave(bend=0.2)), (BEND,), GATES, strategy=doubting)
    assert outcome.names == (("bend",) if share else ())  # one that is less likely than not is none
    if share:
        assert outcome.probability("bend") == pytest.approx(share * outcome.explained)


def test_a_likeness_that_a_strategy_chooses_is_not_in_the_final_fit():
    strange = replace(RIPPLE, resembled=True)
    outcome = search(problem(15, truth=Wave(ripple=0.1)), (strange,), GATES, strategy=best_single)
    assert outcome.names == ()
    assert outcome.final.candidate.effects == ()
    assert outcome.likeness.candidate.effects[0].name == "ripple"
