"""How likely runs are that a fit has not seen, averaged over what the fit leaves uncertain.

A fit of few conditions may hardly know a parameter that another condition shows plainly. To predict that
condition with the estimate alone would punish the model for what the fit never claimed to know. Base and
effect parameters are therefore normal about their estimates, and the likelihood is averaged over them by
Laplace's method, about the parameters that estimate and unseen runs together make most likely (MacKay 2003,
Information Theory, Inference, and Learning Algorithms, chapters 27 and 28).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from metro.loop.fitting.descent import descend
from metro.loop.fitting.fit import Fit, score
from metro.loop.fitting.system import (
    UNSEEN,
    Known,
    State,
    linearised,
    normal_equations,
)
from metro.observables.problem import Block
from metro.units import Array

STAYS = 1e-9  # deviation, in units of its size, of a base parameter that the fit does not determine: as it is


def predictive(fitted: Fit, blocks: Sequence[Block]) -> float:
    """Log-likelihood of unseen runs, averaged over the errors of base and effect parameters.

    For a linear model it is that of a normal distribution with the covariance Σ + J C Jᵀ. The runs' own
    unknowns are estimated from the runs themselves.
    """
    candidate, noise, known = fitted.candidate, fitted.noise, estimated(fitted)
    state = State(fitted.theta, fitted.beta, dict(score(fitted, blocks).nuisance))
    state, _ = descend(candidate, blocks, noise, state, known=known)
    system = linearised(candidate, blocks, noise, state, known=known)
    seen, _ = normal_equations(replace(system, weight=np.zeros_like(system.weight)))
    covariance = np.linalg.inv(known.precision)
    size = np.sqrt(np.diag(covariance))
    narrowed = np.eye(len(size)) + (covariance / np.outer(size, size)) @ (seen * np.outer(size, size))
    return -0.5 * (system.cost + float(np.linalg.slogdet(narrowed)[1]))


def estimated(fitted: Fit) -> Known:
    """Return what a fit says of its base and effect parameters; an effect lies in its bounds at least."""
    return known(fitted, fitted.covariance * fitted.dispersion)


def known(fitted: Fit, covariance: Array) -> Known:
    """Return what is known of the parameters of a fit that have a ``covariance`` (p + q, p + q)."""
    value = np.concatenate([fitted.beta, fitted.theta])
    bounds = np.array([parameter.upper - parameter.lower for parameter in fitted.candidate.parameters])
    variance = np.diag(covariance)
    determined = np.isfinite(variance) & (variance > 0.0)
    unknown = np.concatenate([STAYS * np.maximum(np.abs(fitted.beta), STAYS), bounds])
    size = np.sqrt(np.where(determined, variance, unknown**2))
    covariance = np.where(np.outer(determined, determined), covariance, np.diag(size**2))
    share, direction = np.linalg.eigh(covariance / np.outer(size, size))
    precision = (direction / np.maximum(share, UNSEEN)) @ direction.T / np.outer(size, size)
    evenly = np.concatenate([np.zeros(len(fitted.beta)), 12.0 / bounds**2])  # anywhere in the bounds
    return Known(value, precision + np.diag(evenly))
