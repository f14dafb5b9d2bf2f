"""The noise of a candidate by expectation–maximisation, from what its prediction leaves of the runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from metro.compiled import compiled_with_arrays
from metro.loop.fitting.noise import (
    MISFIT_CORRELATION,
    PRIOR_RUNS,
    Noise,
    apart,
    axes,
    missed,
    sound,
)
from metro.observables.problem import Block
from metro.units import Array

# Of the way to the misfit estimated: a larger one lets the elements that are measured best weigh less, and is
# then estimated smaller, so that whole steps would go to and fro about the point where it stays.
MISFIT_STEP = 0.5
# One less the squared cosine of signals² and of one size for all: from there on they differ from one size,
# and what is missed whatever the signal from what grows with it. Signals that scatter by a tenth reach it.
ONE_SIZE = 0.03
LARGEST_ZERO = 4.0  # of its deviation: a zero that is farther off is something else that is taken for it


def updated(noise: Noise, prior: Noise, parts: Sequence[tuple[Block, Array, Array]]) -> Noise:
    """One step of expectation–maximisation for scatter, zeros and misfit, and what repeats share.

    Scatter and zeros are drawn towards the prior, as if it were ``PRIOR_RUNS`` runs. What is believed to be
    of a size scatters by no more than it may be off.

    Parameters
    ----------
    parts : for each run: block, residual (n,), and directions (n, k) under ``noise``. The first p directions
        of a run are those of the base parameters that scatter, then come its zeros.
    """
    at = prior.scattering
    p = len(at)
    amplitudes = {"scatter": [1.0] * PRIOR_RUNS, "zero": [1.0] * PRIOR_RUNS}
    size = float(np.mean(noise.scatter[at] / prior.scatter[at])) if p else 1.0
    moments: dict[str, Array] = {}
    residuals: list[tuple[Block, Array, Array]] = []
    largest = min((_may_be_off(block) for block, _, _ in parts if block.belief), default=np.inf)
    for block, residual, directions in parts:
        if block.role == "calibrate":
            continue
        known, wrong = sound(block, noise), apart(block, noise) * missed(block, noise)
        variance = known + MISFIT_CORRELATION * wrong
        names, number, rms = axes(block)
        # The misfit as it is, not as it weighs: else it takes what the shared directions explain.
        # The budget counts for all runs that share it, so that it does not average out; but the residual of
        # each is no larger by that.
        own = sound(block, noise, once=True)
        expected, left, found = _expected(residual, directions, (own, known + wrong, variance), rms, number)
        amplitudes["scatter"] += [float(size**2 * expected[:p].mean())] if p else []
        of_zeros = expected[p : p + block.zeros.shape[1]]
        amplitudes["zero"] += [float(noise.zero_factor**2 * of_zeros.mean())] if len(of_zeros) else []
        residuals.append((block, left, variance))
        for name, moment in zip(names, found, strict=True):
            moments[name] = moments.get(name, 0.0) + moment
    factor = {key: float(np.sqrt(np.mean(values))) for key, values in amplitudes.items()}
    misfit: dict[str, float] = {}
    level: dict[str, float] = {}
    for name, moment in moments.items():
        share, flat = _squares(moment)
        misfit[name] = _towards(share, noise.misfit.get(name, 0.0))
        level[name] = _towards(flat, noise.level.get(name, 0.0))
    return replace(
        noise,
        scatter=np.minimum(prior.scatter * factor["scatter"], largest),
        zero_factor=min(factor["zero"], LARGEST_ZERO),
        misfit=misfit,
        level=level,
        alike=_alike(residuals),
    )


def _may_be_off(block: Block) -> float:
    """Least relative error of what a block believes to be of a size; infinite of what has none."""
    sized = block.measured != 0.0
    return float(np.min(block.sigma[sized] / np.abs(block.measured[sized]), initial=np.inf))


@compiled_with_arrays
def _expected(
    residual: Array,
    directions: Array,
    variances: tuple[Array, Array, Array],
    rms: Array,
    number: npt.NDArray[np.intp],
) -> tuple[Array, Array, Array]:
    """Return what a run says of its noise.

    Parameters
    ----------
    residual : (n,). directions : (n, k) of what the whole run shares, each of one standard deviation.
    variances : each (n,): of a run by itself where the model misses nothing; and as it counts beside its
        repeats, with the misfit as it is, and as that weighs.
    rms : (n,) of the axis's signal. number : (n,) of the axis.

    Returns
    -------
    (k,) expected squares of the amplitudes of the directions.
    (n,) the residual without them, where the misfit is as it is.
    (axes, 2, 3) normal equations with their right side for relative misfit² and level².
    """
    own, once, variance = variances
    deviation, covariance = amplitude(directions, residual, variance)
    expected = deviation**2 + np.diag(covariance)
    deviation, covariance = amplitude(directions, residual, once)
    count = directions.shape[1]
    left, moments = np.empty_like(residual), np.zeros((number.max() + 1, 2, 3))
    for i in range(len(residual)):
        taken, spread = 0.0, 0.0
        for j in range(count):
            taken += directions[i, j] * deviation[j]
            spread += covariance[j, j] * directions[i, j] ** 2
            for k in range(j):
                spread += 2.0 * directions[i, j] * covariance[j, k] * directions[i, k]
        left[i] = residual[i] - taken
        excess = (left[i] ** 2 + spread - own[i]) / variance[i]
        first, second = rms[i] ** 2 / variance[i], 1.0 / variance[i]
        at = moments[number[i]]
        at[0, 0] += first * first
        at[0, 1] += first * second
        at[1, 1] += second * second
        at[0, 2] += first * excess
        at[1, 2] += second * excess
    moments[:, 1, 0] = moments[:, 0, 1]
    return expected, left, moments


@compiled_with_arrays
def amplitude(directions: Array, residual: Array, variance: Array) -> tuple[Array, Array]:
    """Return the expected amplitude of each shared direction (k,), and the covariance of that."""
    count = directions.shape[1]
    precision, right = np.eye(count), np.zeros(count)
    for i in range(len(residual)):
        for j in range(count):
            weighted = directions[i, j] / variance[i]
            right[j] += weighted * residual[i]
            for k in range(j + 1):
                precision[j, k] += weighted * directions[i, k]
    for j in range(count):
        for k in range(j):
            precision[k, j] = precision[j, k]
    covariance = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    return np.asarray(covariance @ right), covariance


def _towards(square: float, known: float) -> float:
    return math.sqrt(MISFIT_STEP * square + (1.0 - MISFIT_STEP) * known**2)


def _squares(moment: Array) -> tuple[float, float]:
    """Least squares for relative misfit² and level², neither of them negative.

    Where all runs have signals of one size nothing distinguishes the two: then all is relative.

    Parameters
    ----------
    moment : (2, 3) normal equations with their right side.
    """
    (a, b, x), (_, c, y) = moment.tolist()
    determinant = a * c - b * b
    if a == 0.0:
        return 0.0, max(0.0, y) / c if c else 0.0
    if determinant > ONE_SIZE * a * c:
        share, level = (c * x - b * y) / determinant, (a * y - b * x) / determinant
        if share >= 0.0 and level >= 0.0:
            return share, level
        if share < 0.0:
            return 0.0, max(0.0, y) / c
    return max(0.0, x) / a, 0.0


def _alike(residuals: Sequence[tuple[Block, Array, Array]]) -> float:
    """How much of ``Block.alike`` repeats share, by the products of their residuals, plus a standard error.

    Parameters
    ----------
    residuals : for each run: block, its residual (n,), and the variance of that (n,).
    """
    shared, possible = 0.0, 0.0
    for (one, left, variance), (other, right, its) in combinations(residuals, 2):
        if one.condition != other.condition or one.alike is None or other.alike is None:
            continue
        if one.alike.shape == other.alike.shape:  # else they are not the same waves
            each = one.alike * other.alike / (variance * its)
            shared += float(each @ (left * right))
            possible += float(each @ (one.alike * other.alike))
    return min(1.0, max(0.0, shared / possible) + 1.0 / math.sqrt(possible)) if possible else 1.0
