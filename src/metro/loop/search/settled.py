"""Whether a fit is a result: it converged, its model holds, and it determines what it is to determine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from metro.effects.effect import Effect
from metro.loop.checks.left_out import left_out
from metro.loop.checks.phases import tied
from metro.loop.fitting.candidate import unpredicted
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.noise import Noise
from metro.loop.statement import Statement
from metro.observables.problem import Block
from metro.units import Array

HALF_INTERVAL = 2.0  # standard deviations: half a 95 % interval
UNDETERMINED = Statement("undetermined")


def unsettled(fitted: Fit, tested: Effect | None = None) -> Statement | None:
    """Return why a fit is no result; None where it is one.

    Its model does not hold there, or it did not converge, or determines no parameter of an effect, or these
    would have to be larger than they may be, or what should begin at any time begins at the same one in every
    repeat.

    Parameters
    ----------
    tested : the effect that is to be added, or to stay. That another one is not determined speaks against it
        only where it is the reason: were its own parameters known, the other would be determined. None: all
        effects are to be.
    """
    # Where nothing is predicted a descent could not leave, and did not converge.
    if nothing := beyond(fitted, fitted.blocks):
        return nothing
    if not fitted.converged:
        return Statement("not_converged", {"step": fitted.step})
    parts = dict(fitted.candidate.parts(fitted.theta))
    half = _half_intervals(fitted)
    half_if_known = half if tested is None else _half_intervals(fitted, parts[tested])
    beyond_bound: np.ndarray = fitted.pressed > HALF_INTERVAL * np.sqrt(fitted.dispersion)
    for effect, place in parts.items():
        at, out = fitted.theta[place], beyond_bound[place]
        why = _undetermined(effect, at, half[place], out)
        if why is None:
            continue
        if effect == (tested or fitted.candidate.effects[-1]):
            return why
        anyway = _undetermined(effect, at, half_if_known[place], out) == UNDETERMINED
        if tested is None or why != UNDETERMINED or not anyway:
            return Statement("beside", {"effect": effect.name, "why": why})
    if repeated := tied(fitted):
        return Statement("tied", vars(repeated))
    return None


def _half_intervals(fitted: Fit, known: slice | None = None) -> Array:
    """Return half the interval of each effect parameter (q,), of some ``known`` ones where they are."""
    covariance, first = fitted.covariance, len(fitted.beta)
    if known is not None:
        held = np.arange(first, len(covariance))[known]
        across = covariance[:, held]
        taken = np.where(np.isfinite(across).all(axis=1, keepdims=True), across, 0.0)
        covariance = covariance - taken @ np.linalg.pinv(taken[held]) @ taken.T
    variance = np.diag(covariance)[first:] * fitted.dispersion
    return np.asarray(HALF_INTERVAL * np.sqrt(np.maximum(variance, 0.0)))


def _undetermined(effect: Effect, value: Array, half: Array, pressed: np.ndarray) -> Statement | None:
    """Return why the parameters of an effect are no result; None where they are one.

    The interval of each is as wide as its bounds, or an identified one is at a bound that the runs place it
    beyond: freed, its interval would not hold the bound. One that would is an estimate like any other. A
    group of parameters counts where those that are decisive for it are determined.

    Parameters
    ----------
    value, half : (k,) estimates and half of their intervals. pressed : (k,) which are beyond a bound.
    """
    settled: set[int] = set()
    open_ended: set[int] = set()
    for parameter, at, width, out in zip(
        effect.parameters, value.tolist(), half.tolist(), pressed.tolist(), strict=True
    ):
        if parameter.period is not None:
            identified = 2.0 * width < parameter.period
        else:
            identified = at - width > parameter.lower or at + width < parameter.upper
            below = at == parameter.lower and not parameter.nothing_below
            above = at == parameter.upper and not parameter.nothing_above
            if identified and out and (below or above) and at != parameter.neutral:
                return Statement("implausible", {"parameter": parameter.name, "bound": at})
        if identified:
            settled.add(parameter.group)
        elif parameter.decisive:
            open_ended.add(parameter.group)
    return None if settled - open_ended else UNDETERMINED


def beyond(fitted: Fit, blocks: Sequence[Block]) -> Statement | None:
    """Name the first of ``blocks`` for which a fitted model has no prediction, and why; None: it has all."""
    model = fitted.candidate.model(fitted.theta)
    reasons = ((block.run, unpredicted(model, block, fitted.beta)) for block in blocks)
    return next((Statement("no_prediction", {"run": run, "why": why}) for run, why in reasons if why), None)


def beyond_left_out(fitted: Fit, prior: Noise) -> Statement | None:
    """Return why conditions that are left out have no prediction; None: they have one.

    A model that holds where it was fitted, and nowhere else, is no cause (a tool so soft that no other cut
    would be steady).
    """
    parts = (part for each in left_out(fitted, prior).values() for part in each)
    return next(filter(None, (beyond(part.others, part.blocks) for part in parts)), None)
