"""Finds the effects of this package and of others, and applies those that a manifest declares."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import entry_points
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from metro.effects.effect import Effect, fitted_to
from metro.observables.problem import Problem
from metro.units import JSON


def library(observable: str | None = None) -> tuple[Effect, ...]:
    """Return the effects of this package and those that other packages register, by name.

    ``observable`` limits them to those that change the model of that observable. Another package offers an
    effect under the entry point group ``metro.effects``.
    """
    package, folder = __name__.rpartition(".")[0], str(Path(__file__).parent)
    own = [importlib.import_module(f"{package}.{module.name}") for module in iter_modules([folder])]
    offered = [module.EFFECT for module in own if hasattr(module, "EFFECT")]
    offered += [entry.load() for entry in entry_points(group="metro.effects")]
    effects: list[Effect] = []
    for effect in offered:
        effects += [effect] if isinstance(effect, Effect) else effect  # several forms of one
    chosen = [effect for effect in effects if observable is None or observable in effect.observables]
    return tuple(sorted(chosen, key=lambda effect: effect.key))


def described() -> JSON:
    """Return what a campaign and a report need to know of each effect of the library, by its name.

    ``meaning``, ``remedy``, ``belongs_to``, ``comparable`` and ``per`` of :class:`Effect`; the last one as a
    list, since the forms of an effect may differ in it. Meaning and remedy are those of the first form;
    ``meanings`` and ``remedies`` have those of the form with each parameter.
    """
    facts: JSON = {}
    for effect in library():
        known = {
            "meaning": effect.meaning,
            "remedy": effect.remedy,
            "belongs_to": list(effect.belongs_to),
            "comparable": effect.comparable,
            "per": [],
            "meanings": {},
            "remedies": {},
        }
        fact = facts.setdefault(effect.name, known)
        for name in effect.names:
            fact["meanings"].setdefault(name, effect.meaning)
            fact["remedies"].setdefault(name, effect.remedy)
        kinds = fact["per"]
        kinds += [effect.per] if effect.per and effect.per not in kinds else []
    return facts


def with_declared(problem: Problem, known: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem with a base model that includes the effects that the manifest declares.

    ``known``: parameters by name, by name of the effect, in the units of the contract; one value applies to
    all entries of a list.
    """
    declared = tuple(effect for effect in library(problem.observable) if effect.name in known)
    effects, unable = fitted_to(declared, problem, moot=True)
    base, notes = problem.base, []
    for name, values in known.items():
        forms = [effect for effect in effects if effect.name == name]
        matching = next((effect for effect in forms if _matches(effect, values)), None)
        words = name.replace("_", " ")
        if matching:
            given = {key: value for key, value in values.items() if key not in matching.where}
            base = matching.apply(base, matching.spread(given))
            notes.append(f"The base model includes {words}, as declared in batch.yaml under known.")
        elif forms:
            said = ", ".join(f"{key} {value}" for key, value in values.items()) or "no parameter"
            expected = " or ".join(dict.fromkeys(map(_expected, forms)))
            notes.append(
                f"The base model does not include {words}: batch.yaml has {said} under known; expected "
                f"{expected}."
            )
        elif name in unable:
            notes.append(f"batch.yaml declares {words}, but {unable[name]}.")
    return replace(problem, base=base, notes=(*problem.notes, *notes))


def not_modelled(observable: str, known: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return a note for each declared effect that the model of stability lacks: all but the tool's runout."""
    names = {effect.name for effect in library(observable)} & set(known) - {"tool_runout"}
    return [
        f"batch.yaml declares {name.replace('_', ' ')}, but the stability model cannot include it."
        for name in sorted(names)
    ]


def _matches(effect: Effect, values: Mapping[str, Any]) -> bool:
    """Return whether values are exactly those that a form of an effect needs: by name, place and number."""
    return (
        {*effect.names, *effect.where} == {*values, *effect.left_out}
        and all(values[key] == value for key, value in effect.where.items())
        and all(
            len(values[name]) == _entries(effect, name)
            for name in effect.names
            if isinstance(values.get(name), list)
        )
    )


def _expected(effect: Effect) -> str:
    """Name the parameters of a form of an effect, and how many values those have that are lists."""
    counts = {name: _entries(effect, name) for name in effect.names}
    own = [name if count == 1 else f"{name} ({count} values, or one)" for name, count in counts.items()]
    return ", ".join([*effect.where, *own])


def _entries(effect: Effect, name: str) -> int:
    """Count the values that a parameter has."""
    return sum(parameter.name == name for parameter in effect.reported)
