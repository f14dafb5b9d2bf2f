"""What a log of an arm that moves freely says of each joint: friction, the weight it holds, its inertia.

Each joint is fitted on its own, τ = rigid links + I_m q̈ + c sign(q̇) + v q̇ + o (:mod:`metro.robot.friction`),
so that the error of one drive constant does not reach another joint, and a log of currents without any
constants says as much, in amperes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.determined import STRETCHES, Determined, solve
from metro.robot.friction_terms import Samples, Term, further_terms
from metro.robot.kinematics import Geometry
from metro.robot.motion import BANDWIDTH, Motion, even_clock, evenly
from metro.robot.rigid_body import torque_regressor
from metro.units import Array

OWN = 4  # columns beside the links: Coulomb, viscous, offset, the motor's inertia
POWER = 0.999  # share of the speeds' power below the frequency that the motion reaches
ABOVE = (
    10.0  # times that frequency: the edges of a friction that changes its sign are steeper than the motion
)
SHORTEST = 32  # samples: fewer are no course to filter
CUTOFF_HZ = (
    2.0,
    10.0,
)  # at least, since few periods make no spectrum; at most, since accelerations are noise


@dataclass(frozen=True, eq=False)
class JointFit:
    """What a log says of one joint; N m (or A, of a log of currents), pairs of value and standard error.

    Attributes
    ----------
    joint : from 0. coulomb, viscous, offset : of the friction.
    gravity : greatest torque of the links' weight within the log; inertia : about the joint's own axis in the
        log's middle pose, kg m². NaN where the log does not determine it.
    noise : rms of the residual where the joint moves. swing : range of the torque.
    fastest : rad/s. moving : share of the samples in which it moves.
    determined : how many combinations of the links' parameters the joint's torque determines; condition : of
        all columns that it was fitted to.
    ways : whether it turns forward, and backward. terms : what friction has beyond Coulomb and viscous.
    speed, resists : (k,) of the samples in which it moves: speed, rad/s, and torque less that of the links.
    """

    joint: int
    coulomb: tuple[float, float]
    viscous: tuple[float, float]
    offset: tuple[float, float]
    gravity: tuple[float, float]
    inertia: tuple[float, float]
    noise: float
    swing: float
    fastest: float
    moving: float
    determined: int
    condition: float
    ways: tuple[bool, bool]
    terms: tuple[Term, ...]
    speed: Array
    resists: Array


def free_motion(time: Array, q: Array, torque: Array) -> Motion:
    """Filter a log, (m,) s and (m, n) rad, N m or A, as low as its motion and the edges of friction allow."""
    return evenly(time, q, torque, cutoff(time, q), filtered=True)


def low_passed(time: Array, q: Array) -> Array:
    """Angles (m, n) of a log without what lies above its motion, at its own times (m,)."""
    from scipy.signal import butter, sosfiltfilt

    even, period = even_clock(time)
    angle = np.array([np.interp(even, time, column) for column in q.T])
    filter_ = butter(4, min(cutoff(time, q), BANDWIDTH / period), fs=1 / period, output="sos")
    smooth = sosfiltfilt(filter_, angle, axis=1) if len(even) > SHORTEST else angle
    return np.array([np.interp(time, even, column) for column in smooth]).T


def cutoff(time: Array, q: Array) -> float:
    """Return the cut-off, Hz, that keeps the motion of a log: ten times the frequency that it reaches."""
    even, period = even_clock(time)
    rate = np.gradient(np.array([np.interp(even, time, column) for column in q.T]), period, axis=1)
    power = (np.abs(np.fft.rfft(rate - rate.mean(axis=1, keepdims=True), axis=1)) ** 2).sum(axis=0)
    reached = np.fft.rfftfreq(len(even), period)[np.searchsorted(np.cumsum(power), POWER * power.sum())]
    return float(np.clip(ABOVE * reached, *CUTOFF_HZ))


def fit_joints(
    dh: Geometry, log: Motion, driven: np.ndarray, warmth: Array | None = None
) -> tuple[JointFit, ...]:
    """Fit every joint of a log that has a torque and moves.

    Parameters
    ----------
    dh : geometry of the arm. driven : (n,) bool, the joints whose torque was logged.
    warmth : (m, n) °C of the joints, NaN of one whose temperature was not logged; None without any.
    """
    links = torque_regressor(dh, log.angle, log.rate, log.acceleration)
    weight = torque_regressor(dh, log.angle, 0 * log.rate, 0 * log.rate)
    middle = np.median(log.angle, axis=0)[None]
    still, fits = np.zeros_like(middle), []
    for joint in np.flatnonzero(driven & log.moving.any(axis=0)):
        unit = np.eye(len(driven))[[joint]]
        turned = torque_regressor(dh, middle, still, unit) - torque_regressor(dh, middle, still, still)
        functions = weight[:, joint], turned[0, joint]
        fits.append(_fit(log, samples(log, links, int(joint), warmth), functions, int(joint)))
    return tuple(fits)


def samples(log: Motion, links: Array, joint: int, warmth: Array | None = None) -> Samples:
    """Return the moving samples of a joint of a log; ``links`` (m, n, p) are the columns of the links."""
    moving = log.moving[:, joint]
    rate = log.rate[:, joint]
    own = [log.direction[:, joint], rate, np.ones_like(rate), log.acceleration[:, joint]]
    columns = np.column_stack([*own, links[:, joint]])
    stretch = np.arange(len(columns)) * STRETCHES // len(columns)
    warm = None if warmth is None or not np.isfinite(warmth[:, joint]).all() else warmth[moving, joint]
    of_links = slice(OWN - 1, columns.shape[1])
    torque = log.torque[moving, joint]
    return Samples(columns[moving], torque, stretch[moving], of_links, rate[moving], warm)


def _fit(log: Motion, of: Samples, functions: tuple[Array, Array], joint: int) -> JointFit:
    weight, turned = functions
    columns, torque, rate = of.columns, of.torque, of.rate
    found = solve(columns, torque, of.stretch)
    rigid = columns[:, of.links] @ found.value[of.links]
    left = torque - columns @ found.value
    heaviest = int(np.argmax(np.abs(weight @ found.value[OWN:])))
    terms = further_terms(of)
    alone = np.eye(columns.shape[1])
    gravity = found.combination(np.concatenate([np.zeros(OWN), weight[heaviest]]))
    inertia = found.combination(np.concatenate([alone[OWN - 1, :OWN], turned]))
    return JointFit(
        joint=joint,
        coulomb=found.combination(alone[0]),
        viscous=found.combination(alone[1]),
        offset=found.combination(alone[2]),
        gravity=gravity,
        inertia=inertia,
        noise=float(np.sqrt(np.mean(left**2))),
        swing=float(np.ptp(log.torque[:, joint])),
        fastest=float(np.abs(rate).max()),
        moving=float(log.moving[:, joint].mean()),
        determined=max(len(found.spread) - _own_rank(found), 0),
        condition=found.condition,
        ways=(bool((rate > 0).any()), bool((rate < 0).any())),
        terms=terms,
        speed=rate,
        resists=torque - rigid,
    )


def _own_rank(found: Determined) -> int:
    """Return how many of friction's three coefficients are determined."""
    return int(found.known[: OWN - 1].sum())
