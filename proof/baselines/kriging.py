"""An exact Gaussian process with a length for each setting, an error that a run shares, and white noise."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from metro.units import Array

JITTER = 1e-8  # of the variance
DRAWS = 999  # of signs
# Of a length, in deviations of its setting; of the deviations of the parts, in the rms of the values.
LENGTH, LENGTHS = np.log(1.0), (np.log(0.1), np.log(30.0))
PARTS, SIZES = np.log([1.0, 0.3, 0.5]), (np.log(1e-3), np.log(10.0))


@dataclass(frozen=True, eq=False)
class Points:
    """Where a ``value`` (n,) is known: ``settings`` (n, k) and ``places`` (n, m), scaled; ``run`` (n,)."""

    settings: Array
    places: Array
    run: np.ndarray
    value: Array


@dataclass(frozen=True, eq=False)
class Process:
    """A fitted process.

    ``lengths`` (k + 1,) of each setting and of the places; ``parts`` (3,): standard deviations of the smooth
    part, of what a run shares and of the noise, in the unit of the values.
    """

    points: Points
    lengths: Array
    parts: Array

    def covariance(self, settings: Array, places: Array) -> Array:
        """Covariance (q, n) of the smooth part at other places with that at the points."""
        apart = _apart(settings / self.lengths[:-1], self.points.settings / self.lengths[:-1])
        apart = apart + _apart(places, self.points.places) / self.lengths[-1] ** 2
        return np.asarray(self.parts[0] ** 2 * np.exp(-0.5 * apart))

    @property
    def of_points(self) -> Array:
        """Covariance (n, n) of the values at the points, with what a run shares and the noise."""
        points = self.points
        shared = self.parts[1] ** 2 * (points.run[:, None] == points.run)
        white = self.parts[2] ** 2 + JITTER * np.mean(points.value**2)
        smooth = self.covariance(points.settings, points.places)
        return np.asarray(smooth + shared + white * np.eye(len(points.value)))

    def mean(self, settings: Array, places: Array) -> Array:
        """Return the expected value (q,) of the smooth part elsewhere."""
        weight = cho_solve(cho_factor(self.of_points, lower=True), self.points.value)
        chunks = np.array_split(np.arange(len(settings)), len(settings) // 2000 + 1)
        return np.concatenate([self.covariance(settings[part], places[part]) @ weight for part in chunks])


def fitted(points: Points) -> Process:
    """Fit the lengths and the standard deviations by the marginal likelihood."""
    from scipy.optimize import minimize

    scale = float(np.sqrt(np.mean(points.value**2)))
    alike = (points.run[:, None] == points.run).astype(float)
    apart = [_apart(column[:, None], column[:, None]) for column in points.settings.T]
    apart.append(_apart(points.places, points.places))
    count = len(apart)

    def process(logs: Array) -> Process:
        return Process(points, np.exp(logs[:count]), scale * np.exp(logs[count:]))

    def cost(logs: Array) -> tuple[float, Array]:
        tried = process(logs)
        factor = cho_factor(tried.of_points, lower=True)
        weight = cho_solve(factor, points.value)
        smooth = tried.covariance(points.settings, points.places)
        slopes = [smooth * part / length**2 for part, length in zip(apart, tried.lengths, strict=True)]
        slopes += [2.0 * smooth, 2.0 * tried.parts[1] ** 2 * alike]
        slopes += [2.0 * tried.parts[2] ** 2 * np.eye(len(weight))]
        inner = np.outer(weight, weight) - cho_solve(factor, np.eye(len(weight)))
        value = 0.5 * points.value @ weight + float(np.log(np.diag(factor[0])).sum())
        return float(value), np.array([-0.5 * np.sum(inner * slope) for slope in slopes])

    start = np.concatenate([np.full(count, LENGTH), PARTS])
    bounds = [LENGTHS] * count + [SIZES] * len(PARTS)
    return process(minimize(cost, start, jac=True, bounds=bounds, method="L-BFGS-B").x)


def agreement(points: Points, runs: Sequence[str], condition: Sequence[Hashable]) -> Array:
    """Return how much the values of two runs are alike where these are near each other, (r, r).

    With lengths of one, so that nothing is fitted; without dimension. Runs of one condition are not compared:
    the sum says how well each condition is told by the others.

    Parameters
    ----------
    runs : (r,) their names. condition : (r,) of each.
    """
    near = _apart(points.settings, points.settings) + _apart(points.places, points.places)
    scaled = points.value / np.sqrt(np.mean(points.value**2))
    of_run = scaled[:, None] * (points.run[:, None] == np.array(runs))
    number = np.unique(np.array([str(one) for one in condition]), return_inverse=True)[1]
    return np.asarray(of_run.T @ np.exp(-0.5 * near) @ of_run * (number[:, None] != number))


def by_chance(alike: Array, seed: int) -> float:
    """Return the probability that runs agree as well by chance: then the sign of each is as likely the other.

    ``alike``: :func:`agreement`, or the sum of several.
    """
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(DRAWS, len(alike)))
    drawn = np.einsum("di,ij,dj->d", signs, alike, signs)
    own = float(alike.sum())
    return float((1 + np.count_nonzero(drawn >= own - 1e-12 * abs(own))) / (1 + DRAWS))


def _apart(ones: Array, others: Array) -> Array:
    """Squared distances (a, b)."""
    return np.asarray(((ones[:, None, :] - others[None, :, :]) ** 2).sum(axis=2))
