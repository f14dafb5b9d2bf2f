"""How far a new run is from its prediction, beside the error that a run no fit has seen may have.

The mean square of an error with the covariance Σ is distributed about as that of tr(Σ)² / tr(Σ²) independent
values (:mod:`metro.loop.checks.floor`). Here it is taken for one run, as a whole and axis by axis: an error
of the axial force, the smallest, would vanish in that of all three.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from metro.loop.checks.floor import ABOVE
from metro.loop.checks.left_out import parameter_errors, scored_unseen
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.fit import Fit
from metro.observables.problem import Block
from metro.units import Array
from metro.watch.model import ForceModel


@dataclass(frozen=True)
class Figure:
    """An error beside what is expected.

    Attributes
    ----------
    axis : x, y or z of the work; "" for all three.
    rms_n, expected_n : rms of measured less predicted, and what it may be by the noise and by the errors of
        the parameters, N. signal_n : rms of the measured force, N.
    p_value : of an error as large if there were nothing but that.
    """

    axis: str
    rms_n: float
    expected_n: float
    signal_n: float
    p_value: float

    @property
    def ratio(self) -> float:
        """How many times the expected error it is."""
        return self.rms_n / self.expected_n


@dataclass(frozen=True, eq=False)
class Compared:
    """A new run under the model of its batch.

    Attributes
    ----------
    scored : the fit, evaluated on the run: only its own unknowns (the start phase) are estimated from it.
    block, residual : the run's evidence, and measured less predicted, (n,).
    whole, axes : figures of all axes together, and of each.
    """

    scored: Fit
    block: Block
    residual: Array
    whole: Figure
    axes: tuple[Figure, ...]

    @property
    def as_predicted(self) -> bool:
        """Whether the error is no larger than chance allows, as a whole and on each axis."""
        single = ABOVE / len(self.axes)
        return self.whole.p_value >= ABOVE and all(each.p_value >= single for each in self.axes)

    @property
    def worst(self) -> Figure:
        """The axis whose error is the largest beside what is expected of it."""
        return max(self.axes, key=lambda each: each.ratio)


def compared(force: ForceModel, block: Block) -> Compared:
    """Compare the measured force of a run with its prediction."""
    scored = scored_unseen(force.fitted, [block])
    model = scored.candidate.model(scored.theta)
    matrix, offset = model.design(block, scored.nuisance[block.run], scored.beta)
    residual = block.measured - offset - matrix @ scored.beta
    directions = np.hstack(
        [
            noise_room.shared(block, scored.noise, matrix, scored.beta),
            parameter_errors(scored, block),
        ]
    )
    alone = scored.noise.alone(block)
    variance = noise_room.diagonal(block, replace(alone, budget=0.0))
    budget = noise_room.diagonal(block, alone) - variance
    rows = block.coordinates["axis"].astype(str), block.to_rows(residual), block.to_rows(block.measured)

    def figure(axis: str) -> Figure:
        here = block.axis == axis if axis else np.ones(len(residual), bool)
        shown = rows[0] == axis if axis else np.ones(len(rows[0]), bool)
        own = directions[here]
        # What a model gets wrong is a smooth shape: it counts as one direction of each axis.
        wrong = [float(budget[here & (block.axis == name)].sum()) for name in np.unique(block.axis)]
        expected = float(variance[here].sum() + sum(wrong) + np.sum(own**2))
        squared = float(variance[here] @ variance[here]) + sum(each**2 for each in wrong)
        squared += 2.0 * float(variance[here] @ (own**2).sum(axis=1)) + float(np.sum((own.T @ own) ** 2))
        ratio = float(residual[here] @ residual[here]) / (expected * force.scale**2)
        rms, signal = (float(np.sqrt(np.mean(values[shown] ** 2))) for values in rows[1:])
        p_value = _tail(ratio, expected**2 / squared, len(force.fitted.blocks))
        return Figure(axis, rms, rms / math.sqrt(ratio) if ratio > 0.0 else math.inf, signal, p_value)

    axes = tuple(figure(str(axis)) for axis in np.unique(block.axis))
    return Compared(scored, block, residual, figure(""), axes)


def _tail(ratio: float, freedom: float, runs: int) -> float:
    """Chance of a mean square so many times the expected one; the noise itself is known from ``runs``."""
    from scipy.stats import f

    return float(f.sf(ratio, freedom, runs + noise_room.PRIOR_RUNS))
