"""What the base model identified is written again with effects that explain the residual, and only then."""

from types import SimpleNamespace

import pandas as pd
import pytest

from metro.observables.observable import Observable
from metro.observables.problem import Problem
from metro.stages.loop import _follow

FITTED = SimpleNamespace(beta=(1.0,))


def told(status, effects=("soft",), retold=True, after=None):
    """identified.json after the loop of an observable whose model and report are the names that they get."""
    task = Problem("toy", "mm", 1e-3, "base", (), pd.Series([0.0]))
    candidate = SimpleNamespace(effects=effects, model=lambda _theta: "with effects")
    closed = SimpleNamespace(
        outcome=SimpleNamespace(final=SimpleNamespace(candidate=candidate, theta=())), problem=task
    )
    state = SimpleNamespace(
        verdicts={"toy": {"status": status}}, identified={"stiffness": "base"}, batch=None, observed={}
    )

    def report(_batch, _observed, _identified, task, fit):
        assert fit is FITTED
        return {"stiffness": task.base}

    toy = Observable("toy", (), None, None, report, retold=retold, after_loop=after)
    _follow(state, toy, closed, FITTED)
    return state.identified


@pytest.mark.parametrize("status", ["explained", "partly_explained"])
def test_what_was_identified_is_told_again_with_proven_effects(status):
    assert told(status) == {"stiffness": "with effects"}


@pytest.mark.parametrize("status", ["undetermined", "unexplained", "clean"])
def test_an_effect_that_is_not_proven_changes_nothing(status):
    assert told(status) == {"stiffness": "base"}


def test_without_effects_or_where_it_is_not_asked_for_it_stays():
    assert told("explained", effects=()) == {"stiffness": "base"}
    assert told("explained", retold=False) == {"stiffness": "base"}


def test_what_follows_from_the_effects_is_written_in_any_case():
    found = told("undetermined", after=lambda *_: {"study": "anew"})
    assert found == {"stiffness": "base", "study": "anew"}
