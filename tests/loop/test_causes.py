"""How causes of several observables are weighed, gated and ordered; on estimates that are put in."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from toy import ANGLE, BEND, GATES, TWIN, Wave, problem

from metro.loop.causes import causes as room
from metro.loop.causes.causes import _updated, judged
from metro.loop.causes.witnesses import Closed, ask, key_of, material, weighed
from metro.loop.search.search import search
from metro.loop.verdict.batch_story import causes

KEY = ("bend", "all")
RUNS = 12


def unsearched(name, bend, seed, seen=(BEND,), **changes):
    """An observable whose own search had no effects to try."""
    task = problem(seed, truth=Wave(bend=bend), phased=False)
    task = replace(task, observable=name, **changes)
    return Closed(task, replace(search(task, (), GATES), seen=seen))


@pytest.fixture(scope="module")
def bent():
    return {name: unsearched(name, 0.2, seed) for name, seed in (("one", 1), ("two", 1001))}


@pytest.fixture(scope="module")
def pair(bent):
    return [ask(one, KEY) for one in bent.values()]


def put_in(pair, values, *, effect=BEND, doubt=0.0):
    """The witnesses with variances 0.04 and 0.09, and twice the gains 30 and 20."""
    return [
        replace(
            told,
            value=np.array([value]),
            covariance=np.array([[variance]]),
            doubt=np.array([doubt]),
            evidence=replace(told.evidence, statistic=statistic),
            effect=effect,
        )
        for told, value, variance, statistic in zip(pair, values, (0.04, 0.09), (30.0, 20.0), strict=True)
    ]


def test_one_fit_for_all_gains_what_each_does_less_what_it_costs_to_agree(pair):
    """The doubt that runs share widens the differences, not what the runs say."""
    cause = weighed(KEY, put_in(pair, (1.0, 1.5), doubt=0.2))
    assert cause.statistic == pytest.approx(50.0 - 0.5**2 / (0.04 + 0.09))
    assert cause.runs == RUNS  # each once, in whichever observable it is seen
    assert cause.p_value == pytest.approx(stats.f.sf(cause.statistic, 1, RUNS + 4))
    chi2 = 0.5**2 / (0.08 + 0.13)
    assert cause.together.chi2 == pytest.approx(chi2)
    assert cause.differ == pytest.approx(stats.f.sf(chi2, 1, RUNS + 4))
    assert cause.together.value == pytest.approx([(1.0 / 0.08 + 1.5 / 0.13) / (1 / 0.08 + 1 / 0.13)])


def test_what_is_another_quantity_in_each_observable_counts_in_each(pair):
    own = replace(BEND.parameters[0], name="amplitude", local=True)
    effect = replace(BEND, parameters=(BEND.parameters[0], own))
    cause = weighed(KEY, put_in(pair, (1.0, 1.0), effect=effect))
    assert cause.together.freedom == 1
    assert cause.p_value == pytest.approx(stats.f.sf(50.0 / 3, 3, RUNS + 4))


def test_angles_that_lie_on_both_sides_of_the_cut_agree(pair):
    effect = replace(BEND, parameters=(replace(BEND.parameters[0], period=360.0),))
    cause = weighed(KEY, put_in(pair, (179.9, -179.9), effect=effect))
    assert cause.together.chi2 == pytest.approx(0.2**2 / 0.13)
    assert 179.9 < cause.together.value[0] < 180.1


def test_a_cause_is_told_by_its_joint_but_not_by_another_form():
    assert key_of(replace(BEND, where={"joint": 3}, form="joint 3")) == ("bend", "3")
    assert key_of(replace(BEND, form="faces")) == KEY


def test_who_is_asked_by_another_looks_where_that_one_saw_it_and_nowhere_else(bent, pair):
    sought = replace(BEND, sought=1e6)
    there = replace(bent["one"], outcome=replace(bent["one"].outcome, seen=(sought,)))
    assert ask(there, KEY).evidence.sought == 1e6
    told = ask(there, KEY, replace(pair[1], value=np.array([0.123])))
    assert told.effect.parameters[0].starts == (0.123,)
    assert told.evidence.sought == 1.0


def test_who_found_a_cause_bears_witness_by_what_it_gains_over_the_model_without_it():
    task = problem(1, truth=Wave(bend=0.2), phased=False)
    outcome = search(task, (BEND,), GATES)
    told = ask(Closed(task, outcome), KEY)
    assert told.names_it
    assert told.statistic == pytest.approx(2.0 * (outcome.final.total - outcome.base.total), rel=0.05)


def test_who_only_resembles_a_cause_is_not_asked(bent):
    like = replace(BEND, resembled=True)
    assert ask(replace(bent["one"], outcome=replace(bent["one"].outcome, seen=(like,))), KEY) is None


def test_a_change_below_twice_the_error_of_the_inputs_is_not_material(pair):
    told = replace(pair[0], evidence=replace(pair[0].evidence, size=0.05, missed=0.0))
    assert material(told, GATES)
    assert not material(replace(told, least=0.06), GATES)
    assert not material(replace(told, evidence=replace(told.evidence, missed=10.0)), GATES)


def test_what_two_show_is_named_with_what_explains_it_as_well(bent):
    def with_seen(*seen):
        return {name: replace(one, outcome=replace(one.outcome, seen=seen)) for name, one in bent.items()}

    (one,) = judged(bent, GATES)
    assert (one.status, one.cause.key, one.or_else) == ("together", KEY, ())
    assert one.probability > 0.99
    (either,) = judged(with_seen(BEND, TWIN), GATES)
    assert {either.cause.key, *either.or_else} == {KEY, ("twin", "all")}
    (incredible,) = judged(with_seen(replace(BEND, prior=1e-300)), GATES)
    assert incredible.probability < 0.01
    assert judged(with_seen(replace(BEND, sought=10.0)), GATES) == []


@pytest.mark.parametrize(
    ("bend", "changes"), [(0.21, {}), (0.2, {"systematic": 0.5})], ids=["another size", "too small to matter"]
)
def test_what_only_one_shows_is_not_named_by_two(bent, bend, changes):
    assert judged({"one": bent["one"], "two": unsearched("two", bend, 1001, **changes)}, GATES) == []


def test_further_evidence_multiplies_the_odds():
    assert _updated(0.5, math.log(3.0)) == pytest.approx(0.75)
    assert _updated(0.75, -math.log(9.0)) == pytest.approx(0.25)
    assert (_updated(1.0, -5.0), _updated(0.4, math.inf)) == (1.0, 0.4)


@pytest.mark.parametrize(
    ("value", "variance", "status"),
    [(0.0, 0.01, "denied"), (2.0, 0.01, "alone"), (0.0, 9.0, "alone"), (-6.0, 0.01, "contradiction")],
    ids=["shows that it is not there", "agrees", "cannot tell", "contradicts"],
)
def test_who_would_show_a_cause_and_does_not_speaks_against_it(monkeypatch, value, variance, status):
    """The estimates of both share their parameter: its cost is charged once, and what it costs to agree."""
    task = replace(problem(1, truth=Wave(bend=0.2), phased=False), observable="one")
    found = replace(search(task, (BEND,), GATES), weight={"bend": 0.7})
    both = {"one": Closed(task, found), "two": unsearched("two", 0.0, 1001)}
    said = {"one": (2.2, 1.0), "two": (value, variance)}

    def put(closed, key, start=None):
        estimate, spread = said[closed.problem.observable]
        witness = ask(closed, key, start)
        return replace(
            witness, value=np.array([estimate]), covariance=np.array([[spread]]), doubt=np.zeros(1)
        )

    monkeypatch.setattr(room, "ask", put)
    (one,) = judged(both, GATES)
    assert one.status == status
    if status != "contradiction":
        chi2 = (2.2 - value) ** 2 / (1.0 + variance)
        gain = one.cause.witnesses[1].evidence.gain
        assert one.probability == pytest.approx(_updated(found.probability("bend"), gain + 1.0 - 0.5 * chi2))
        assert (one.probability < 0.5 * found.probability("bend")) == (status == "denied")


def test_the_surest_cause_comes_first_and_what_too_few_runs_say_is_not_asked(bent):
    def verdict(status, **effects):
        found = [{"effect": name, "probability": p, "parameters": {}} for name, p in effects.items()]
        return {"status": status, "effects": found}

    entries = {"one": verdict("explained", ripple=0.6, gain=0.9), "two": verdict("insufficient")}
    assert [entry["cause"] for entry in causes(bent, entries, GATES)] == ["gain", "ripple"]


def test_an_error_of_the_inputs_leaves_a_parameter_as_uncertain_as_it_changes_the_prediction():
    one = unsearched("one", 0.2, 1, systematic=0.02)
    told = ask(one, KEY)
    runs = told.larger.blocks
    slope = [told.larger.beta[0] * run.setting.feed * np.cos(3 * ANGLE) for run in runs]
    signal = [run.measured for run in runs]
    assert told.doubt == pytest.approx([0.02 * np.linalg.norm(signal) / np.linalg.norm(slope)], rel=1e-3)


def test_errors_of_a_model_that_misses_more_than_the_noise_are_wider_by_as_much(pair):
    told = pair[0]
    worse = replace(told.larger, chi2={name: 4.0 * count for name, count in told.larger.elements.items()})
    assert worse.dispersion > 4.0
    assert told.errors(worse) / worse.dispersion == pytest.approx(told.covariance / told.larger.dispersion)
