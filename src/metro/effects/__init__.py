"""The library of effects: one file per effect; each replaces or wraps one part of a model."""

from __future__ import annotations

import importlib
import pkgutil
from importlib.metadata import entry_points

from metro.effects.effect import Effect


def library(observable: str | None = None) -> tuple[Effect, ...]:
    """Return the effects of this package and those that other packages register, by name.

    ``observable`` limits them to those that change the model of that observable. Another package offers an
    effect under the entry point group ``metro.effects``.
    """
    own = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    effects: list[Effect] = [module.EFFECT for module in own if hasattr(module, "EFFECT")]
    effects += [entry.load() for entry in entry_points(group="metro.effects")]
    chosen = [effect for effect in effects if observable is None or observable in effect.observables]
    return tuple(sorted(chosen, key=lambda effect: effect.name))
