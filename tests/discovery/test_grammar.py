"""The grammar: units that follow, what is admitted, and code that makes what the blueprint makes."""

import numpy as np
import pytest

from metro.discovery.blueprint import built, written
from metro.discovery.facts import Fact
from metro.discovery.grammar import Setting, grammar
from metro.discovery.parameters import unit_of
from metro.observables.force import shapes, terms

SPEED = np.repeat([3000.0, 4000.0, 5000.0], 2)
TRAVEL = np.linspace(0.1, 2.0, 6)


def entries(**facts):
    known = {name: Fact(np.repeat(values, 4), values) for name, values in facts.items()}
    return grammar(Setting(known, 3, alike=True, readings={"x": 100.0, "y": 80.0, "z": 40.0}))


def test_the_unit_of_a_size_follows_from_what_it_is_multiplied_with():
    assert unit_of("N", (("linear", "time"),)) == "N/s"
    assert unit_of("um", (("square", "path"),)) == "um/mm2"
    assert unit_of("1", (("linear", "travel"), ("sign", "up"))) == "1/m"
    assert unit_of("1", (("saturating", "travel"),)) == "1"


def test_no_term_depends_on_what_is_constant():
    named = {variable for entry in entries(speed=SPEED) for variable in entry.variables}
    assert "speed" in named
    assert not named & {"travel", "feed", "depth", "up", "time", "path"}


def test_a_single_tooth_is_named_once_where_all_are_alike():
    teeth = {entry.name for entry in entries(travel=TRAVEL) if entry.name.startswith("tooth")}
    assert {name[:7] for name in teeth} == {"tooth_0"}


@pytest.mark.parametrize("entry", entries(speed=SPEED, travel=TRAVEL), ids=lambda entry: entry.formula)
def test_the_code_of_a_term_makes_the_same_term(entry):
    values = {one.name: 0.25 * one.starts[0] for one in entry.parameters}
    names = {**vars(shapes), **vars(terms)}
    assert eval(written(entry.plan), names, {"values": values}) == built(entry.plan, values)


def test_every_term_has_a_size_that_may_be_zero_and_starts_within_its_bounds():
    for entry in entries(speed=SPEED, travel=TRAVEL):
        assert entry.sizes
        assert all(one.lower <= 0.0 < one.upper for one in entry.sizes)
        assert all(one.lower <= one.starts[0] <= one.upper for one in entry.parameters)
