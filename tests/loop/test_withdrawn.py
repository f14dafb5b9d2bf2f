"""What an outcome says once its effects are taken back, and how much of the rest they had explained."""

from dataclasses import replace

import pytest
from toy import BEND, GATES, RIPPLE, SCATTER, Wave, problem

from metro.loop.checks.between import Between
from metro.loop.checks.evidence import missed
from metro.loop.checks.restless import Restless
from metro.loop.checks.signature import Line
from metro.loop.search.forward import forward
from metro.loop.search.outcome import withdrawn
from metro.loop.search.search import _unsteady, search
from metro.loop.statement import Statement


@pytest.fixture(scope="module")
def bent():
    return search(problem(9, truth=Wave(bend=0.2), phased=False), (BEND, RIPPLE), GATES)


def line(relative):
    return Line("x", "all", relative, relative, 1.0, relative, 0.0, True)


def test_without_its_effects_an_outcome_is_the_base_model_with_the_rest_of_that(bent):
    unrest = Restless(0.05, 4.0, 1e-6)
    apart = Between(0.1, "c", 0.0)
    full = replace(bent, base_restless=unrest, base_between=apart, restless=None, between=None)
    none = withdrawn(full, Statement("refuted"))
    assert bent.names == ("bend",)
    assert (none.names, none.steps, none.weight, none.final) == ((), (), {}, bent.base)
    assert {trial.effect.name: trial.why_not == Statement("refuted") for trial in none.trials} == {
        "bend": True,
        "ripple": False,
    }
    assert none.lines == bent.base_lines != ()
    assert none.restless is unrest
    assert none.between is apart


def test_what_only_an_effect_laid_bare_is_there_all_the_same(bent):
    later = replace(bent, base_lines=(), lines=(line(0.1),), restless=Restless(0.02, 3.0, 1e-6))
    none = withdrawn(later, Statement("refuted"))
    assert none.lines == later.lines
    assert none.restless is later.restless


def test_the_share_explained_is_of_the_power_within_and_between_runs(bent):
    base = {"base_lines": (line(0.3),), "base_restless": Restless(0.4, 9.0, 0.0), "base_between": None}
    left = {"lines": (line(0.1),), "restless": Restless(0.2, 5.0, 0.0), "between": Between(0.1, "c", 0.0)}
    # The difference between conditions came to light with the effects, and is held neither for nor against.
    assert replace(bent, **base, **left).explained == pytest.approx(1 - 0.05 / 0.25)
    assert replace(bent, **base, lines=(), restless=None, between=None).explained == 1.0


def test_what_an_effect_took_of_a_misfit_that_hid_all_places_is_explained(bent):
    """A vibration with another phase in every run: the base model shows no place, and then a small one."""
    steady = dict.fromkeys(("base_between", "between", "base_restless", "restless"))
    bare = replace(bent, base_lines=(), lines=(line(0.02),), **steady)
    taken = missed(bent.base) ** 2 - missed(bent.final) ** 2
    assert taken > 10 * 0.02**2
    assert bare.explained == pytest.approx(taken / (taken + 0.02**2))
    assert replace(bare, final=bent.base).explained == 0.0  # nothing was taken


def test_a_scatter_that_changes_the_prediction_too_little_is_no_finding():
    found = search(problem(3, phased=False, scatter=10 * SCATTER), (), GATES)
    assert found.base_restless.relative == pytest.approx(0.1, rel=0.5)
    assert _unsteady(found.base, found.prior, 0.5) is None


@pytest.mark.parametrize(("weight", "claimed"), [(0.6, ("bend",)), (0.45, ())])
def test_effects_none_of_which_is_likelier_than_not_are_not_claimed(weight, claimed):
    def unsure(space):
        choice = forward(space)
        return replace(choice, weight=dict.fromkeys(choice.weight, weight))

    found = search(problem(9, truth=Wave(bend=0.2), phased=False), (BEND, RIPPLE), GATES, unsure)
    assert found.names == claimed
    assert (found.trials[0].why_not == Statement("unbelieved")) is (not claimed)
