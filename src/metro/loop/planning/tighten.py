"""Which runs make predictions surer: those that lower the error that the parameters bring into them most.

The held-out runs stand for what is to be predicted. Of the variance of their prediction a part comes from the
parameters, as far as they are known; runs that are made add information on them. What is minimised is the
mean variance of the prediction, tr(A C): the A-criterion, the parameters weighted by what is predicted (also
called I- or V-optimality: Atkinson, Donev & Tobias 2007, Optimum Experimental Designs, 10.6).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.loop.fitting.fit import Fit, score
from metro.loop.fitting.noise import block_sigma
from metro.loop.fitting.system import moved_models, sensitivities
from metro.loop.planning.decide import Kind
from metro.loop.planning.experiment import MOST_REPEATS, covariance, information
from metro.observables.problem import Block, Problem, Proposal
from metro.units import Array

OPEN = 0.25  # share of the predicted variance that the parameters must bring to be worth a run
HALF = 0.5  # of that variance, which runs should leave


@dataclass(frozen=True)
class Tighter:
    """What would make predictions surer.

    ``parameter`` whose error dominates, ``share`` of the predicted variance that all parameters bring,
    ``kind`` of runs that lower it, and the share of it that they would leave (``left``).
    """

    parameter: str
    share: float
    kind: Kind
    left: float


def tighter(problem: Problem, fitted: Fit, proposals: Sequence[Proposal], most: int) -> Tighter | None:
    """Return the fewest runs that halve what the parameters bring into predictions; else what lowers it most.

    None where they bring little, or no run that could be made lowers it by a half.
    """
    held = problem.role("validate")
    if not held or not proposals:
        return None
    scored, known = score(fitted, held), covariance(fitted)
    weighing, rows = _weighing(scored, held)
    brought = float(np.trace(weighing @ known))
    share = brought / rows / _variance(scored, held)
    if share < OPEN:
        return None
    names = [parameter.name for parameter in problem.base.parameters]
    names += [parameter.name for parameter in fitted.candidate.parameters]
    # What the variance would fall by, were one parameter known.
    alone = np.einsum("ij,jk,ki->i", known, weighing, known) / np.diag(known)
    tried = [
        (Kind(proposal, repeats), _left(known, weighing, information(fitted, proposal, repeats)) / brought)
        for proposal in proposals
        for repeats in range(1, MOST_REPEATS + 1)
        if repeats * len(proposal.blocks) <= most
    ]
    enough = [one for one in tried if one[1] <= HALF]
    if not enough:
        return None
    kind, left = min(enough, key=lambda one: (one[0].runs, one[1]))
    return Tighter(names[int(np.argmax(alone))], share, kind, left)


def _weighing(scored: Fit, held: Sequence[Block]) -> tuple[Array, int]:
    """Sum (k, k) of the products of the held-out rows' derivatives, and the number of rows.

    What a run's own unknowns take up is left out: they are estimated from the run itself.
    """
    model = scored.candidate.model(scored.theta)
    moved = moved_models(scored.candidate, scored.theta)
    total, rows = np.zeros((len(scored.covariance),) * 2), 0
    for block in held:
        nuisance = scored.nuisance[block.run]
        matrix, _ = model.design(block, nuisance, scored.beta)
        effect, own = sensitivities(model, moved, block, nuisance, scored.beta)
        columns = np.hstack([matrix, effect])
        if own.shape[1]:
            columns = columns - own @ np.linalg.lstsq(own, columns, rcond=None)[0]
        seen = block.to_rows(columns)
        total += seen.T @ seen
        rows += len(seen)
    return total, rows


def _variance(scored: Fit, held: Sequence[Block]) -> float:
    """Mean variance of measured less predicted on the held-out runs, as the noise floor has it."""
    model = scored.candidate.model(scored.theta)
    squares = []
    for block in held:
        matrix, _ = model.design(block, scored.nuisance[block.run], scored.beta)
        squares.append(block_sigma(block, scored.noise, matrix, scored.beta) ** 2)
    return float(np.concatenate(squares).mean())


def _left(known: Array, weighing: Array, added: Array) -> float:
    """Trace of the weighed covariance (k, k) when runs have added information."""
    size = np.sqrt(np.diag(known))
    scaled = known / np.outer(size, size)
    more = added * np.outer(size, size)
    after = np.linalg.solve(np.eye(len(known)) + scaled @ more, scaled) * np.outer(size, size)
    value = float(np.trace(weighing @ after))
    return value if math.isfinite(value) else math.inf
