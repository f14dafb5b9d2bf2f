"""What labels say of the boundary: stable below it, unstable above, give or take what the model leaves out.

The error of the model, in the logarithm of the depth, has four parts: one that all tests share, one of each
cut (modes that are off x and y move the boundary of up and of down milling differently), one of each speed of
a cut (the boundary is wrong there for every depth), one of each test (where the operator draws the line). So
the tests of a cut at one speed speak of one unknown depth, and their likelihood as a function of it is a
table; tests at the same speed are never counted as if each were evidence of its own.

How large the error is differs from machine to machine. Every draw of it has a size of its own, and the tests
say which sizes are likely.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from metro.units import Array

# Shares of the variance of the model's error.
SHARED, OF_CUT, OF_SPEED, OF_TEST = 0.37, 0.23, 0.35, 0.05
# Sizes that the error may have, relative to what is usual: each as likely as any other before the tests.
SIZES = (0.5, 1.0, 2.0, 4.0)
_ERRORS = np.linspace(-6.0, 6.0, 61)  # of a speed, in standard deviations
_GRID, _BEYOND = 200, 4.0  # depths of the table, to so many standard deviations beyond the tests
# Chatter frequencies: standard deviation of the logarithm, share of those that follow no model (another mode,
# once chatter is full grown), and the width over which these spread.
FREQUENCY_SD, STRAY, STRAY_WIDTH = 0.02, 0.2, 3.0
# Which line is the loudest: teeth that leave the cut modulate the vibration, so that it has lines at its own
# frequency and at so many tooth frequencies from that (Insperger et al. 2003, Int. J. Mach. Tools Manuf. 43,
# 25). Shares of the frequencies heard that follow the model.
LINES = {0: 0.6, -1: 0.15, 1: 0.15, -2: 0.05, 2: 0.05}


@dataclass(frozen=True)
class Labels:
    """Tests with labels, of a problem of n tests at p points (speeds of cuts).

    Attributes
    ----------
    point, depth, unstable, chatter_hz : (n,) place among the points; log of the depth in m; label 1 or 0;
        frequency, Hz, or NaN.
    rpm, tooth_hz : (p,) speed of each point, and frequency of its teeth, Hz.
    model_sd, label_error : usual error of the model, in the log of the depth; probability of a wrong label.
    cut : (p,) which cut each point is of, by a number.
    """

    point: np.ndarray
    depth: Array
    unstable: Array
    chatter_hz: Array
    rpm: Array
    tooth_hz: Array
    model_sd: float
    label_error: float
    cut: np.ndarray

    @property
    def speeds(self) -> Array:
        """(j,) speeds, each once: tests at one speed are left out together."""
        tested: Array = np.unique(self.rpm[self.point])
        return tested

    def take(self, which: np.ndarray) -> Labels:
        """Return the tests under a mask."""
        return replace(
            self,
            point=self.point[which],
            depth=self.depth[which],
            unstable=self.unstable[which],
            chatter_hz=self.chatter_hz[which],
        )


@dataclass(frozen=True)
class Errors:
    """Draws of what the models get wrong.

    Attributes
    ----------
    deviations : (s, p) of the log depth: what the base model is uncertain of, what all tests share and what
        those of a cut share. sd : (s,) size of the model's error in each draw, all four parts together.
    """

    deviations: Array
    sd: Array

    @property
    def own_sd(self) -> Array:
        """(s,) sizes of the part of the error that is not shared by the tests of a cut."""
        return np.asarray(self.sd * np.sqrt(OF_SPEED + OF_TEST))

    def of_size(self, sd: float) -> Errors:
        """Return the draws of one size."""
        kept = self.sd == sd
        return Errors(self.deviations[kept], self.sd[kept])


def drawn_errors(tests: Labels, base: Array, seed: int) -> Errors:
    """Draw the errors that tests share, beside deviations ``base`` (s, p) by what the model has in doubt."""
    rng = np.random.default_rng(seed)
    sd = tests.model_sd * np.resize(SIZES, len(base))
    cuts, cut = np.unique(tests.cut, return_inverse=True)
    shared = rng.normal(size=(len(base), 1)) * SHARED**0.5
    of_cut = rng.normal(size=(len(base), len(cuts)))[:, cut] * OF_CUT**0.5
    return Errors(base + sd[:, None] * (shared + of_cut), sd)


def unstable_probability(tests: Labels, boundary: Array, sd: Array | float) -> Array:
    """Probability that tests are unstable, at log depths of the boundary (..., n), in error by ``sd``."""
    from scipy.special import ndtr

    chance: Array = ndtr((tests.depth - boundary) / sd)
    return tests.label_error + (1.0 - 2.0 * tests.label_error) * chance


class Grids(NamedTuple):
    """Tables at q places for z sizes of the error, at evenly spaced depths.

    ``point``, ``speed`` (q,): index of each place's point and speed. ``start``, ``step`` (q, z): first log
    depth and the distance of two. ``value`` (q, z, g): what is read there.
    """

    point: np.ndarray
    speed: np.ndarray
    start: Array
    step: Array
    value: Array


class Draws(NamedTuple):
    """Deviations (s, p) of the log depth, index (s,) of the size of each, and normal numbers (s, p)."""

    deviations: Array
    size: np.ndarray
    own: Array


@dataclass(frozen=True)
class Likelihood:
    """What labels say of boundaries, tabulated for the sizes of the errors that are drawn.

    Attributes
    ----------
    tests : with their labels. errors : that were drawn.
    grids, draws : tables at the places where there are tests, and what is read there.
    """

    tests: Labels
    errors: Errors
    grids: Grids
    draws: Draws

    @classmethod
    def of(cls, tests: Labels, errors: Errors) -> Likelihood:
        """Tabulate what tests say."""
        point, (sizes, size) = np.unique(tests.point), np.unique(errors.sd, return_inverse=True)
        here = [tests.take(tests.point == each) for each in point]
        tables = [[_table(each, float(sd)) for sd in sizes] for each in here]
        grid, value = np.moveaxis(np.reshape(tables, (len(point), len(sizes), 2, _GRID)), 2, 0)
        start, step = grid[..., 0], grid[..., 1] - grid[..., 0]
        speed = np.searchsorted(tests.speeds, tests.rpm[point])
        own = np.random.default_rng(0).standard_normal(errors.deviations.shape)  # the same for all boundaries
        grids = Grids(point, speed, start.copy(), step, value.copy())
        return cls(tests, errors, grids, Draws(errors.deviations, size, own))

    def __call__(self, depth: Array, chatter: Array, unsure: Array | None = None) -> Array:
        """Log-likelihood (t, s, j) of the tests at each of j speeds.

        Parameters
        ----------
        depth, chatter : (t, p) log depth and chatter frequency (Hz) of t boundaries at all points.
        unsure : (t, p) standard deviations of ``depth``, where it is not known exactly.
        """
        from metro.loop.labels.lookup import read

        tests = self.tests
        total = np.zeros((len(depth), len(self.draws.size), len(tests.speeds)))
        for point, speed in zip(self.grids.point, self.grids.speed, strict=True):
            here = tests.take(tests.point == point)
            total[:, :, speed] += _frequency(here, chatter[:, point], tests.tooth_hz[point])[:, None]
        doubt = np.zeros_like(depth) if unsure is None else unsure
        read(self.grids, self.draws, np.ascontiguousarray(depth), np.ascontiguousarray(doubt), total)
        return total


def _table(here: Labels, sd: float) -> tuple[Array, Array]:
    """Log depths of the boundary at one point, and the log-likelihood of the labels for an error ``sd``."""
    from scipy.special import logsumexp

    margin = _BEYOND * sd
    grid = np.linspace(here.depth.min() - margin, here.depth.max() + margin, _GRID)
    weights = np.exp(-0.5 * _ERRORS**2)
    moved = grid[:, None] + _ERRORS * sd * np.sqrt(OF_SPEED)
    chance = unstable_probability(here, moved[..., None], sd * np.sqrt(OF_TEST))
    each = np.log(np.where(here.unstable > 0.5, chance, 1.0 - chance)).sum(axis=-1)
    return grid, np.asarray(logsumexp(each, b=weights / weights.sum(), axis=1))


def _frequency(here: Labels, predicted: Array, tooth_hz: float) -> Array:
    """Log-likelihood (t,) of the chatter frequencies at one point: their mean, as they share their cause."""
    measured = here.chatter_hz[np.isfinite(here.chatter_hz)]
    if not len(measured):
        return np.zeros(len(predicted))
    known = np.where(predicted > 0.0, predicted, np.nan)[:, None]
    followed = np.zeros((len(predicted), len(measured)))
    for line, share in LINES.items():
        distance = np.log(measured / np.abs(known + line * tooth_hz)) / FREQUENCY_SD
        density = np.exp(-0.5 * distance**2) / (np.sqrt(2.0 * np.pi) * FREQUENCY_SD)
        followed += share * (1.0 - STRAY) * np.nan_to_num(density)
    mean: Array = np.log(followed + STRAY / STRAY_WIDTH).mean(axis=1)
    return mean


def log_evidence(likelihood: Array, prior: Array) -> float:
    """Log of the marginal likelihood: ``likelihood`` (t, s, j), ``prior`` (t,) weights of the boundaries."""
    from scipy.special import logsumexp

    total = likelihood.sum(axis=2)
    return float(logsumexp(total, b=prior[:, None] / total.shape[1]))


def left_out(likelihood: Array, prior: Array) -> Array:
    """(j,) log-likelihood of the tests at each speed given those at all others."""
    every = log_evidence(likelihood, prior)
    speeds = range(likelihood.shape[2])
    return np.array([every - log_evidence(np.delete(likelihood, j, axis=2), prior) for j in speeds])


def of_errors(likelihood: Array, prior: Array, errors: Errors) -> Array:
    """(s,) weights of draws of the errors: of those of one size together, by how likely the tests make it."""
    from scipy.special import logsumexp

    each = logsumexp(likelihood.sum(axis=2), b=prior[:, None], axis=0)
    weights = np.zeros(len(each))
    for sd in np.unique(errors.sd):
        alike = errors.sd == sd
        weights[alike] = logsumexp(each[alike]) - np.log(alike.sum())
    weights = np.exp(weights - weights.max())
    return np.asarray(weights / weights.sum())


def posterior(likelihood: Array, prior: Array) -> Array:
    """(t,) weights of the boundaries given the tests."""
    total = likelihood.sum(axis=2)
    weight: Array = prior * np.exp(total - total.max()).mean(axis=1)
    return np.asarray(weight / weight.sum())
