"""Where the rest of a base model has a line: starts for effects that are waves of unknown phase."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from metro.observables.problem import Block, Model, Problem
from metro.units import Array


def peaks(
    problem: Problem, wave: Callable[[Model, float, float], Model], frequencies: Array, most: int
) -> tuple[Array, Array]:
    """Return the frequencies of the strongest waves in what the base model leaves, and their amplitudes.

    Least squares of a sine and a cosine that all runs of the identification share, frequency after frequency
    (a periodogram for uneven and filtered data: Lomb, Scargle), each element by its own error.

    Parameters
    ----------
    wave : ``wave(model, frequency, quarter)`` is the model with a wave of unit amplitude that is ``quarter``
        of a turn ahead (0 or 1). frequencies : (f,) rising, closer to each other than lines are wide.
    most : how many peaks to return.

    Returns
    -------
    tuple
        Frequencies and amplitudes (k,), the strongest first, k at most ``most``.
    """
    blocks = problem.role("identify")
    rests, known = _rests(problem.base, blocks)
    power, amplitude = np.empty(len(frequencies)), np.empty(len(frequencies))
    for i, frequency in enumerate(frequencies):
        models = [wave(problem.base, float(frequency), quarter) for quarter in (0.0, 1.0)]
        normal, right = np.zeros((2, 2)), np.zeros(2)
        for block, rest, offset in zip(blocks, rests, known, strict=True):
            columns = np.stack([_offset(model, block) - offset for model in models], axis=1)
            columns /= block.error[:, None]
            normal += columns.T @ columns
            right += columns.T @ rest
        found = np.linalg.lstsq(normal, right, rcond=1e-9)[0]
        power[i], amplitude[i] = found @ right, np.linalg.norm(found)
    return _strongest(frequencies, power, amplitude, most)


def own_peaks(
    problem: Problem,
    times: Sequence[tuple[Array, Callable[[Array], Array]]],
    frequencies: Array,
    most: int,
) -> tuple[Array, Array]:
    """Return what :func:`peaks` does of waves in time whose phase is each run's own.

    The zeros of a run take their part of each wave first.

    Parameters
    ----------
    times : for each block of the identification (m,) times, s, and what makes its elements of values there.
    """
    blocks = problem.role("identify")
    power, square = np.zeros(len(frequencies)), np.zeros(len(frequencies))
    for block, left, (time, mean) in zip(blocks, _rests(problem.base, blocks)[0], times, strict=True):
        zeros = np.linalg.qr(block.zeros / block.sigma[:, None])[0]
        rest = left - zeros @ (zeros.T @ left)
        for i, frequency in enumerate(frequencies):
            angle = 2.0 * np.pi * frequency * time
            waves = mean(np.stack([np.sin(angle), np.cos(angle)], axis=1)) / block.sigma[:, None]
            waves -= zeros @ (zeros.T @ waves)
            found = np.linalg.lstsq(waves, rest, rcond=1e-9)[0]
            power[i] += found @ (waves.T @ rest)
            square[i] += found @ found
    return _strongest(frequencies, power, np.sqrt(square / len(blocks)), most)


def _strongest(frequencies: Array, power: Array, amplitude: Array, most: int) -> tuple[Array, Array]:
    rises = np.diff(power, prepend=-np.inf, append=-np.inf)
    tops = np.flatnonzero((rises[:-1] > 0.0) & (rises[1:] <= 0.0))
    chosen = tops[np.argsort(power[tops])[::-1][:most]]
    return frequencies[chosen], amplitude[chosen]


def middle_start(base: Model, block: Block) -> Array:
    """Return the middle one of the starts of a block's unknowns."""
    starts = base.nuisance_starts(block)
    return np.asarray(starts[len(starts) // 2], dtype=float)


def _rests(base: Model, blocks: tuple[Block, ...]) -> tuple[list[Array], list[Array]]:
    """Return what the base model leaves of each block, in units of its error, and its offset there."""
    designs = [base.design(block, middle_start(base, block), None) for block in blocks]
    sigma = [block.error for block in blocks]
    scaled = np.vstack([matrix / s[:, None] for (matrix, _), s in zip(designs, sigma, strict=True)])
    target = np.concatenate(
        [(b.measured - offset) / s for b, (_, offset), s in zip(blocks, designs, sigma, strict=True)]
    )
    beta = np.linalg.lstsq(scaled, target, rcond=None)[0]
    ends = np.cumsum([len(block.measured) for block in blocks])[:-1]
    return np.split(target - scaled @ beta, ends), [offset for _, offset in designs]


def _offset(model: Any, block: Block) -> Array:
    return np.asarray(model.design(block, np.zeros(0), None)[1])
