"""Conditions left out: each predicted by the fit of all others, on the runs of the identification alone.

This is how a model shows whether it holds where it was not fitted, without a look at the runs that verify it.
The unit that is left out is the condition; it is the run where all runs are of one condition, or where
the other conditions do not determine a base parameter (the only hole among slots). Where there are more than
a dozen, several are left out of one fit, which costs a dozen fits however long the batch is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.loop.checks.predictive import known
from metro.loop.fitting.fit import Fit, refit, score
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.system import (
    State,
    inverse,
    linearised,
    moved_models,
    normal_equations,
    sensitivities,
)
from metro.observables.problem import Block
from metro.units import Array

# Fits that leave something out: each keeps 11 of 12 conditions or more. Ten are the usual compromise between
# bias and cost (Hastie, Tibshirani and Friedman, The Elements of Statistical Learning, 2nd ed., 7.10).
MOST_FITS = 12


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Runs that were left out, and the fit of all other runs, which has not seen them."""

    blocks: tuple[Block, ...]
    others: Fit


@lru_cache(maxsize=256)
def left_out(fitted: Fit, prior: Noise) -> dict[str, tuple[LeftOut, ...]]:
    """Leave out each condition in turn; a condition has several parts where its runs are left out singly.

    Nothing is left to fit where there is a single run: its entry is empty.
    """
    cut = [block for block in fitted.blocks if block.role != "calibrate"]
    by_condition = len({block.condition for block in cut}) > 1
    groups: dict[str, list[Block]] = {}
    for block in cut:
        groups.setdefault(block.condition if by_condition else block.run, []).append(block)
    if len(groups) == 1:
        return dict.fromkeys(groups, ())
    names = list(groups)
    found: dict[str, tuple[LeftOut, ...]] = {}
    for first in range(min(MOST_FITS, len(names))):
        together = names[first::MOST_FITS]
        found |= _parts(fitted, {name: tuple(groups[name]) for name in together}, prior)
    return {name: found[name] for name in names}


def _parts(
    fitted: Fit, held: Mapping[str, tuple[Block, ...]], prior: Noise
) -> dict[str, tuple[LeftOut, ...]]:
    """Leave out conditions together; each by itself, or each run, where the other runs do not suffice."""
    runs = {block.run for blocks in held.values() for block in blocks}
    others = refit(fitted, [block for block in fitted.blocks if block.run not in runs], prior)
    if len(runs) == 1 or _determined(others) == _determined(fitted):
        return {name: (LeftOut(blocks, others),) for name, blocks in held.items()}
    if len(held) > 1:
        return {k: part for name in held for k, part in _parts(fitted, {name: held[name]}, prior).items()}
    ((name, blocks),) = held.items()
    return {name: tuple(part for b in blocks for part in _parts(fitted, {name: (b,)}, prior)[name])}


def _determined(fitted: Fit) -> int:
    """Count the base parameters that the runs of a fit determine."""
    return int(np.isfinite(np.diag(fitted.covariance)[: len(fitted.beta)]).sum())


def most_missed(others: Fit, whole: Noise) -> Fit:
    """Return the fit of all others with the larger misfit of its own noise and that of the ``whole`` fit.

    What a model misses may show in the condition that is left out only (where a gap closes).
    """
    misfit, level = (
        {axis: max(rms, known.get(axis, 0.0)) for axis, rms in own.items()}
        for own, known in ((others.noise.misfit, whole.misfit), (others.noise.level, whole.level))
    )
    return replace(others, noise=replace(others.noise, misfit=misfit, level=level))


@lru_cache(maxsize=64)
def unseen(fitted: Fit, prior: Noise) -> tuple[Fit, ...]:
    """Return the fit of all others on each part that was left out: only the runs' own unknowns are fitted.

    The covariance is that which the parameters have if the model is complete: what the fit of all others
    misses makes them no less certain there, or an incomplete model would excuse its own errors.
    """
    parts = (part for each in left_out(fitted, prior).values() for part in each)
    return tuple(scored_unseen(part.others, part.blocks) for part in parts)


def scored_unseen(fitted: Fit, blocks: Sequence[Block]) -> Fit:
    """Return a fit on runs that it has not seen, with the covariance that a complete model would have."""
    return replace(score(fitted, blocks), covariance=_if_complete(fitted))


@lru_cache(maxsize=64)
def _if_complete(others: Fit) -> Array:
    """Covariance (p + q, p + q) of the parameters of a fit if its model missed nothing."""
    state = State(others.theta, others.beta, dict(others.nuisance))
    system = linearised(others.candidate, others.blocks, others.noise.sound, state)
    return inverse(normal_equations(system)[0])


def parameter_errors(fitted: Fit, block: Block) -> Array:
    """Return the errors that its parameters leave in the prediction of a block that a fit has not seen.

    Returns
    -------
    (n, p + q) directions, each of one standard deviation; they add to those that a whole run shares.
    """
    model, nuisance = fitted.candidate.model(fitted.theta), fitted.nuisance[block.run]
    matrix, _ = model.design(block, nuisance, fitted.beta)
    moved = moved_models(fitted.candidate, fitted.theta)
    effect, _ = sensitivities(model, moved, block, nuisance, fitted.beta)
    covariance = np.linalg.inv(known(fitted, fitted.covariance).precision)
    size = np.sqrt(np.diag(covariance))  # parameters differ in size by many powers of ten
    variance, axes = np.linalg.eigh(covariance / np.outer(size, size))
    root = size[:, None] * axes * np.sqrt(np.maximum(variance, 0.0))
    return np.asarray(np.hstack([matrix, effect]) @ root)
