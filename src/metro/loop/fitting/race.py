"""Fits that race: one that stays too far behind is not followed to its end."""

from __future__ import annotations

from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, cost_under, fit
from metro.loop.fitting.noise import Noise


def raced(candidate: Candidate, start: Fit, prior: Noise, bound: float, least: float) -> tuple[Fit, bool]:
    """Fit a candidate to the blocks of ``start``, unless that stays behind; also say whether it was given up.

    It stays behind where its cost under the noise of ``start`` comes to no less than ``bound``, and its
    log-likelihood under its own noise, estimated from where it was given up, to less than ``least``. The
    first alone does not say so: what ``start`` misses makes that noise large where the candidate may gain
    most, and another one gains elsewhere (a drift in the means of a force, runout in orders of which only a
    twentieth is explained).
    """
    fitted = fit(candidate, start.blocks, prior, start, bound)
    if cost_under(fitted, start.noise) <= bound:
        return fitted, False
    if fitted.total < least:
        return fitted, True
    return fit(candidate, start.blocks, prior, start), False
