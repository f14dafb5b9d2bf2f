"""Flatness indices of heights whose covariance is known, with 95 % intervals.

FLTt, FLTp, FLTv and the minimum zone are each the largest of many linear functions of the heights: the
difference of two stations, a station, a station turned over, three stations against one or two against two.
Noise makes the largest of them larger. Whichever is the largest in truth, its own interval is a Student's
one, so that the upper end of the index is the largest upper end. The lower end is the largest of the lower
ends that hold for all of them at once (Chernozhukov, Lee & Rosen, Econometrica 81 (2013) 667). The functions
that count are those that are the largest in some of many draws of the noise. Of a face that is flat they are
too few: every function may be the largest there. So the lower end is zero where noise alone reaches the index
in more than one case of forty.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from metro.surface.indices import Index, iso_indices, lowered
from metro.surface.minimum_zone import minimum_zone
from metro.surface.slopes import Levelled
from metro.units import Array

DRAWS, ZONES = 2000, 100  # of the noise; of a zone each is a linear programme of some milliseconds
ENDS = (0.025, 0.975)


def level_indices(found: Levelled, sigma: float, dof: float) -> dict[str, Index]:
    """Return ``fltt``, ``fltp``, ``fltv``, ``fltq`` and ``minimum_zone`` in m, with intervals.

    FLTq is less what noise adds to it; the others are as read, and noise shows in their lower ends.

    Parameters
    ----------
    found : the stations. sigma : standard deviation of a slope, rad; NaN: unknown, and no interval is.
    dof : degrees of freedom of ``sigma``; inf where it is known.
    """
    heights = found.heights
    values = iso_indices(heights)
    values["minimum_zone"] = minimum_zone(np.column_stack([found.places, heights])).width
    if not np.isfinite(sigma):
        return {name: Index(value, value, np.nan, np.nan) for name, value in values.items()}
    covariance = sigma**2 * found.cofactor
    root = _root(covariance)
    random = np.random.default_rng(0)
    draws = random.standard_normal((DRAWS, root.shape[1])) @ root.T
    if np.isfinite(dof):
        draws *= np.sqrt(dof / random.chisquare(dof, (DRAWS, 1)))
    largest: dict[str, tuple[Callable[[Array], Array], int]] = {
        "fltt": (_highest_and_lowest, DRAWS),
        "fltp": (_highest, DRAWS),
        "fltv": (lambda z: -_highest(-z), DRAWS),
        "minimum_zone": (lambda z: _zone(found.places, z), ZONES),
    }
    indices = {"fltq": _rms(values["fltq"], heights, covariance, dof)}
    for name, (function, count) in largest.items():
        some = draws[:count]
        alone = [function(each) for each in some]
        tried = [function(heights), *map(function, heights + some)]
        # of a zone there are more functions than so few draws find: those that noise alone chooses count too
        tried += alone if name == "minimum_zone" else []
        low, high = _ends(np.unique(np.round(tried, 9), axis=0), heights, covariance, some, dof)
        if values[name] <= _of_noise(alone, some):
            low = 0.0
        indices[name] = Index(values[name], values[name], max(0.0, min(low, values[name])), high)
    return indices


def _root(covariance: Array) -> Array:
    """Return a matrix (p, r) whose product with its transpose is the covariance."""
    size, vectors = np.linalg.eigh(covariance)
    kept = size > 1e-12 * max(float(size[-1]), np.finfo(float).tiny)
    return np.asarray(vectors[:, kept] * np.sqrt(size[kept]))


def _highest(heights: Array) -> Array:
    weights = np.zeros(len(heights))
    weights[heights.argmax()] = 1.0
    return weights


def _highest_and_lowest(heights: Array) -> Array:
    return _highest(heights) - _highest(-heights)


def _zone(places: Array, heights: Array) -> Array:
    """Return the weights of the stations that the minimum zone touches: its width is their sum with heights.

    They are the multipliers of the linear programme: least high − low with low ≤ z − a x − b y ≤ high.
    """
    from scipy.optimize import linprog

    centred = places - places.mean(axis=0)
    reach, half = float(np.abs(centred).max()), max(float(np.ptp(heights)), np.finfo(float).tiny)
    x, y = centred.T / reach
    one, none = np.ones(len(x)), np.zeros(len(x))
    below, above = np.column_stack([x, y, one, none]), np.column_stack([-x, -y, none, -one])
    solved = linprog(
        c=[0.0, 0.0, -1.0, 1.0],
        A_ub=np.vstack([below, above]),
        b_ub=np.concatenate([heights, -heights]) / half,
        bounds=(None, None),
        method="highs-ds",
    )
    low, high = -solved.ineqlin.marginals[: len(x)], -solved.ineqlin.marginals[len(x) :]
    return np.asarray(high - low)


def _ends(weights: Array, heights: Array, covariance: Array, draws: Array, dof: float) -> tuple[float, float]:
    """Return both ends of the largest of linear functions (k, p) of the heights.

    ``draws`` (d, p) of the noise, as much too large or too small in each as its size may be wrong by.
    """
    from scipy.stats import norm, t

    values = weights @ heights
    sd = np.sqrt(np.maximum(np.einsum("kp,pq,kq->k", weights, covariance, weights), 0.0))
    standard = draws @ weights.T / np.where(sd > 0.0, sd, np.inf)
    of_one = float(t.ppf(ENDS[1], dof) if np.isfinite(dof) else norm.ppf(ENDS[1]))
    of_all = float(np.quantile(standard.max(axis=1), ENDS[1]))
    return float((values - of_all * sd).max()), float((values + of_one * sd).max())


def _of_noise(weights: list[Array], draws: Array) -> float:
    """Return what an index of noise alone exceeds in one case of forty, by ``draws`` (d, p) of the noise.

    A further draw is above the quantile (d + 1) q in just that share of cases, however few the draws.
    """
    reached = [float(one @ draw) for one, draw in zip(weights, draws, strict=True)]
    return float(np.quantile(reached, ENDS[1], method="weibull"))


def _rms(value: float, heights: Array, covariance: Array, dof: float) -> Index:
    """Return FLTq, less what noise adds to its square: the mean of the variances."""
    from scipy.stats import norm, t

    count = len(heights)
    own = float((covariance**2).sum())
    spread = max(4.0 * float(heights @ covariance @ heights) - 2.0 * own, 2.0 * own)
    half = float(t.ppf(ENDS[1], dof) if np.isfinite(dof) else norm.ppf(ENDS[1])) * np.sqrt(spread) / count
    square = max(0.0, value**2 - float(np.trace(covariance)) / count)
    return lowered(value, np.sqrt(square), np.sqrt(max(0.0, square - half)), np.sqrt(square + half))
