"""Friction of an arm's joints, identified from a log of angles and motor torques.

A moving joint resists by τ = c sign(q̇) + v q̇ + o: Coulomb friction c, viscous friction v and the offset
o, which is half of what Coulomb friction is larger in one direction than in the other. A joint that stands
still resists by anything between −c and c, so such samples must not enter: with them Coulomb friction comes
out too small. What the links weigh and how they accelerate is fitted along (:mod:`metro.robot.rigid_body`).

Intervals are those of a jackknife over stretches of the log (Miller, Biometrika 61, 1974), since neighbouring
samples of a torque are not independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from metro.robot.determined import STRETCHES, solve
from metro.robot.kinematics import Geometry, prismatic
from metro.robot.motion import EDGE, PER_PERIOD, Motion, evenly
from metro.robot.rigid_body import gravity_regressor, torque_regressor
from metro.units import Array

WEIGHINGS = 3
LEAST_NOISE = 1e-6  # of a torque's spread: no joint outweighs the others without limit
TERMS = ("coulomb", "viscous", "offset")
IDLE_CUTOFF_HZ = 10.0


@dataclass(frozen=True, eq=False)
class Estimate:
    """Coefficients and their jackknife replicates, as they come from a fit of many columns.

    Attributes
    ----------
    value : (k,). others : (p,) of the columns beside them.
    replicates : (g, k) without one stretch each. known : (k,) whether the data determine it.
    residual : (m, n) of all samples, N m. noise : (n,) its rms where joints move.
    """

    value: Array
    others: Array
    replicates: Array
    known: np.ndarray
    residual: Array
    noise: Array

    def covariance(self, which: slice) -> Array:
        """Covariance of some coefficients: (g − 1)/g times the scatter of the replicates."""
        spread = self.replicates[:, which] - self.replicates[:, which].mean(axis=0)
        return np.asarray((len(spread) - 1) / len(spread) * spread.T @ spread)


@dataclass(frozen=True, eq=False)
class Friction:
    """Friction of n joints, N m and N m s/rad; NaN where the log does not determine it.

    Attributes
    ----------
    value : (n, 3) Coulomb, viscous, offset. sd : (n, 3) their standard errors. dof : of their t-intervals.
    others : (p,) coefficients of whatever else the torques hold, as weight.
    residual : (m, n) of the torques, N m. noise : (n,) its rms where joints move.
    forward, backward : (n,) bool, whether a joint turns that way fast enough at all.
    """

    value: Array
    sd: Array
    dof: int
    others: Array
    residual: Array
    noise: Array
    forward: np.ndarray
    backward: np.ndarray

    def interval(self, level: float = 0.95) -> Array:
        """Lower and upper end, (n, 3, 2), of Student's t-intervals."""
        from scipy.stats import t

        half = t.ppf(0.5 + level / 2, self.dof) * self.sd
        return np.stack([self.value - half, self.value + half], axis=-1)


@dataclass(frozen=True, eq=False)
class Curvature:
    """What the friction of n joints has beyond Coulomb and viscous: an odd curve of speed.

    Attributes
    ----------
    size : (n,) rms over the log of the curve beyond its best straight line, N m. sd : (n,) its standard
        error.
    f : (n,) F statistic of the two further terms. p : (n,) its probability if they were zero.
    """

    size: Array
    sd: Array
    f: Array
    p: Array


def of_idle_runs(dh: Geometry, runs: Sequence[tuple[Array, Array, Array]]) -> tuple[Friction, Motion]:
    """Identify the friction of idle runs, so slow that beside it the motors only carry the arm's weight.

    Joints that keep their direction throughout have no Coulomb friction of their own in such logs, since it
    is confounded with weight: theirs is NaN. Where a joint has just turned round, its gear still winds up and
    the filter still sees the step: these samples count as standstill.

    Parameters
    ----------
    dh : (n, 4). runs : time (m,) s, strictly rising, gaps are bridged; q, torque (m, n) measured, rad, N m.

    Returns
    -------
    tuple
        the friction, and the motion of all runs, one after the other, that it was identified from.

    Raises
    ------
    ValueError
        If no joint moves.
    """
    logs = [_settled(evenly(*run, IDLE_CUTOFF_HZ)) for run in runs]
    parts = {f.name: np.concatenate([getattr(log, f.name) for log in logs]) for f in fields(Motion)}
    log = Motion(**parts)
    # The drive of a linear axis is not evaluated: it counts as one that stands still.
    log = replace(log, moving=log.moving & ~prismatic(dh))
    return identify(log, weight_columns(dh, log)), log


def _settled(log: Motion) -> Motion:
    """Count a joint as moving only where it has moved, and goes on to move, for two periods of the filter."""
    from scipy.ndimage import binary_erosion

    around = np.ones((2 * int(EDGE * PER_PERIOD) + 1, 1))
    return replace(log, moving=binary_erosion(log.moving, around, border_value=1))


def rigid_columns(dh: Geometry, log: Motion) -> Array:
    """Columns (m, n, p) of rigid links and of each motor's own inertia."""
    links = torque_regressor(dh, log.angle, log.rate, log.acceleration)
    return np.concatenate([links, _of_its_own_joint(log.acceleration)], axis=-1)


def weight_columns(dh: Geometry, log: Motion) -> Array:
    """Columns (m, n, p) of the links' weight: enough where an arm moves slowly."""
    return gravity_regressor(dh, log.angle)


def identify(log: Motion, others: Array) -> Friction:
    """Identify Coulomb friction, viscous friction and offset of all joints at once.

    Parameters
    ----------
    others : (m, n, p) columns of whatever else the torques hold: weight, inertia, couplings.

    Raises
    ------
    ValueError
        If no joint moves.
    """
    fit = _fit(log, _friction_columns(log), others)
    n = log.rate.shape[1]
    own = slice(0, len(TERMS) * n)
    sd = np.sqrt(np.diag(fit.covariance(own)))
    value, sd = (np.where(fit.known[own], x, np.nan) for x in (fit.value[own], sd))
    shape = (len(TERMS), n)
    dof = len(fit.replicates) - 1
    ways = [np.asarray((log.moving & (sign * log.rate > 0)).any(axis=0)) for sign in (1, -1)]
    return Friction(
        value.reshape(shape).T, sd.reshape(shape).T, dof, fit.others, fit.residual, fit.noise, *ways
    )


def curvature(log: Motion, others: Array) -> Curvature:
    """Test whether friction bends with speed: F-test of two further odd terms per joint, and their size.

    The terms are sign(q̇) P₂(u) and sign(q̇) P₃(u), Legendre's polynomials of u = 2|q̇|/max − 1: what
    Coulomb and viscous friction leave of a Stribeck curve, or of a viscous friction that levels off.
    """
    from scipy.stats import f as f_distribution

    bends, n = _bends(log), log.rate.shape[1]
    fit = _fit(log, np.concatenate([bends, _friction_columns(log)], axis=-1), others)
    stretches, rows = len(fit.replicates), []
    for j in range(n):
        pair = slice(2 * j, 2 * j + 2)
        moving = log.moving[:, j]
        if not (moving.any() and fit.known[pair].all()):
            rows.append((math.nan,) * 4)
            continue
        curve = bends[moving, j, pair]
        line = np.column_stack([log.direction[moving, j], log.rate[moving, j]])
        curve = curve - line @ np.linalg.lstsq(line, curve, rcond=None)[0]
        gram = curve.T @ curve / len(curve)
        value, covariance = fit.value[pair], fit.covariance(pair)
        size = math.sqrt(value @ gram @ value)
        slope = gram @ value / size
        statistic = float(value @ np.linalg.solve(covariance, value)) / 2 * (stretches - 2) / (stretches - 1)
        chance = float(f_distribution.sf(statistic, 2, stretches - 2))
        rows.append((size, math.sqrt(slope @ covariance @ slope), statistic, chance))
    return Curvature(*np.array(rows).T)


def _friction_columns(log: Motion) -> Array:
    parts = (log.direction, log.rate, np.ones_like(log.rate))
    return np.concatenate([_of_its_own_joint(part) for part in parts], axis=-1)


def _bends(log: Motion) -> Array:
    """Further terms (m, n, 2 n): columns 2 j and 2 j + 1 are joint j's."""
    speed = np.where(log.moving, np.abs(log.rate), 0.0)
    u = 2.0 * speed / np.maximum(speed.max(axis=0), np.finfo(float).tiny) - 1.0
    terms = log.direction[..., None] * np.stack([(3 * u**2 - 1) / 2, (5 * u**3 - 3 * u) / 2], axis=-1)
    m, n = log.rate.shape
    columns = np.zeros((m, n, n, 2))
    columns[:, range(n), range(n)] = terms
    return columns.reshape(m, n, 2 * n)


def _of_its_own_joint(values: Array) -> Array:
    """Columns (m, n, n) that act on one joint each."""
    return np.asarray(values[:, :, None] * np.eye(values.shape[1]))


def _fit(log: Motion, own: Array, others: Array) -> Estimate:
    """Least squares over the samples of moving joints, each joint by its own noise."""
    if not log.moving.any():
        raise ValueError("no joint moves fast enough for its encoder to resolve the direction")
    columns = np.concatenate([own, others], axis=-1)
    spread = log.torque.std(axis=0)
    noise = spread = np.where(spread > 0, spread, 1.0)
    stretch = np.arange(len(columns)) * STRETCHES // len(columns)
    rows = np.broadcast_to(stretch[:, None], log.moving.shape)[log.moving]
    for _ in range(WEIGHINGS):
        weighted = (columns / noise[:, None])[log.moving]
        found = solve(weighted, (log.torque / noise)[log.moving], rows)
        residual = log.torque - columns @ found.value
        mean_square = np.sum(residual**2, axis=0, where=log.moving) / np.maximum(log.moving.sum(axis=0), 1)
        noise = np.maximum(np.sqrt(mean_square), LEAST_NOISE * spread)
    k = own.shape[-1]
    return Estimate(
        found.value[:k], found.value[k:], found.replicates[:, :k], found.known[:k], residual, noise
    )
