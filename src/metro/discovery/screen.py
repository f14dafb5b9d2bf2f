"""The cheap look at every term: one linear step each, judged on conditions that are left out of it.

The whitened residual of a fit is regressed on the sensitivity of a term beside those of all that was fitted;
each run's own unknowns are eliminated in it. Normal equations add up over runs, so that every condition is
predicted by the step of the others at no further cost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from metro.discovery.entry import Entry
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.system import State, linearised, solution
from metro.observables.problem import moved_from, predictions
from metro.units import Array


@dataclass(frozen=True)
class Screened:
    """An entry after one linear step: its sizes, and the log-likelihood that left-out conditions gain."""

    entry: Entry
    sizes: tuple[float, ...]
    gain: float


def screened(fitted: Fit, entries: Sequence[Entry], nuisance: Mapping[str, Array]) -> list[Screened]:
    """Take a linear step of each entry on the runs of a fit, the best first.

    ``nuisance``: unknowns of the runs, with the teeth numbered alike in all of them.
    """
    blocks = tuple(block for block in fitted.blocks if block.role != "calibrate")
    state = State(fitted.theta, fitted.beta, dict(nuisance))
    system = linearised(fitted.candidate, blocks, fitted.noise, state)
    model = fitted.candidate.model(fitted.theta)
    here = moved_from(model, model)
    conditions = sorted({block.condition for block in blocks})
    of = np.array([conditions.index(block.condition) for block in blocks])
    bases, residuals, owns, unmoved = [], [], [], []
    for block, (residual, base, effect, own) in zip(blocks, system.rows, strict=True):
        basis = np.linalg.qr(own[:, own.any(axis=0)])[0]
        columns = np.hstack([base, effect])
        bases.append(columns - basis @ (basis.T @ columns))
        residuals.append(residual - basis @ (basis.T @ residual))
        owns.append(basis)
        unmoved.append(predictions(here, block, state.nuisance[block.run][None], fitted.beta)[0])
    known = bases[0].shape[1]
    found = []
    for entry in entries:
        width = known + len(entry.sizes)
        normal = np.zeros((len(conditions), width, width))
        right = np.zeros((len(conditions), width))
        changed = [
            (entry.applied(model, values), values[one.name])
            for place, one in enumerate(entry.sizes)
            for values in [entry.near_zero(place)]
        ]
        for i, block in enumerate(blocks):
            at = state.nuisance[block.run][None]
            slopes = np.array(
                [
                    (predictions(moved_from(other, model), block, at, fitted.beta)[0] - unmoved[i]) / step
                    for other, step in changed
                ]
            ).T
            new = system.whiteners[i](slopes)
            columns = np.hstack([bases[i], new - owns[i] @ (owns[i].T @ new)])
            normal[of[i]] += columns.T @ columns
            right[of[i]] += columns.T @ residuals[i]
        weight = np.zeros((width, width))
        weight[:known, :known] = system.weight
        gain = _left_out(normal, right, weight, width) - _left_out(normal, right, weight, known)
        step = solution(normal.sum(axis=0) + weight, right.sum(axis=0))
        found.append(Screened(entry, tuple(step[known:].tolist()), float(gain)))
    return sorted(found, key=lambda one: -one.gain)


def _left_out(normal: Array, right: Array, weight: Array, kept: int) -> float:
    """Log-likelihood that conditions gain by the step (of the first ``kept`` unknowns) of all the others."""
    total = 0.0
    whole, all_right = normal.sum(axis=0) + weight, right.sum(axis=0)
    for own, mine in zip(normal[:, :kept, :kept], right[:, :kept], strict=True):
        step = solution(whole[:kept, :kept] - own, all_right[:kept] - mine)
        total += float(step @ mine) - 0.5 * float(step @ own @ step)
    return total


def foremost(found: Sequence[Screened], most: int, alike: int) -> list[Screened]:
    """Return the best that gain at all, at most ``alike`` of those that differ by their form alone."""
    chosen: list[Screened] = []
    count: dict[tuple[str, tuple[str, ...]], int] = {}
    for one in found:
        family = one.entry.family
        if one.gain > 0.0 and len(chosen) < most and count.get(family, 0) < alike:
            chosen.append(one)
            count[family] = count.get(family, 0) + 1
    return chosen
