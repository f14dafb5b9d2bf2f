"""A candidate: a base model with effects on it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from metro.effects.effect import Effect, EffectParameter
from metro.observables.problem import Model
from metro.units import Array


@dataclass(frozen=True)
class Candidate:
    """A base model with effects on it, ready to be given parameter values."""

    base: Model
    effects: tuple[Effect, ...] = ()

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Parameters of all effects, in order."""
        return tuple(itertools.chain.from_iterable(effect.parameters for effect in self.effects))

    def model(self, theta: Array) -> Model:
        """Apply the effects with the parameter values ``theta``, in the units of the contract."""
        model, values = self.base, list(theta)
        for effect in self.effects:
            taken = {parameter.name: float(values.pop(0)) for parameter in effect.parameters}
            model = effect.apply(model, taken)
        return model
