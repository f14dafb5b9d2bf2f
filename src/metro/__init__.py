"""Closed-loop metrology for robotic machining: predict, compare, trace the remaining error to its cause.

``metro.load(batch)`` opens the results of a batch in Python (docs/python.md). What it needs is imported where
it is used, because every command and every stage imports this module.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from metro.effects.effect import Effect, EffectParameter
    from metro.loaded.batch import LoadedBatch, load
    from metro.loaded.force import ForcePrediction
    from metro.loaded.lobes import LobePrediction
    from metro.loaded.quantity import Quantity
    from metro.loaded.refit import FitReport

__version__ = "0.1.0"
__all__ = [
    "Effect",
    "EffectParameter",
    "FitReport",
    "ForcePrediction",
    "LoadedBatch",
    "LobePrediction",
    "Quantity",
    "load",
]

_MODULES = {
    "Effect": "metro.effects.effect",
    "EffectParameter": "metro.effects.effect",
    "FitReport": "metro.loaded.refit",
    "ForcePrediction": "metro.loaded.force",
    "LobePrediction": "metro.loaded.lobes",
    "LoadedBatch": "metro.loaded.batch",
    "Quantity": "metro.loaded.quantity",
    "load": "metro.loaded.batch",
}


def __getattr__(name: str) -> Any:
    """Import the module of a public name when the name is first asked for."""
    if name not in _MODULES:
        raise AttributeError(f"module 'metro' has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
