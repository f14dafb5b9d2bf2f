"""Fits that race: one that stays too far behind is not followed to its end."""

from __future__ import annotations

import math

from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, Race, cost_under, fit
from metro.loop.fitting.noise import Noise


def raced(candidate: Candidate, start: Fit, prior: Noise, race: Race) -> tuple[Fit, bool]:
    """Fit a candidate to the blocks of ``start``, unless that stays behind; also say whether it does.

    It stays behind where its log-likelihood under its own noise comes to less than ``race.least``. Where its
    cost under the noise of ``start`` comes to no less than ``race.bound``, that is estimated from where it
    was given up. The bound alone does not say so: what ``start`` misses makes that noise large where the
    candidate may gain most, and another one gains elsewhere (a drift in the means of a force, runout in
    orders of which only a twentieth is explained).
    """
    fitted = fit(candidate, start.blocks, prior, start, race)
    if fitted.total >= race.least and cost_under(fitted, start.noise) > race.bound:
        fitted = fit(candidate, start.blocks, prior, start, race._replace(bound=math.inf))
    return fitted, fitted.total < race.least
