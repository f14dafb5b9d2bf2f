"""The library of effects: one file per effect; each replaces or wraps one part of a model."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import entry_points
from typing import Any

from metro.effects.effect import Effect, fitted_to
from metro.observables.problem import Problem


def library(observable: str | None = None) -> tuple[Effect, ...]:
    """Return the effects of this package and those that other packages register, by name.

    ``observable`` limits them to those that change the model of that observable. Another package offers an
    effect under the entry point group ``metro.effects``.
    """
    own = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    offered = [module.EFFECT for module in own if hasattr(module, "EFFECT")]
    offered += [entry.load() for entry in entry_points(group="metro.effects")]
    effects: list[Effect] = []
    for effect in offered:
        effects += [effect] if isinstance(effect, Effect) else effect  # several forms of one
    chosen = [effect for effect in effects if observable is None or observable in effect.observables]
    return tuple(sorted(chosen, key=lambda effect: effect.key))


def told_of(problem: Problem, known: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem with a base model that is told of the effects that the manifest declares.

    ``known``: parameters by name, by name of the effect, in the units of the contract; one value stands for
    all entries of a list.
    """
    declared = tuple(effect for effect in library(problem.observable) if effect.name in known)
    effects, unable = fitted_to(declared, problem)
    base, notes = problem.base, []
    for name, values in known.items():
        matching = [
            e
            for e in effects
            if e.name == name
            and set(e.names) | set(e.where) == set(values)
            and all(values[key] == value for key, value in e.where.items())
        ]
        if matching:
            given = {key: value for key, value in values.items() if key not in matching[0].where}
            base = matching[0].apply(base, matching[0].spread(given))
            notes.append(f"The base model is told of {name.replace('_', ' ')} (batch.yaml, known).")
        elif name in unable:
            notes.append(f"batch.yaml declares {name.replace('_', ' ')}, but {unable[name]}.")
    return replace(problem, base=base, notes=(*problem.notes, *notes))
