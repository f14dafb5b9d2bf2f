"""What is said of the observables: names, titles, tables, needs.

This module imports nothing that computes; :mod:`metro.observables.registry` has the functions.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from metro.batch.capabilities import Capability, Stock
from metro.observables import PACKAGES
from metro.observables.arm.description import CALIBRATION
from metro.observables.description import Description
from metro.observables.levelling.description import LEVELLING
from metro.observables.loads.description import LOADED
from metro.observables.poses.description import POSES
from metro.observables.published.description import PRINTED
from metro.observables.texture.description import TEXTURE

# What is found without a model, so that nothing is compared with it.
BESIDE = (LOADED, CALIBRATION, LEVELLING, TEXTURE, POSES, PRINTED)


@cache
def descriptions() -> tuple[Description, ...]:
    """Return the descriptions of all observables, in their order."""
    return tuple(_description(package) for package in PACKAGES)


def _description(package: str) -> Description:
    description = import_module(f"metro.observables.{package}.description").DESCRIPTION
    assert isinstance(description, Description)
    return description


def names() -> tuple[str, ...]:
    """Return the contract's names of the observables."""
    return tuple(each.name for each in descriptions())


def title(observable: str) -> str:
    """Return the title of an observable; that of one which is not known is its name in words."""
    known = {each.name: each.title for each in (*descriptions(), *BESIDE)}
    return known.get(observable, observable.replace("_", " "))


def assumptions(observable: str) -> str:
    """Return what the base model of an observable assumes; empty where the observable is not known."""
    return next((each.assumes for each in (*descriptions(), *BESIDE) if each.name == observable), "")


def observed_tables() -> tuple[str, ...]:
    """Return the names of all tables that the stage ``identify`` writes."""
    return tuple(table for each in (*descriptions(), *BESIDE) for table in each.tables)


def shown_tables() -> tuple[str, ...]:
    """Return the observed tables that a batch's report is made from."""
    return tuple(table for each in (*descriptions(), *BESIDE) for table in each.shown)


def drawn_tables() -> tuple[str, ...]:
    """Return the observed tables that the page of all batches draws."""
    return tuple(table for each in descriptions() for table in each.drawn)


def capabilities(stock: Stock) -> tuple[Capability, ...]:
    """Say for every observable, for what is found beside them, whether a batch has what it needs."""
    return tuple(each for described in (*descriptions(), *BESIDE) for each in described.needs(stock))
