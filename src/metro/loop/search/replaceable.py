"""Whether an effect could stand in for another one: whether it can make what that one makes.

Most effects cannot, and to fit each in the place of each other takes most of a search. Here it is asked to
first order: how much of the change that an effect makes remains if the other parameters and the signatures of
the other effect take of it what they can.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from metro.effects.effect import Effect
from metro.loop.fitting.candidate import Candidate, started
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.system import State, System, linearised, normal_equations, solution
from metro.observables.problem import predictions
from metro.units import Array

FAR = 60.0  # of the log-likelihood that would be lost: five times what a rival may be behind
HALF = 0.5  # of the squared change, which must be left, too: an effect may do more than from its starts


class Change:
    """What an effect makes of the prediction: of a fit that has it, against the fit that lacks it."""

    def __init__(self, smaller: Fit, current: Fit) -> None:
        self.smaller = smaller
        state = State(smaller.theta, smaller.beta, dict(smaller.nuisance))
        self.system = linearised(smaller.candidate, smaller.blocks, current.noise, state)
        self.made = [
            whiten(current.predict(block) - smaller.predict(block))
            for block, whiten in zip(smaller.blocks, self.system.whiteners, strict=True)
        ]
        self.count = sum(map(len, self.made))
        self.alone = self._left([made[:, None][:, :0] for made in self.made])

    @property
    def lost(self) -> float:
        """Log-likelihood that is lost without it, to first order in all that the smaller fit has."""
        return self._lost(self.alone)

    def could_be(self, effect: Effect) -> bool:
        """Whether another effect may make so much of it that it has to be fitted to know."""
        if self.lost < FAR or self._has_unknowns(effect):
            return True
        left = self._left(list(map(np.column_stack, zip(*self._signatures(effect), strict=True))))
        return self._lost(left) < FAR or left < HALF * self.alone

    def _has_unknowns(self, effect: Effect) -> bool:
        """Whether an effect gives runs unknowns of its own, such as a phase: no start says what it can do."""
        smaller = self.smaller
        model = self._with(effect).model(self._idle(effect))
        block = smaller.blocks[0]
        return bool(model.nuisance_starts(block).shape[1] > len(smaller.nuisance[block.run]))

    def _with(self, effect: Effect) -> Candidate:
        return Candidate(self.smaller.candidate.base, (*self.smaller.candidate.effects, effect))

    def _idle(self, effect: Effect) -> Array:
        """Return the parameters of the smaller fit, and beside them such that the effect is off.

        A shape, as a length or an order, has no value at which the effect is off: nothing is neutral within
        its bounds. It is where it starts, since a size says nothing there without a shape.
        """
        idle = [
            one.neutral if one.lower <= one.neutral <= one.upper else one.starts[0]
            for one in effect.parameters
        ]
        return np.concatenate([self.smaller.theta, idle])

    def _lost(self, left: float) -> float:
        """Log-likelihood that a squared change loses where the noise is estimated from the residual."""
        return 0.5 * self.count * math.log1p(left / self.count)

    def _left(self, signatures: list[Array]) -> float:
        """Squared change that base, effects, the runs' unknowns and ``signatures`` (n, k) leave."""
        rows = [
            (made, base, np.hstack([effects, more]), own)
            for made, (_, base, effects, own), more in zip(
                self.made, self.system.rows, signatures, strict=True
            )
        ]
        count = self.system.weight.shape[0] + signatures[0].shape[1]
        free: System = replace(self.system, rows=rows, weight=np.zeros((count, count)), pull=np.zeros(count))
        normal, right = normal_equations(free)
        return max(0.0, _beside_own(free) - float(solution(normal, right) @ right))

    def _signatures(self, effect: Effect) -> Iterator[list[Array]]:
        """Yield what an effect makes of each block, whitened, from each of its starts."""
        smaller, candidate, idle = self.smaller, self._with(effect), self._idle(effect)
        before = [smaller.predict(block) for block in smaller.blocks]
        for places in candidate.groups(len(smaller.theta)):
            for theta in started(candidate, idle, places):
                yield self._made_by(candidate, theta, before)
        for at, parameter in enumerate(effect.parameters, start=len(smaller.theta)):
            theta = idle.copy()
            theta[at] += parameter.scale if idle[at] < parameter.upper else -parameter.scale
            yield self._made_by(candidate, theta, before)

    def _made_by(self, candidate: Candidate, theta: Array, before: list[Array]) -> list[Array]:
        model, smaller = candidate.model(theta), self.smaller
        after = [
            predictions(model, block, smaller.nuisance[block.run][None], smaller.beta)[0]
            for block in smaller.blocks
        ]
        made = zip(self.system.whiteners, after, before, strict=True)
        return [whiten(np.nan_to_num(there - here)) for whiten, there, here in made]


def is_needed(current: Fit, effect: Effect) -> bool:
    """Whether a fit loses so much without an effect that the smaller model need not be fitted to know.

    To first order in all others. Of an effect that gives runs unknowns of their own it is not asked.
    """
    if effect.own:
        return False
    parts = dict(current.candidate.parts(current.theta))
    kept = tuple(one for one in parts if one is not effect)
    smaller = replace(
        current,
        candidate=Candidate(current.candidate.base, kept),
        theta=np.delete(current.theta, parts[effect]),
    )
    return Change(smaller, current).lost > FAR


def _beside_own(system: System) -> float:
    """Squared length of what the rows have, less what each block's own unknowns take of it."""
    total = 0.0
    for made, _, _, unknowns in system.rows:
        basis = np.linalg.qr(unknowns[:, unknowns.any(axis=0)])[0]
        left = made - basis @ (basis.T @ made)
        total += float(left @ left)
    return total
