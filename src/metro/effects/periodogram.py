"""Where the residual of a base model has a line: starts for effects that are waves of unknown phase."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from metro.observables.problem import Block, Model, Problem
from metro.units import Array, ComplexArray

AT_ONCE = 128  # frequencies: one product of matrices is quicker than as many with vectors

# ``waves(model, block, frequencies)``: what the model predicts of waves of amplitude 1, one for each of (f,)
# frequencies, as complex amplitudes (n, f) of e^{iφ}.
Waves = Callable[[Any, Block, Array], ComplexArray]


def peaks(problem: Problem, waves: Waves, frequencies: Array, most: int) -> tuple[Array, Array]:
    """Return the frequencies of the strongest waves in the base model's residual, and their amplitudes.

    Least squares of a sine and a cosine that all runs of the identification share, frequency after frequency
    (a periodogram for uneven and filtered data: Lomb, Scargle), each element by its own error.

    Parameters
    ----------
    frequencies : (f,) rising, closer to each other than lines are wide. most : how many peaks to return.

    Returns
    -------
    tuple
        Frequencies and amplitudes (k,), the strongest first, k at most ``most``.
    """
    normal, right = np.zeros((len(frequencies), 2, 2)), np.zeros((len(frequencies), 2))
    for block, residual in zip(problem.role("identify"), _residuals(problem), strict=True):
        for first in range(0, len(frequencies), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            seen = waves(problem.base, block, frequencies[some]) / block.error[:, None]
            added = _normal_equations(seen, residual)
            normal[some] += added[0]
            right[some] += added[1]
    coefficients = _solved(normal, right)
    power, amplitude = (coefficients * right).sum(axis=1), np.linalg.norm(coefficients, axis=1)
    return _strongest(frequencies, power, amplitude, most)


def _normal_equations(seen: ComplexArray, residual: Array) -> tuple[Array, Array]:
    """Return normal matrices (f, 2, 2) of sine and cosine, and right sides (f, 2), of waves (n, f)."""
    both = np.stack([seen.imag, seen.real])
    return np.einsum("inf,jnf->fij", both, both), both.transpose(2, 0, 1) @ residual


def _solved(normal: Array, right: Array) -> Array:
    """Return coefficients (f, 2) of sine and cosine; the smallest where a wave is only one of the two."""
    return np.asarray(np.einsum("fij,fj->fi", np.linalg.pinv(normal, 1e-9, hermitian=True), right))


@dataclass(frozen=True, eq=False)
class TimeShares:
    """When what makes the elements of a block was cut.

    ``time``, ``share`` (m, k): the m places were each cut at k times, each with its share; ``mean`` makes the
    block's elements (n, c) of complex heights at the places (m, c).
    """

    time: Array
    share: Array
    mean: Callable[[ComplexArray], ComplexArray]


def own_peaks(
    problem: Problem, ways: Sequence[TimeShares], frequencies: Array, most: int, least: float
) -> tuple[Array, Array]:
    """Return what :func:`peaks` does of waves in time whose phase is each run's own.

    The zeros of a run take their part of each wave first.

    Parameters
    ----------
    ways : for each block of the identification. frequencies : (f,) evenly apart.
    least : power of a peak, over that of the strongest, below which it is left out.
    """
    blocks = problem.role("identify")
    power, square = np.zeros(len(frequencies)), np.zeros(len(frequencies))
    for block, left, way in zip(blocks, _residuals(problem), ways, strict=True):
        zeros = np.linalg.qr(block.zeros / block.error[:, None])[0]
        residual = left - zeros @ (zeros.T @ left)
        wave = way.share * np.exp(2j * np.pi * frequencies[0] * way.time)
        on = np.exp(2j * np.pi * (frequencies[1] - frequencies[0]) * way.time)
        for first in range(0, len(frequencies), AT_ONCE):
            some = slice(first, min(first + AT_ONCE, len(frequencies)))
            heights = np.empty((len(wave), some.stop - first), complex)
            for column in heights.T:
                column[:] = wave.sum(axis=1)
                wave *= on
            seen = way.mean(heights) / block.error[:, None]
            seen = seen - zeros @ (zeros.T @ seen)
            normal, right = _normal_equations(seen, residual)
            coefficients = _solved(normal, right)
            power[some] += (coefficients * right).sum(axis=1)
            square[some] += (coefficients**2).sum(axis=1)
    return _strongest(frequencies, power, np.sqrt(square / len(blocks)), most, least)


def _strongest(
    frequencies: Array, power: Array, amplitude: Array, most: int, least: float = 0.0
) -> tuple[Array, Array]:
    rises = np.diff(power, prepend=-np.inf, append=-np.inf)
    tops = np.flatnonzero((rises[:-1] > 0.0) & (rises[1:] <= 0.0))
    chosen = tops[np.argsort(power[tops])[::-1][:most]]
    chosen = chosen[power[chosen] >= least * power[chosen].max(initial=0.0)]
    return frequencies[chosen], amplitude[chosen]


def middle_start(base: Model, block: Block) -> Array:
    """Return the middle one of the starts of a block's unknowns."""
    starts = base.nuisance_starts(block)
    return np.asarray(starts[len(starts) // 2], dtype=float)


def _residuals(problem: Problem) -> list[Array]:
    """Return the base model's residual of each run, in units of its error.

    What is believed of the base parameters holds: else a wave would be taken for a larger one of these.
    """
    base, runs = problem.base, problem.role("identify")
    blocks = (*runs, *(block for block in problem.blocks if block.belief))
    designs = [base.design(block, middle_start(base, block), None) for block in blocks]
    sigma = [block.error for block in blocks]
    scaled = np.vstack([matrix / s[:, None] for (matrix, _), s in zip(designs, sigma, strict=True)])
    target = np.concatenate(
        [(b.measured - offset) / s for b, (_, offset), s in zip(blocks, designs, sigma, strict=True)]
    )
    beta = np.linalg.lstsq(scaled, target, rcond=None)[0]
    ends = np.cumsum([len(block.measured) for block in blocks])[:-1]
    return np.split(target - scaled @ beta, ends)[: len(runs)]
