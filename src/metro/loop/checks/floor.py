"""Whether the error on runs that a fit has not seen is as large as the noise lets one expect.

The mean square of an error with the covariance Σ is distributed about as that of ν independent values, with
ν = tr(Σ)² / tr(Σ²) (Satterthwaite 1946, Biometrics Bulletin 2, 110). A run has 10⁵ samples, but the errors
that it shares (its coefficients, its zeros, the errors of the fitted parameters) leave it a few of these.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.loop.checks.left_out import parameter_errors
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.fit import Fit
from metro.observables.problem import Block
from metro.units import Array

# Chance of an error as far above the floor if there were nothing but noise: in so many observables something
# is said to be missing although nothing is.
ABOVE = 0.01


@dataclass(frozen=True)
class AgainstFloor:
    """An error against the noise floor.

    Attributes
    ----------
    ratio : rms error over the floor. freedom : independent values that the error is worth, ν.
    p_value : of a ratio as large if there were nothing but noise. relative : rms of the excess over the
        signal. condition : the one whose ratio is largest.
    """

    ratio: float
    freedom: float
    p_value: float
    relative: float
    condition: str

    @property
    def scale(self) -> float:
        """Factor by which the noise differs from what is declared of it, as these errors have it.

        The declared noise counts as much as :data:`metro.loop.fitting.noise.PRIOR_RUNS` independent values,
        the errors as much as they are worth. Where they are beyond chance something is missing, and they say
        nothing of the noise.
        """
        if self.p_value < ABOVE:
            return 1.0
        known = noise_room.PRIOR_RUNS
        return math.sqrt((known + self.freedom * self.ratio**2) / (known + self.freedom))


@dataclass(frozen=True)
class _Sums:
    """Of runs of one condition: square of the error, tr(Σ), tr(Σ²), square of the signal."""

    error: float
    expected: float
    squared: float
    signal: float


def against_floor(scored: Sequence[Fit], scale: float = 1.0) -> AgainstFloor | None:
    """Compare the errors of fits on runs that they have not seen with the noise; None without such runs.

    Parameters
    ----------
    scored : fits on the runs that they lack, those of one condition each
        (:func:`metro.loop.checks.left_out.unseen`).
    scale : factor on the noise, where it is known better than declared (:attr:`AgainstFloor.scale`).
    """
    from scipy.stats import f

    if not scored:
        return None
    sums: dict[str, list[_Sums]] = {}
    for fitted in scored:
        sums.setdefault(fitted.blocks[0].condition, []).append(_summed(fitted))
    every = [one for parts in sums.values() for one in parts]
    error, expected, squared, signal = (
        math.fsum(getattr(one, name) for one in every) for name in _Sums.__dataclass_fields__
    )
    runs = sum(len(fitted.blocks) for fitted in scored)
    freedom = expected**2 / squared
    expected *= scale**2
    return AgainstFloor(
        ratio=math.sqrt(error / expected),
        freedom=freedom,
        p_value=float(f.sf(error / expected, freedom, runs + noise_room.PRIOR_RUNS)),
        relative=math.sqrt(max(error - expected, 0.0) / signal) if signal else 0.0,
        condition=max(sums, key=lambda name: max(one.error / one.expected for one in sums[name])),
    )


def _summed(fitted: Fit) -> _Sums:
    """Sum over the runs of a fit, whose parameters have the same errors in all of them."""
    model = fitted.candidate.model(fitted.theta)
    error, alone, squared, signal, shared = 0.0, 0.0, 0.0, 0.0, []
    errors = [parameter_errors(fitted, block) for block in fitted.blocks]
    for block, unknown in zip(fitted.blocks, errors, strict=True):
        matrix, offset = model.design(block, fitted.nuisance[block.run], fitted.beta)
        residual = block.measured - offset - matrix @ fitted.beta
        own = noise_room.shared(block, fitted.noise, matrix, fitted.beta)
        variance, budget = _unshared(block, fitted)
        error += float(residual @ residual)
        signal += float(block.measured @ block.measured)
        alone += float(variance.sum() + sum(budget)) + float(np.sum(own**2)) + float(np.sum(unknown**2))
        directions = np.hstack([own, unknown])
        squared += float(variance @ variance) + sum(part**2 for part in budget)
        squared += 2.0 * float(variance @ (directions**2).sum(axis=1))
        squared += float(np.sum((own.T @ own) ** 2)) + 2.0 * float(np.sum((own.T @ unknown) ** 2))
        shared.append(unknown.T @ unknown)
    return _Sums(error, alone, squared + float(np.sum(np.sum(shared, axis=0) ** 2)), signal)


def _unshared(block: Block, fitted: Fit) -> tuple[Array, list[float]]:
    """Variance of what nothing shares, (n,), and the sum of that of the model-form budget by axis.

    What a model gets wrong is a smooth shape: it is taken as one direction of each axis.
    """
    alone = fitted.noise.alone(block)
    variance = noise_room.diagonal(block, replace(alone, budget=0.0))
    budget = noise_room.diagonal(block, alone) - variance
    return variance, [float(budget[block.axis == axis].sum()) for axis in np.unique(block.axis)]
