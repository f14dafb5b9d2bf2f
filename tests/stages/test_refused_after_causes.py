"""An observable that the batch does not support stays refused when causes were found upstream of it."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.problem import Refusal
from metro.observables.registry import by_name, observables
from metro.stages import loop
from metro.stages.problem_file import Posed

GATES = loop.Gates(
    model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1
)
NAMES = [each.name for each in observables() if not each.gives_coefficients]


def closing():
    """The loop of a batch of which only forces were observed, and in which a cause was found."""
    empty = pd.DataFrame()
    verdicts = {"force": {"effects": [{"effect": "tool_runout"}]}}
    batch = Batch("few", {}, {"cell": "none"}, pd.DataFrame(), {})
    return loop.Closing(batch, Path("none"), GATES, empty, {}, {}, verdicts=verdicts)


@pytest.mark.parametrize("name", NAMES)
def test_what_was_not_observed_is_not_posed_anew(name):
    refusal = Refusal("no files")
    refused = {"observe": lambda *_: refusal, "problem": lambda *_: pytest.fail("posed without tables")}
    observable = replace(by_name(name), **refused)
    state = closing()
    loop._close(state, observable, Posed(refusal, unobserved=True), anew=False)
    assert list(state.verdicts) == ["force"]
    assert state.tables == []
    assert state.identified == {}


def test_what_can_be_observed_with_the_coefficients_as_they_are_now_is_posed():
    asked = []
    observable = replace(
        by_name("joint_force"),
        observed_with_coefficients=True,
        observe=lambda *_: {"seen": pd.DataFrame({"a": [1]})},
        problem=lambda _batch, observed, _identified: asked.append(list(observed)) or Refusal("few"),
    )
    loop._close(closing(), observable, Posed(Refusal("no files"), unobserved=True), anew=False)
    assert asked == [["seen"]]
