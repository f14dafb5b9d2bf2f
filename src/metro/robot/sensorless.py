"""The force on the tip, from what the motors carry in the cut beyond the idle run ([K] §3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from metro.signals import kalman, kalman_stretches
from metro.signals.intervals import uneven
from metro.signals.waves import variance as variance_of_waves
from metro.signals.waves import waves
from metro.units import Array

LEAST_INDEX = 2.0
LEAST_JOINTS = 3
SPARE = 0.02  # a joint that lowers the force's error by less may only add what its friction gets wrong
POOR = 30.0  # times the error of all joints: friction is repeatable to a few parts in a hundred
SINGULAR = 1e-12  # share of the largest eigenvalue of the information below which the least one is nothing
_PLACES = 25


@dataclass(frozen=True, eq=False)
class TipForce:
    """A force on the tip along the path.

    Attributes
    ----------
    force : (m, 3) N, frame of the Jacobian that was given.
    covariance : (m, 3, 3) N².
    condition : (m,) of the weighted system; the larger, the less well one direction of the force is known.
    used : (n,) joints that the force was solved from.
    solve : (m, 3, n) N/(N m): force = solve @ torque.
    """

    force: Array
    covariance: Array
    condition: Array
    used: np.ndarray
    solve: Array


@dataclass(frozen=True, eq=False)
class Torques:
    """The torque of the cut beyond the idle run, smoothed, of n joints over m bins of the path.

    Attributes
    ----------
    level, variance : (m, n) N m, N² m². noise, drift : (n,) R and Q.
    whiteness : (n,) probability of the innovations' autocorrelation in white noise.
    parts : stretches of bins over which the level wanders; between them it may jump.
    interval : (m - 1,) between the bins, over the median; None where all are even.
    """

    level: Array
    variance: Array
    noise: Array
    drift: Array
    whiteness: Array
    parts: tuple[slice, ...]
    interval: Array | None = None


def noise_of_bins(
    cut: Array,
    idle: Array,
    samples: tuple[float, float],
    turning: Array | None = None,
    intervals: tuple[Array | None, Array | None] = (None, None),
) -> Array:
    """R (n,), N² m², of the difference of two logs averaged over bins.

    The colour of the noise is that of the idle run, where nothing else happens; its size is each log's own,
    by the second differences: the cut shakes the arm as the idle run does not.

    Parameters
    ----------
    cut, idle : (m, n), (m', n) torques sample by sample. samples : in a bin, of the cut and of the idle run.
    turning : (m', n) sign of the joints' speeds in the idle run: friction steps where a joint turns round.
    intervals : of the two logs, where their clocks are not even.
    """
    of_cut, of_idle = (
        kalman.noise_variance(log, interval) for log, interval in zip((cut, idle), intervals, strict=True)
    )
    shaken = np.maximum(of_cut / of_idle, 1.0)
    coloured = kalman.long_run_variance(idle, turning, interval=intervals[1])
    return np.asarray(coloured * (shaken / samples[0] + 1.0 / samples[1]))


def smoothed_torque(
    difference: Array, noise: Array, phase: np.ndarray | None = None, place: Array | None = None
) -> Torques:
    """Smooth torques (m, n), N m, by the random walk whose drift is likeliest given their noise R (n,).

    Parameters
    ----------
    phase : (m,) int of the cut, odd where the tool enters or leaves the work: there the torque may do
        anything, and the walk starts anew behind (:mod:`metro.signals.kalman_stretches`).
    place : (m,) along the path, of logs whose clock is not even: where samples were lost, bins are missing,
        and the walk goes on without them.
    """
    parts = kalman_stretches.stretches(np.zeros(len(difference)) if phase is None else phase)
    interval = None if place is None else uneven(place)
    drift = kalman_stretches.likeliest_drift(difference, noise, parts, interval)
    innovations = kalman_stretches.innovations(difference, noise, drift, parts, interval)
    probability = kalman.whiteness(innovations, kalman.freedom_of_drift(noise, drift))
    smoothed = kalman_stretches.smooth(difference, noise, drift, parts, interval)
    return Torques(*smoothed, noise, drift, probability, parts, interval)


def observability(cutting: Array, idle: Array) -> Array:
    """Index PI = |mean τ_cutting| / (max τ_idle − min τ_idle) per joint, (n,) ([K] eq. 14).

    Parameters
    ----------
    cutting : (m, n) torque of the cut less that of the idle run, N m, over the stretch that is judged.
    idle : (m, n) torque of the idle run over the same stretch, N m.
    """
    return np.asarray(np.abs(cutting.mean(axis=0)) / np.ptp(idle, axis=0))


def choose_joints(
    jacobian_at_tip: Array, variance: Array, index: Array, least: float = LEAST_INDEX
) -> np.ndarray:
    """Choose the joints (n,) that the force is solved from.

    Of all sets of at least three joints that pass the index, the smallest whose error of the force (root of
    the trace of its covariance, mean of the path) is within 2 % of the least. With true variances every
    further joint lowers the error, so the least is that of all joints together; ill-conditioned sets have
    large errors and lose.

    Parameters
    ----------
    jacobian_at_tip : (m, 3, n). variance : (m, n) of the torques. index : (n,) of :func:`observability`.
    least : index that a joint needs.

    Raises
    ------
    ValueError
        If fewer than three joints pass, or no three of them determine the three axes, or only 30 times
        worse than all joints do.
    """
    passing = np.flatnonzero(index >= least)
    if len(passing) < LEAST_JOINTS:
        raise ValueError(
            f"only {len(passing)} of {len(index)} joints reach the observability index {least:g}; "
            f"at least {LEAST_JOINTS} are needed"
        )
    places = np.unique(np.linspace(0, len(variance) - 1, _PLACES).astype(int))
    part = np.einsum("min,mjn,mn->nmij", *2 * (jacobian_at_tip[places],), 1 / variance[places])
    sizes = range(LEAST_JOINTS, len(passing) + 1)
    sets = np.array([np.isin(range(len(index)), c) for size in sizes for c in combinations(passing, size)])
    values = np.linalg.eigvalsh(np.tensordot(sets.astype(float), part, axes=1))
    singular = (values[..., 0] <= SINGULAR * values[..., -1]).any(axis=1)
    named = f"joints {', '.join(str(j + 1) for j in passing)}"
    if singular.all():
        raise ValueError(f"{named} do not determine all three axes")
    errors = np.full(len(sets), np.inf)
    errors[~singular] = np.sqrt((1.0 / values[~singular]).sum(axis=-1).mean(axis=-1))
    of_all = np.sqrt((1.0 / np.linalg.eigvalsh(part.sum(axis=0))).sum(axis=-1).mean())
    if errors.min() > POOR * of_all:
        raise ValueError(
            f"{named}, which reach the observability index {least:g}, leave an axis of the force open: "
            f"its error is {errors.min() / of_all:.0f} times that of all joints"
        )
    enough = errors <= (1 + SPARE) * errors.min()
    fewest = enough & (sets.sum(axis=1) == sets[enough].sum(axis=1).min())
    return np.asarray(sets[np.argmin(np.where(fewest, errors, np.inf))])


def tip_force(
    torque: Array, variance: Array, jacobian_at_tip: Array, index: Array, least: float = LEAST_INDEX
) -> TipForce:
    """Solve τ = −Jᵀ f for the force, by weighted least squares over the joints of :func:`choose_joints`.

    Parameters
    ----------
    torque : (m, n) torque of the cut less that of the idle run, N m.
    variance : (m, n) its variance.
    jacobian_at_tip : (m, 3, n). index : (n,) of :func:`observability`. least : that a joint needs.

    Raises
    ------
    ValueError
        If fewer than three joints pass, or those that do cannot determine the three axes.
    """
    use = choose_joints(jacobian_at_tip, variance, index, least)
    weighted = jacobian_at_tip * use / variance[:, None, :]
    values, axes = np.linalg.eigh(weighted @ np.swapaxes(jacobian_at_tip, 1, 2))
    covariance = (axes / values[:, None, :]) @ np.swapaxes(axes, 1, 2)
    solve = -covariance @ weighted
    force: Array = np.einsum("mai,mi->ma", solve, torque)
    return TipForce(force, covariance, np.sqrt(values[:, -1] / values[:, 0]), use, solve)


def beyond_noise(variance: Array, repeatability: Array, wander: Array) -> Array:
    """Variance (m, n), N² m², of torques as measures of the force, from that (m, n) of their smoothed levels.

    The smoother knows the white noise alone. Friction that is not that of the idle run, ``repeatability``
    (n,) N m, adds its square, and slow noise of level ``wander`` (n,) N² m², whose waves i have the variance
    wander / i, adds the mean of their sum at a place, wander · Σ 1/i / m.
    """
    count = len(variance)
    slow = wander * float((1.0 / np.arange(1, count)).sum()) / count
    return np.asarray(variance + repeatability**2 + slow)


def friction_repeatability(air: Array, variance: Array, least: Array) -> Array:
    """How well the friction of a cut is that of its idle run (n,), N m, by the torques in the air.

    Where no force acts the two logs differ by noise and friction alone. One run's friction is one draw: the
    mean square over the runs is its variance and that of the noise. It is widened by Student's quantile for
    as many runs over the normal one, so that intervals of 1.96 of it hold the truth as often as they say.

    Parameters
    ----------
    air : (r, n) mean over the air of each of r runs, cut less idle run. variance : (r, n) of these means by
        the noise. least : (n,) which it does not fall below.
    """
    from scipy.special import stdtrit

    wider = float(stdtrit(len(air), 0.975)) / 1.96
    square = (wider**2 * air**2 - variance).mean(axis=0)
    return np.asarray(np.sqrt(np.maximum(square, least**2)))


def drive_shares(tip_force: TipForce, torques: Torques, steady: np.ndarray) -> Array:
    """Return what the torque of each joint adds to the mean force over bins ``steady``, (3, n) N.

    Drive constants that are off by the relative errors e move the mean by these times e.
    """
    return np.asarray(np.einsum("mai,mi->mai", tip_force.solve, torques.level)[steady].mean(axis=0))


def mean_force(
    tip_force: TipForce,
    torques: Torques,
    steady: np.ndarray,
    repeatability: Array | float = 0.0,
    wander: Array | float = 0.0,
) -> tuple[Array, Array]:
    """Mean (3,) of the force over bins ``steady`` (m,) bool, N, and its covariance (3, 3), N².

    Neighbouring levels of a smoothed torque share their error: the covariance is that of the sum.
    ``repeatability`` (n,) N m is how well the friction of the cut is that of the idle run, the same all
    along; ``wander`` (n,) N² m² the level of the slow noise that changes along the path
    (:mod:`metro.signals.waves`), which the smoother takes for the cut's.
    """
    weights = np.where(steady[:, None, None], tip_force.solve, 0.0) / steady.sum()
    covariance = kalman_stretches.combined_covariance(
        np.moveaxis(weights, 1, 0), torques.noise, torques.drift, torques.parts, torques.interval
    )
    common = weights.sum(axis=0) * repeatability
    slow = waves(weights)
    spread = variance_of_waves(len(weights), np.zeros(1), np.broadcast_to(wander, weights.shape[2]))
    covariance = covariance + np.einsum("man,mn,mbn->ab", slow[1:], spread[1:], slow[1:])
    return tip_force.force[steady].mean(axis=0), covariance + common @ common.T
