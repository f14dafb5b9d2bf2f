"""What the flange carries, from logs with and without it, with the uncertainty of the drives in it.

Of two logs of one motion the torques are subtracted: the arm and its friction cancel, and the difference is
the load's, τ₂ − τ₁ = (1 + ε_j) Y_j π + friction that the load changes. The relative errors ε of the joints'
drive constants are unknowns with a prior: what the constants share scales mass and moments alike, and no log
of currents can show it; what they do not share shows in the joints' disagreement on one load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.robot.determined import STRETCHES, solve
from metro.robot.kinematics import Geometry
from metro.robot.motion import Motion
from metro.robot.payload_identification import STATIC, TELLS, Carried, carried_of
from metro.robot.rigid_body import PARAMETERS, torque_regressor
from metro.robot.same_motion import Pair
from metro.units import Array

ITERATIONS = 8
MANY = 10**6  # apart are the numbers of the stretches of different pairs
SCATTERS = np.linspace(0.0, 0.4, 81)  # no constant is wrong by more than a few of the largest
LEAST_ERROR = 1e-6  # relative, of a drive constant: a prior of nothing has no inverse


@dataclass(frozen=True, eq=False)
class Load:
    """A load, and how the joints agree on it.

    Attributes
    ----------
    carried : mass, centre, inertia with a covariance that holds noise, friction and drives.
    values : mass, first moments and, where they are determined, moments of inertia about the flange's origin.
    sd_of_logs : of the mass by noise and friction alone, kg.
    by_joint : (n, 2) factor of the load that fits each joint alone best, and its standard error; NaN of a
        joint that says nothing.
    scatter : relative standard deviation of the drive constants from joint to joint, beyond what is declared.
    """

    carried: Carried
    values: Array
    sd_of_logs: float
    by_joint: Array
    scatter: float


@dataclass(frozen=True, eq=False)
class _Joint:
    """Least squares of one joint, its friction projected out: normal matrix, right side, samples."""

    normal: Array
    right: Array
    own: Array
    torque: Array
    stretch: np.ndarray


def carried_load(evidence: Sequence[Sequence[Evidence]], drives: Array) -> Load:
    """Return the load that logs show, by joints.

    Parameters
    ----------
    evidence : of each of n joints what :func:`of_pair` or :func:`of_logs` made of its logs; empty of a joint
        that determines nothing. drives : (n, n) covariance of the relative errors of the drive constants.

    Raises
    ------
    ValueError
        If the motion does not determine mass and centre of gravity.
    """
    joints = np.array([j for j, parts in enumerate(evidence) if parts], dtype=int)
    if not len(joints):
        raise ValueError("no joint moves fast enough for its encoder to resolve the direction")
    parts = [_joint(evidence[j]) for j in joints]
    size = np.sqrt(np.maximum(sum(np.diag(part.normal) for part in parts), np.finfo(float).tiny))
    kept = next((k for k in (PARAMETERS, STATIC) if _told(parts, size, k)), 0)
    if not kept:
        raise ValueError(
            "the motion does not determine mass and centre of gravity of the load: expected one that tilts "
            "the flange in several directions"
        )
    parts = [_cut(part, kept) for part in parts]
    covariance = drives[np.ix_(joints, joints)]
    noise = np.ones(len(parts))
    values, agree, scatter = np.zeros(kept), np.full((len(parts), 2), np.nan), 0.0
    total = np.zeros((kept, kept))
    for _ in range(ITERATIONS):
        prior = covariance + (scatter**2 + LEAST_ERROR**2) * np.eye(len(parts))
        values, total = _solve(parts, noise, prior, values)
        noise = np.array([_noise(part, values) for part in parts])
        agree = np.array([_alone(part, values, s) for part, s in zip(parts, noise, strict=True)])
        scatter = _scatter(parts, noise, covariance, values)
    alone = _solve(parts, noise, LEAST_ERROR**2 * np.eye(len(parts)), values)[1]
    by_joint, rms = np.full((len(evidence), 2), np.nan), np.full(len(evidence), np.nan)
    by_joint[joints] = agree
    rms[joints] = [np.sqrt(np.mean((part.torque - part.own @ values) ** 2)) for part in parts]
    return Load(
        carried_of(values, total, rms, STRETCHES - 1), values, float(np.sqrt(alone[0, 0])), by_joint, scatter
    )


@dataclass(frozen=True, eq=False)
class Evidence:
    """What logs say of the load at one joint, at m samples in which it moves.

    ``own`` (m, 10) torque per unit of the load's parameters; ``others`` (m, k) of all else that the torque
    may hold; ``torque`` (m,) N m; ``stretch`` (m,) int.
    """

    own: Array
    others: Array
    torque: Array
    stretch: np.ndarray


def of_pair(dh: Geometry, pair: Pair, joint: int) -> list[Evidence]:
    """Return what two logs of one motion say: the difference of their torques.

    What the load changes of the joint's friction is unknown: an offset, Coulomb and viscous friction, and
    friction in proportion to the torque that the gear carries, by the change of that torque's magnitude from
    the one log to the other, the friction of the first log taken away.
    """
    links = torque_regressor(dh, pair.angle, pair.rate, pair.acceleration)[:, joint]
    first, second = pair.first[:, joint], pair.second[:, joint]
    sign, stretch = pair.direction[:, joint], np.arange(len(links)) * STRETCHES // len(links)
    friction = np.column_stack([sign, pair.rate[:, joint], np.ones_like(sign)])
    moving = pair.moving[:, joint]
    if not moving.any():
        return []
    columns = np.column_stack([friction, pair.acceleration[:, joint], links])[moving]
    rubs = friction @ solve(columns, first[moving], stretch[moving]).value[:3]
    loaded = sign * (np.abs(second - rubs) - np.abs(first - rubs))
    others = np.column_stack([friction, loaded])
    own = links[:, -PARAMETERS:]
    return [Evidence(own[moving], others[moving], (second - first)[moving], stretch[moving])]


def of_logs(dh: Geometry, logs: Sequence[Motion], loaded: Sequence[bool], joint: int) -> list[Evidence]:
    """Return what logs of different motions say: the links' parameters are those of all, and are unknown.

    Each log has an offset, Coulomb and viscous friction of its own.
    """
    owns, links, rubs, torques, stretches = [], [], [], [], []
    for k, (log, has) in enumerate(zip(logs, loaded, strict=True)):
        moving = log.moving[:, joint]
        rows = torque_regressor(dh, log.angle, log.rate, log.acceleration)[moving, joint]
        sign, rate = log.direction[moving, joint], log.rate[moving, joint]
        friction = np.zeros((len(rows), 3 * len(logs)))
        friction[:, 3 * k : 3 * k + 3] = np.column_stack([sign, rate, np.ones_like(sign)])
        owns.append(rows[:, -PARAMETERS:] * float(has))
        links.append(np.column_stack([log.acceleration[moving, joint], rows]))
        rubs.append(friction)
        torques.append(log.torque[moving, joint])
        count = len(log.angle)
        stretches.append((np.arange(count) * STRETCHES // count)[moving] + k * STRETCHES)
    if not sum(map(len, torques)):
        return []
    others = np.column_stack([np.concatenate(links), np.concatenate(rubs)])
    return [Evidence(np.concatenate(owns), others, np.concatenate(torques), np.concatenate(stretches))]


def _joint(evidence: Sequence[Evidence]) -> _Joint:
    """Project all but the load out of the torques of a joint."""
    owns, torques, stretches = [], [], []
    for k, part in enumerate(evidence):
        size = np.linalg.norm(part.others, axis=0)
        basis = _basis(part.others[:, size > 0.0] / size[size > 0.0])
        own, torque = (each - basis @ (basis.T @ each) for each in (part.own, part.torque))
        owns.append(own)
        torques.append(torque)
        stretches.append(part.stretch + k * MANY)
    own, torque = np.concatenate(owns), np.concatenate(torques)
    return _Joint(own.T @ own, own.T @ torque, own, torque, np.concatenate(stretches))


def _basis(columns: Array) -> Array:
    left, spread, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, spread > 1e-9 * max(float(spread.max(initial=0.0)), 1e-300)])


def _told(parts: Sequence[_Joint], size: Array, kept: int) -> bool:
    """Return whether the first ``kept`` parameters are determined, scaled to a like size."""
    normal = sum(part.normal[:kept, :kept] for part in parts) / np.outer(size[:kept], size[:kept])
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(normal), 0.0))
    return bool(spread[0] > TELLS * spread[-1])


def _cut(part: _Joint, kept: int) -> _Joint:
    own = part.own[:, :kept]
    return _Joint(own.T @ own, own.T @ part.torque, own, part.torque, part.stretch)


def _solve(parts: Sequence[_Joint], noise: Array, prior: Array, about: Array) -> tuple[Array, Array]:
    """Values (k,) of the load and their covariance, the errors of the drives integrated out.

    Generalised least squares: the error of a drive moves its joint's torque along that of the load ``about``
    (k,), as it is known so far; of a load of nothing, not at all.
    """
    k = len(about)
    information, score = _normal(parts, noise, about)
    information[k:, k:] += np.linalg.inv(prior)
    scale = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    return (covariance @ score)[:k], covariance[:k, :k]


def _normal(parts: Sequence[_Joint], noise: Array, about: Array) -> tuple[Array, Array]:
    """Return the normal equations of load (k,) and errors of the drives, without what is known of these."""
    k = len(about)
    information, score = np.zeros((k + len(parts),) * 2), np.zeros(k + len(parts))
    for j, (part, s) in enumerate(zip(parts, noise, strict=True), start=k):
        pulled = part.normal @ about / s
        information[:k, :k] += part.normal / s
        information[:k, j] += pulled
        information[j, :k] += pulled
        information[j, j] += about @ pulled
        score[:k] += part.right / s
        score[j] += about @ part.right / s
    return information, score


def _noise(part: _Joint, values: Array) -> float:
    """Variance of a joint's torque that makes independent samples of what stretches scatter by.

    Neighbouring residuals are not independent: the scores of stretches scatter more than white noise of the
    residuals' size would make them, by a factor that is the mean over what the joint determines. What the
    drive's constant is wrong by is no noise.
    """
    factor, _ = _alone(part, values, 1.0)
    left = part.torque - np.nan_to_num(factor) * part.own @ values
    spread, turn = np.linalg.eigh(part.normal)
    kept = spread > 1e-9 * spread[-1]
    white = part.own @ (turn[:, kept] / np.sqrt(spread[kept]))
    scores = np.array([white[part.stretch == g].T @ left[part.stretch == g] for g in np.unique(part.stretch)])
    scattered = float(np.mean(np.sum(scores**2, axis=0))) * len(scores) / max(len(scores) - 1, 1)
    return max(scattered, float(np.mean(left**2)), np.finfo(float).tiny)


def _alone(part: _Joint, values: Array, noise: float) -> tuple[float, float]:
    """Return the factor of a load that fits a joint alone, and its error."""
    size = float(values @ part.normal @ values)
    if not size > 0.0:
        return np.nan, np.nan
    return float(values @ part.right) / size, float(np.sqrt(noise / size))


def _scatter(parts: Sequence[_Joint], noise: Array, declared: Array, about: Array) -> float:
    """Return the standard deviation of the drives' errors from joint to joint, beyond what is declared.

    It is the root of its mean square over the restricted likelihood (Patterson & Thompson, Biometrika 58,
    1971), flat before: the load, which joints that do not agree would bend, is integrated out.
    """
    information, score = _normal(parts, noise, about)
    k, count = len(about), len(parts)
    size = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    size[k:] = 1.0
    logarithm = []
    for spread in SCATTERS:
        prior = declared + (spread**2 + LEAST_ERROR**2) * np.eye(count)
        whole = information.copy()
        whole[k:, k:] += np.linalg.inv(prior)
        whole /= np.outer(size, size)
        explained = (score / size) @ np.linalg.solve(whole, score / size)
        determinants = np.linalg.slogdet(prior)[1] + np.linalg.slogdet(whole)[1]
        logarithm.append(0.5 * (explained - determinants))
    weight = np.exp(np.array(logarithm) - max(logarithm))
    return float(np.sqrt(weight @ SCATTERS**2 / weight.sum()))
