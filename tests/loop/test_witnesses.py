"""Several observables that share one parameter: agreeing, contradicting, weak in each, and none of it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize
from toy import BEND, GATES, POINTS, RIPPLE, SIGMA, Wave, problem
from worded import in_words

from metro.effects.library import library
from metro.loop.causes.causes import judged
from metro.loop.causes.witnesses import Closed, Witness, agreement, ask, key_of, shared, weighed
from metro.loop.checks.evidence import change, leave_out
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.descent import descend
from metro.loop.fitting.fit import fit
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.fitting.system import State
from metro.loop.search.search import search
from metro.loop.verdict.batch_story import causes
from metro.loop.verdict.verdict import judge
from metro.wording.batch import BRIEF
from metro.wording.causes import cause_in_words


def test_the_forms_of_a_joints_cause_share_the_same_parameters():
    """A ripple that the arm amplifies has a mode of its own, and the torque that motors see, too."""
    shares = {}
    for effect in library():
        if effect.per == "joint" and not effect.resembled:
            names = tuple(effect.parameters[place].name for place in shared(effect))
            shares.setdefault(key_of(effect), set()).add(names)
    assert shares
    assert {key: names for key, names in shares.items() if len(names) > 1} == {}


def noisy(task, sd, seed):
    """The problem with more noise, which it knows of."""
    rng = np.random.default_rng([seed, 7])
    sigma = np.full(POINTS, np.hypot(SIGMA, sd))
    blocks = (
        replace(b, measured=b.measured + sd * rng.normal(size=POINTS), sigma=sigma) for b in task.blocks
    )
    return replace(task, blocks=tuple(blocks))


def closed(name, task, library=(BEND, RIPPLE)):
    """An observable of that name after its own search, and its verdict."""
    task = replace(task, observable=name)
    outcome = search(task, library, GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    return Closed(task, outcome), judge(task, outcome, rows, GATES)


def unsearched(name, task):
    """An observable in which nothing was searched, so that nothing is named by it alone."""
    task = replace(task, observable=name)
    return Closed(task, replace(search(task, (), GATES), seen=(BEND, RIPPLE)))


def story(**tasks):
    both = {name: closed(name, task) for name, task in tasks.items()}
    return causes({n: one for n, (one, _) in both.items()}, {n: v for n, (_, v) in both.items()}, GATES)


def bent(seed, bend, **options):
    return problem(seed, truth=Wave(bend=bend), phased=False, **options)


def test_agreement_is_generalised_least_squares():
    rng = np.random.default_rng(1)
    roots = rng.normal(size=(3, 2, 2))
    covariances = [root @ root.T + 0.1 * np.eye(2) for root in roots]
    values = list(rng.normal(size=(3, 2)))
    found = agreement(values, covariances)
    design = np.vstack([np.eye(2)] * 3)
    weight = np.linalg.inv(
        np.block([[c if i == j else np.zeros((2, 2)) for j in range(3)] for i, c in enumerate(covariances)])
    )
    mean = np.linalg.solve(design.T @ weight @ design, design.T @ weight @ np.concatenate(values))
    rest = np.concatenate(values) - design @ mean
    assert found.value == pytest.approx(mean)
    assert found.covariance == pytest.approx(np.linalg.inv(design.T @ weight @ design))
    assert found.chi2 == pytest.approx(rest @ weight @ rest)
    assert found.freedom == 4


def test_who_tells_nothing_of_a_parameter_has_no_say_in_it():
    blind = np.diag([0.04, np.inf])
    found = agreement([np.array([1.0, 99.0]), np.array([1.2, 3.0])], [blind, np.diag([0.04, 0.01])])
    assert found.value == pytest.approx([1.1, 3.0])
    assert found.freedom == 1
    assert found.chi2 == pytest.approx(0.2**2 / 0.08)


def test_two_that_see_one_cause_confirm_it_with_a_narrower_interval():
    (cause,) = story(one=bent(1, 0.2), two=bent(1001, 0.2))
    assert cause["status"] == "confirmed"
    assert cause["seen_in"] == ["one", "two"]
    assert cause["agreement"]["p_value"] > 0.01
    low, high = cause["parameters"]["bend"]["ci95"]
    assert low < 0.2 < high
    widths = [np.ptp(told["parameters"]["bend"]["ci95"]) for told in cause["witnesses"]]
    assert high - low == pytest.approx(np.mean(widths) / np.sqrt(2), rel=0.1)
    json.dumps(in_words(cause), allow_nan=False)
    assert set(BRIEF) <= set(cause)


@pytest.mark.parametrize("other", [0.0, 0.1])
def test_sizes_that_differ_are_a_contradiction_in_words(other):
    (cause,) = story(one=bent(1, 0.2), two=bent(1001, other))
    assert cause["status"] == "contradiction"
    assert cause["parameters"] == {}
    words = cause_in_words(in_words(cause))
    assert "bend 0.2 ±" in words
    assert "not one common cause" in words


def test_an_error_that_all_runs_of_one_share_is_no_contradiction():
    """A prediction that may be off by 2 % leaves a bend of 0.2 uncertain by more than it differs here."""
    tasks = {"one": bent(1, 0.2), "two": bent(1001, 0.21)}
    assert story(**tasks)[0]["status"] == "contradiction"
    assert story(**tasks | {"two": replace(tasks["two"], systematic=0.02)})[0]["status"] == "confirmed"


def test_one_that_cannot_tell_neither_confirms_nor_contradicts():
    (cause,) = story(one=bent(1, 0.05), two=noisy(bent(1001, 0.0, repeats=1), 6.0, 1))
    assert cause["status"] == "alone"
    assert [told["says"] for told in in_words(cause["witnesses"])] == [
        "identified it",
        "is not sensitive enough",
    ]
    assert cause["seen_in"] == ["one"]


def test_a_cause_that_only_one_could_show_is_told_with_that_one():
    one, verdict = closed("one", bent(1, 0.2), (BEND,))
    other, clean = closed("two", bent(1001, 0.0), (RIPPLE,))
    (cause,) = causes({"one": one, "two": other}, {"one": verdict, "two": clean}, GATES)
    assert cause["status"] == "one_observable"
    assert cause["parameters"] == verdict["effects"][0]["parameters"]


def test_the_shared_parameter_is_that_of_one_fit_of_all():
    """Against the profile likelihood at the noise as estimated: bases fitted anew at one bend for both."""
    tasks = (noisy(bent(seed, 0.03), 0.2, seed) for seed in (3, 4))
    told = [ask(unsearched(name, task), ("bend", "all")) for name, task in zip("ab", tasks, strict=True)]

    def cost(bend):
        total = 0.0
        for one in told:
            state = State(np.zeros(0), one.larger.beta.copy(), dict(one.larger.nuisance))
            candidate = Candidate(Wave(bend=bend))
            total += descend(candidate, one.larger.blocks, one.larger.noise, state)[1]
        return total

    best = optimize.minimize_scalar(cost, bounds=(0.0, 0.06), method="bounded")
    cause = weighed(("bend", "all"), told)
    assert abs(cause.together.value[0] - best.x) < 0.5 * np.sqrt(cause.together.covariance[0, 0])


def test_what_none_can_name_by_itself_is_named_by_all_together():
    """Gates as strict as among many effects, and a size that matters: what is lacking is evidence.

    Near the limit two observables are enough in some pairs only; each alone is in none.
    """
    strict = replace(GATES, false_additions=0.002, materiality=0.002)
    alone = together = 0
    for seed in range(10):
        pair = [noisy(bent(seed + apart, 0.0058, repeats=1), 0.12, seed + apart) for apart in (0, 1000)]
        found = judged({n: unsearched(n, task) for n, task in zip("ab", pair, strict=True)}, strict)
        together += [(one.cause.key[0], one.status) for one in found] == [("bend", "together")]
        alone += sum(bool(search(task, (BEND, RIPPLE), strict).names) for task in pair)
    assert (alone, together) == (0, 4)


def test_clean_pairs_have_no_cause():
    false = 0
    for seed in range(20):
        pair = [noisy(bent(300 + seed + offset, 0.0, repeats=1), 0.2, seed + offset) for offset in (0, 1000)]
        false += bool(judged({n: unsearched(n, task) for n, task in zip("ab", pair, strict=True)}, GATES))
    assert false == 0


def test_an_effect_that_is_handed_on_with_the_coefficients_is_one_cause():
    effect = {"effect": "tool_runout", "probability": 1.0, "parameters": {"radius_um": {"value": 8.2}}}
    entries = {name: {"status": "explained", "effects": [effect]} for name in ("force", "lobes")}
    (found,) = causes({}, entries, GATES)
    assert found["seen_in"] == ["force", "lobes"]


@pytest.fixture(scope="module")
def pair():
    tasks = (noisy(bent(seed, 0.03), 0.2, seed) for seed in (3, 4))
    return [ask(unsearched(name, task), ("bend", "all")) for name, task in zip("ab", tasks, strict=True)]


def test_who_shares_a_parameter_that_others_know_is_tested_with_it_as_a_constant_of_the_model(pair):
    one, other = pair
    prior = one.closed.outcome.prior
    given = fit(Candidate(Wave(bend=0.1)), one.smaller.blocks, prior)
    before, after = leave_out(one.smaller, prior), leave_out(given, prior)
    sure = replace(other, value=np.array([0.1]), covariance=np.array([[1e-12]]))
    found = one.sharing([sure]).evidence
    expected = {name: after[name] - before[name] for name in before}
    assert found.held_out == pytest.approx(expected, abs=0.1)
    alone = one.held_out().evidence.held_out
    assert max(abs(alone[name] - expected[name]) for name in before) > 1.0
    assert found.size == pytest.approx(change(one.smaller, given), rel=1e-2)


def test_a_condition_that_is_left_out_has_no_part_in_what_predicts_it(pair, monkeypatch):
    one, other = pair
    own = []

    def at(_witness, fitted, value):
        own.append((fitted.theta[0], value[0]))
        return fitted

    monkeypatch.setattr(Witness, "at", at)
    one.sharing([replace(other, covariance=np.array([[np.inf]]))])
    assert len({round(theta, 6) for theta, _ in own}) == 5  # four conditions, and all
    assert [value for _, value in own] == pytest.approx([theta for theta, _ in own])


def test_what_is_shared_may_be_one_of_several_parameters_of_an_effect(pair):
    """Two parameters or more had not fitted the standard errors of none, and one had passed unseen."""
    one, _ = pair
    prior = one.closed.outcome.prior
    wide = fit(Candidate(Wave(), (BEND, RIPPLE)), one.smaller.blocks, prior, one.smaller)
    assert len(wide.theta) > 1
    given = one.at(wide, np.array([0.1]))
    alone = fit(Candidate(Wave(bend=0.1, ripple=float(wide.theta[1]))), one.smaller.blocks, prior)
    assert given.theta.size == 0
    for block in one.smaller.blocks:
        bent, known = (each.candidate.model(each.theta) for each in (given, alone))
        for got, wanted in zip(
            bent.design(block, given.nuisance[block.run], given.beta),
            known.design(block, given.nuisance[block.run], given.beta),
            strict=True,
        ):
            assert got == pytest.approx(wanted)
    standard_error = np.sqrt(np.diag(alone.covariance))
    assert (np.abs(given.beta - alone.beta) < 0.5 * standard_error).all()
