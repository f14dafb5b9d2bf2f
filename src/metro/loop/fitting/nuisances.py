"""The runs' own unknowns: the best of their starts, for given base and effect parameters or for none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.least_squares import least_squares
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.system import State
from metro.observables.problem import Block, Model, predictions
from metro.units import Array


def search_nuisance(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    state: State,
    around: Mapping[str, Array] | None = None,
) -> float:
    """Put each block's nuisance at the best of its starts for the state's parameters; return the cost.

    The starts are those of the model, or only the symmetric images of ``around``; an unknown that ``around``
    lacks, since it is of a simpler candidate, takes all of its starts.
    """
    model = candidate.model(state.theta)
    total = 0.0
    for block in blocks:
        starts = model.nuisance_starts(block)
        starts = _images(block, around[block.run], starts) if around else starts
        each = costs(model, block, noise, state.beta, starts)
        best = int(np.argmin(each))
        state.nuisance[block.run] = np.asarray(starts[best], dtype=float)
        total += float(each[best])
    return total


def costs(model: Model, block: Block, noise: Noise, beta: Array, starts: Array) -> Array:
    """Weighted sum of squares that each of a block's nuisances leaves, (starts,)."""
    weight = 1.0 / np.sqrt(noise_room.diagonal(block, noise))
    left = (block.measured - predictions(model, block, starts, beta)) * weight
    return np.asarray(np.sum(left**2, axis=1))


def _images(block: Block, nuisance: Array, starts: Array) -> Array:
    images = nuisance[None] if block.symmetries is None else nuisance + block.symmetries
    lacking = np.unique(starts[:, len(nuisance) :], axis=0)
    if not lacking.size:
        return images
    return np.hstack([np.repeat(images, len(lacking), axis=0), np.tile(lacking, (len(images), 1))])


def first_beta(candidate: Candidate, blocks: Sequence[Block], noise: Noise) -> Array:
    """Fit the base parameters, each block's nuisance at the start that fits the block alone best: (p,)."""
    theta = np.array([parameter.starts[0] for parameter in candidate.parameters])
    model = candidate.model(theta)
    rows, right = [], []
    for block in blocks:
        weight = 1.0 / np.sqrt(noise_room.diagonal(block, noise))
        best, kept = np.inf, None
        for nuisance in model.nuisance_starts(block):
            matrix, offset = model.design(block, nuisance, None)
            scaled, target = matrix * weight[:, None], (block.measured - offset) * weight
            solution = np.linalg.lstsq(scaled, target, rcond=None)[0]
            cost = float(np.sum((target - scaled @ solution) ** 2))
            if cost < best:
                best, kept = cost, (scaled, target)
        if kept is not None:
            rows.append(kept[0])
            right.append(kept[1])
    return least_squares(np.vstack(rows), np.concatenate(right))
