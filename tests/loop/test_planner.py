"""What a batch leaves open, question after question."""

from dataclasses import replace

import pytest
from test_decide import PROPOSALS, STOP, Knee
from toy import BEND, GAIN, GATES, RIPPLE, Wave, problem
from worded import in_words

from metro.loop.planning.planner import aims
from metro.loop.search.search import search


def planned(task, library, most=12):
    return aims(task, search(task, library, GATES), GATES, most)


def test_an_undecided_cause_is_decided_and_nothing_else_is_asked():
    task = replace(problem(2, truth=Knee(bend=0.2)), base=Knee(), feasible=PROPOSALS)
    (aim,) = planned(task, (BEND, STOP))
    assert aim.question == "decide"
    assert "feed 8" in in_words(aim.states)
    assert "probability" in in_words(aim.states)
    assert aim.chance >= 0.95
    assert 1 <= aim.runs <= 3


def test_where_no_feasible_run_decides_the_effects_own_experiments_are_named():
    task = replace(problem(2, truth=Knee(bend=0.2)), base=Knee(), feasible=PROPOSALS[:2])
    (aim,) = planned(task, (BEND, STOP))
    assert aim.question == "decide"
    assert not aim.kinds
    assert "no run" in in_words(aim.states)
    assert "an experiment for stop" in in_words(aim.states)


def test_a_proposal_that_is_no_row_of_the_run_table_is_not_planned():
    unmade = tuple(replace(one, made=()) for one in PROPOSALS)
    task = replace(problem(2, truth=Knee(bend=0.2)), base=Knee(), feasible=unmade)
    (aim,) = planned(task, (BEND, STOP))
    assert aim.runs == 0


def test_a_rest_that_nothing_explains_is_described_by_the_condition_that_shows_it():
    task = replace(problem(4, truth=Wave(spike=0.3)), feasible=PROPOSALS)
    (aim,) = planned(task, (BEND,))
    assert aim.question == "describe"
    (kind,) = aim.kinds
    assert kind.repeats == 3
    assert kind.proposal.made[0].like in {each.run for each in task.role("identify")}
    assert kind.proposal.blocks[0].condition == kind.proposal.words


def test_what_the_held_out_runs_alone_show_is_described_by_their_condition():
    task = replace(problem(5), feasible=PROPOSALS)
    blocks = tuple(
        replace(one, measured=1.3 * one.measured) if one.role == "validate" else one for one in task.blocks
    )
    (aim,) = planned(replace(task, blocks=blocks), (BEND, RIPPLE))
    assert aim.question == "describe"
    assert "only on the held-out runs" in in_words(aim.states)
    (kind,) = aim.kinds
    assert kind.proposal.made[0].like in {each.run for each in task.role("validate")}
    assert kind.proposal.blocks[0].condition == kind.proposal.words


def test_nothing_is_open_where_the_base_model_is_right_and_known():
    task = replace(problem(5), feasible=PROPOSALS)
    assert planned(task, (BEND, RIPPLE)) == []


def test_a_hidden_effect_that_no_feasible_run_shows_is_told_without_a_run():
    task = replace(problem(5), feasible=PROPOSALS)
    (aim,) = planned(task, (GAIN,))
    assert (aim.question, aim.runs) == ("show", 0)
    assert "an experiment for gain" in in_words(aim.states)


def test_a_batch_with_one_run_is_told_to_repeat_it_and_to_hold_one_out():
    task = problem(6, feeds=(1.0,), repeats=1, held=())
    (aim,) = planned(task, (BEND,))
    assert aim.question == "enough"
    roles = [made.given.get("role", "identify") for kind in aim.kinds for made in kind.proposal.made]
    assert sorted(roles) == ["identify", "validate"]


@pytest.mark.parametrize("most", [1, 2])
def test_no_more_runs_are_planned_than_may_be_made(most):
    task = replace(problem(2, truth=Knee(bend=0.05)), base=Knee(), feasible=PROPOSALS)
    assert sum(aim.runs for aim in planned(task, (BEND, STOP), most)) <= most
