"""Significance of an effect by its own intervals: what these do not show is not claimed."""

from __future__ import annotations

import numpy as np

from metro.effects.effect import Effect
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.held_out import run_dof


def least_significant(fitted: Fit) -> tuple[Effect, float]:
    """Return the least significant effect of a fit, and its p-value by its own intervals.

    Likelihoods take what a model gets wrong for independent from condition to condition; these intervals,
    that it may be the same in all. An effect that only the former see is not shown. By how much an effect
    differs from run to run (``Fit.wider``) is no doubt whether it is there, and widens only what is stated.
    """
    p_values = [_p_value(fitted, effect, place) for effect, place in fitted.candidate.parts(fitted.theta)]
    least = int(np.argmax(p_values))
    return fitted.candidate.effects[least], p_values[least]


def _p_value(fitted: Fit, effect: Effect, place: slice) -> float:
    """Test of all sizes together (Wald), by F on the degrees of freedom of intervals.

    An angle is no size, nor what has no value at which it changes nothing, as a frequency. The size of what
    acts by its reciprocal is that. What may be as it is without the effect is no part of it.
    """
    from scipy.stats import f

    p = len(fitted.beta)
    covariance = fitted.covariance[p:, p:][place, place] * fitted.dispersion
    theta, neutral = fitted.theta[place], np.array([one.neutral for one in effect.parameters])
    inverse = np.array([one.reciprocal for one in effect.parameters])
    turned = np.where(inverse, -1.0 / np.where(inverse, theta, 1.0) ** 2, 1.0)
    unsure = np.diag([one.neutral_sd**2 for one in effect.parameters])
    covariance = covariance * np.outer(turned, turned) + unsure
    away = theta - neutral
    away[inverse] = 1.0 / theta[inverse] - 1.0 / neutral[inverse]
    sized = np.array(
        [one.period is None and one.lower <= one.neutral <= one.upper for one in effect.parameters]
    )
    known = sized & np.isfinite(np.diag(covariance)) & (np.diag(covariance) > 0.0)
    if not known.any():
        return 0.0 if not sized.any() else 1.0
    covariance, away = covariance[np.ix_(known, known)], away[known]
    wald = float(away @ np.linalg.pinv(covariance, hermitian=True) @ away)
    return float(f.sf(wald / len(away), len(away), run_dof(fitted)))
