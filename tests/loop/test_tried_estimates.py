"""What loop.json keeps of an effect that was tried, claimed or not, for the memory of a campaign."""

import json
from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GATES, RIPPLE, Wave, effect, problem

from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.search.search import search
from metro.loop.verdict.story import story as story_of
from metro.loop.verdict.verdict import estimates, judge, parameters


def story(task, library):
    outcome = search(task, library, GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    verdict = judge(task, outcome, rows, GATES)
    tried = story_of(task, outcome, verdict, GATES)["candidates"]
    return outcome, {entry["effect"]: entry for entry in tried}


def test_the_estimates_of_effects_that_are_not_there_scatter_about_nothing_as_they_say():
    off = []
    for seed in range(16):
        _, tried = story(problem(seed), (BEND,))
        (one,) = tried["bend"]["estimates"]
        assert one["signed"]
        assert one["inside"]
        off.append(one["less_neutral"] / one["sd"])
    # The deviation allows for an error that all runs share, which none of these has: it may only be too long.
    assert abs(np.mean(off)) < 3.0 / np.sqrt(16)
    assert 0.3 < np.std(off) < 1.3


def test_an_effect_that_was_added_is_told_as_the_final_fit_has_it_and_as_json():
    outcome, tried = story(problem(3, truth=Wave(bend=0.3, ripple=0.2)), (BEND, RIPPLE))
    assert set(outcome.names) == {"bend", "ripple"}
    for name in outcome.names:
        (one,) = tried[name]["estimates"]
        final = parameters(outcome.final, name)[one["parameter"]]
        assert one["value"] == final["value"]
        assert final["ci95"][0] < one["value"] - 1.9 * one["sd"] < one["value"] < final["ci95"][1]
    assert json.loads(json.dumps(tried)) == tried


def test_an_effect_that_can_only_be_positive_is_not_signed():
    radius = effect("radius", "bend")
    radius = replace(radius, parameters=(replace(radius.parameters[0], lower=0.0),))
    outcome, tried = story(problem(4, truth=Wave(bend=0.3)), (radius,))
    (one,) = tried["radius"]["estimates"]
    assert (one["signed"], one["inside"]) == (False, True)
    with pytest.raises(KeyError):
        estimates(outcome.base, "radius")


def test_where_one_parameter_is_not_signed_none_of_the_effect_is():
    first = BEND.parameters[0]
    rate = replace(first, name="rate", lower=0.1, upper=9.0, neutral=1.0)
    only_positive = replace(rate, name="frequency", neutral=0.0)
    for second, signed in ((rate, True), (only_positive, False)):
        both = replace(BEND, parameters=(first, second))
        _, tried = story(problem(6), (both,))
        assert [one["signed"] for one in tried["bend"]["estimates"]] == [signed, signed]


def test_the_best_of_several_forms_is_said_to_be_chosen():
    forms = tuple(replace(BEND, form=form) for form in ("one", "another"))
    _, tried = story(problem(5), forms)
    assert tried["bend"]["chosen_among"] == 2
