"""The noise of a candidate by expectation–maximisation, from what its prediction leaves of the runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from metro.compiled import compiled_with_arrays
from metro.loop.fitting.noise import (
    MISFIT_CORRELATION,
    PRIOR_RUNS,
    Noise,
    alike_times,
    apart,
    axes,
    sizes,
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
    parts : for each run: block, residual (n,), and the ``columns`` (n, k) of what it shares. The first p of
        a run are those of the base parameters that scatter, then come its zeros.
    """
    at = prior.scattering
    p = len(at)
    amplitudes = {"scatter": [1.0] * PRIOR_RUNS, "zero": [1.0] * PRIOR_RUNS}
    size = float(np.mean(noise.scatter[at] / prior.scatter[at])) if p else 1.0
    moments: dict[str, Array] = {}
    residuals: list[tuple[Block, Array, Array]] = []
    largest = min((_may_be_off(block) for block, _, _ in parts if block.belief), default=np.inf)
    for block, residual, columns in parts:
        if block.role == "calibrate":
            continue
        names, number, rms = axes(block)
        misfit, level = (
            np.array([part.get(name, 0.0) for name in names]) for part in (noise.misfit, noise.level)
        )
        directions = columns * sizes(block, noise)
        weights = _Weights(misfit, level, noise.budget, apart(block, noise), alike_times(block, noise))
        expected, left, variance, found = _says(residual, directions, _known(block), (rms, number), weights)
        amplitudes["scatter"] += [float(size**2 * expected[:p].mean())] if p else []
        of_zeros = expected[p : p + block.zeros.shape[1]]
        amplitudes["zero"] += [float(noise.zero_factor**2 * of_zeros.mean())] if len(of_zeros) else []
        residuals.append((block, left, variance))
        for name, moment in zip(names, found, strict=True):
            moments[name] = moments.get(name, 0.0) + moment
    factor = {key: float(np.sqrt(np.mean(values))) for key, values in amplitudes.items()}
    misfit_of: dict[str, float] = {}
    level_of: dict[str, float] = {}
    for name, moment in moments.items():
        share, flat = _squares(moment)
        misfit_of[name] = _towards(share, noise.misfit.get(name, 0.0))
        level_of[name] = _towards(flat, noise.level.get(name, 0.0))
    return replace(
        noise,
        scatter=np.minimum(prior.scatter * factor["scatter"], largest),
        zero_factor=min(factor["zero"], LARGEST_ZERO),
        misfit=misfit_of,
        level=level_of,
        alike=_alike(residuals),
    )


class _Weights(NamedTuple):
    """What a noise makes of a block's errors.

    ``misfit``, ``level``: (axes,). ``budget``: relative. ``apart``: how many times what the model gets wrong
    counts. ``alike``: how many times the variance counts that repeats may share.
    """

    misfit: Array
    level: Array
    budget: float
    apart: float
    alike: float


@lru_cache(maxsize=1024)
def _known(block: Block) -> tuple[Array, Array, Array]:
    """Return standard error, that which repeats may share, and size of the signal of a block, each (n,)."""
    scale = axes(block)[2] if block.scale is None else block.scale
    alike = np.zeros_like(block.sigma) if block.alike is None else block.alike
    return block.sigma.astype(float), alike.astype(float), np.asarray(scale, dtype=float)


def _may_be_off(block: Block) -> float:
    """Least relative error of what a block believes to be of a size; infinite of what has none."""
    sized = block.measured != 0.0
    return float(np.min(block.sigma[sized] / np.abs(block.measured[sized]), initial=np.inf))


@compiled_with_arrays
def _says(
    residual: Array,
    directions: Array,
    known: tuple[Array, Array, Array],
    axis: tuple[Array, npt.NDArray[np.intp]],
    weights: _Weights,
) -> tuple[Array, Array, Array, Array]:
    """Return what a run says of its noise, as :func:`_expected`, and its variance: the misfit as it weighs.

    The misfit is taken as it is where the shared directions are taken off, not as it weighs: else it takes
    what those explain. The budget counts for all runs that share it, so that it does not average out; but the
    residual of each is no larger by that.
    """
    count, (sigma, alike, scale), (rms, number) = len(residual), known, axis
    own, once, variance = np.empty(count), np.empty(count), np.empty(count)
    for i in range(count):
        single = sigma[i] ** 2 + alike[i] ** 2 * weights.alike
        budget = (weights.budget * scale[i]) ** 2
        missed = (weights.misfit[number[i]] * rms[i]) ** 2 + weights.level[number[i]] ** 2
        own[i] = single + budget
        once[i] = single + weights.apart * (budget + missed)
        variance[i] = single + weights.apart * (budget + MISFIT_CORRELATION * missed)
    expected, left, moments = _expected(residual, directions, (own, once, variance), rms, number)
    return expected, left, variance, moments


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
    left, moments = residual - directions @ deviation, np.zeros((number.max() + 1, 2, 3))
    across = directions @ covariance
    for i in range(len(residual)):
        spread = 0.0
        for j in range(directions.shape[1]):
            spread += across[i, j] * directions[i, j]
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
    weighted = np.empty_like(directions)
    for i in range(len(residual)):
        for j in range(directions.shape[1]):
            weighted[i, j] = directions[i, j] / variance[i]
    precision, right = np.eye(directions.shape[1]) + directions.T @ weighted, residual @ weighted
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
