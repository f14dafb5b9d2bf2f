"""What computes the observables, in the contract's order."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from metro.observables import PACKAGES
from metro.observables.observable import Observable


@cache
def observables() -> tuple[Observable[Any], ...]:
    """Return all observables, in the contract's order."""
    return tuple(_observable(package) for package in PACKAGES)


def by_name(name: str) -> Observable[Any]:
    """Return an observable.

    Raises
    ------
    KeyError
        There is none of this name.
    """
    return {each.name: each for each in observables()}[name]


def _observable(package: str) -> Observable[Any]:
    observable = import_module(f"metro.observables.{package}.observable").OBSERVABLE
    assert isinstance(observable, Observable)
    return observable
