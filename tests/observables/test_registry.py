"""What is said of the observables and what computes them belong together."""

from metro.observables import PACKAGES
from metro.observables.catalogue import (
    assumptions,
    descriptions,
    drawn_tables,
    names,
    observed_tables,
    shown_tables,
    title,
)
from metro.observables.registry import by_name, observables


def test_an_observable_is_computed_and_described_under_one_name_with_the_same_tables():
    assert len(PACKAGES) == len(observables()) == len(descriptions())
    for observable, description in zip(observables(), descriptions(), strict=True):
        assert observable.name == description.name
        assert observable.tables == description.tables
        assert by_name(observable.name) is observable


def test_no_table_is_written_by_two_observables():
    tables = observed_tables()
    assert len(set(tables)) == len(tables)
    assert set(shown_tables()) | set(drawn_tables()) <= set(tables)


def test_the_names_are_those_of_the_contract_in_its_order():
    assert names() == ("force", "joint_force", "deformation", "waviness", "flatness", "lobes")


def test_an_unknown_observable_is_named_by_its_words_and_assumes_nothing():
    assert title("lobes") == "stability"
    assert title("spindle_power") == "spindle power"
    assert assumptions("spindle_power") == ""


def test_what_is_observed_with_coefficients_comes_after_what_gives_them():
    kinds = [(each.gives_coefficients, each.observed_with_coefficients) for each in observables()]
    first = next(i for i, (gives, _) in enumerate(kinds) if gives)
    assert not any(needs for _, needs in kinds[:first])
