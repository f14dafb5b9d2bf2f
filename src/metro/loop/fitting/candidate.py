"""A candidate: a base model with effects on it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from metro.effects.effect import Effect, EffectParameter
from metro.observables.problem import Block, Limited, Model
from metro.units import Array

EASED = 6  # times that a start is halved, at most, until its model predicts every block


@dataclass(frozen=True)
class Candidate:
    """A base model with effects on it, ready to be given parameter values."""

    base: Model
    effects: tuple[Effect, ...] = ()

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Parameters of all effects, in order."""
        return tuple(itertools.chain.from_iterable(effect.parameters for effect in self.effects))

    def parts(self, theta: Array) -> Iterator[tuple[Effect, slice]]:
        """Go through the effects, each with its place in ``theta``."""
        first = 0
        for effect in self.effects:
            yield effect, slice(first, first + len(effect.parameters))
            first += len(effect.parameters)
        assert first == len(theta)

    def model(self, theta: Array) -> Model:
        """Apply the effects with the parameter values ``theta``, in the units of the contract."""
        model = self.base
        for effect, place in self.parts(theta):
            model = effect.apply(model, effect.values(theta[place]))
        return model

    @property
    def vectors(self) -> list[tuple[int, int]]:
        """Places of the length and of the angle of each plane vector among the parameters."""
        found = []
        for effect, place in self.parts(np.zeros(len(self.parameters))):
            names = [parameter.name for parameter in effect.parameters]
            for i, parameter in enumerate(effect.parameters):
                if parameter.length:
                    found.append((place.start + names.index(parameter.length), place.start + i))
        return found

    def groups(self, known: int) -> list[list[int]]:
        """Places of the parameters from ``known`` on, that are started together, group after group."""
        fresh = self.parameters[known:]
        numbers = sorted({parameter.group for parameter in fresh})
        return [[known + i for i, p in enumerate(fresh) if p.group == number] for number in numbers]


def unpredicted(model: Model, block: Block, beta: Array) -> str:
    """Return why a model has no valid prediction of a block, in words after the run's name; or empty."""
    return model.beyond(block, beta) if isinstance(model, Limited) else ""


def predicting(candidate: Candidate, blocks: Sequence[Block], theta: Array, beta: Array, known: int) -> Array:
    """Ease the effects from the parameter ``known`` on until every block is predicted, or they are too small.

    A descent does not go where nothing is predicted (a tool so soft that it would not cut steadily), and
    could not begin there either.
    """
    for _ in range(EASED):
        model = candidate.model(theta)
        if not any(unpredicted(model, block, beta) for block in blocks):
            break
        theta = _eased(candidate, theta, known)
    return theta


def _eased(candidate: Candidate, theta: Array, known: int) -> Array:
    """Return ``theta`` with the effects halfway to where they are off, from the parameter ``known`` on.

    A parameter that acts by its reciprocal is halved there; an angle, and a shape that is never off, stay.
    """
    result = theta.copy()
    for i, one in enumerate(candidate.parameters[known:], start=known):
        if one.reciprocal:
            result[i] = 2.0 / (1.0 / theta[i] + 1.0 / one.neutral)
        elif one.period is None and one.lower <= one.neutral <= one.upper:
            result[i] = 0.5 * (theta[i] + one.neutral)
    return result


def started(candidate: Candidate, theta: Array, places: list[int]) -> list[Array]:
    """Return ``theta`` with every combination of the starting values at ``places``."""
    parameters = candidate.parameters
    result = []
    for combination in itertools.product(*(parameters[i].starts for i in places)):
        trial = theta.copy()
        trial[places] = combination
        result.append(np.asarray(trial))
    return result
