"""What the flange carries, from the torques of the joints: mass, centre of gravity, moments of inertia.

Torques are linear in the ten parameters of each link and of the load (Khalil & Dombre, Modeling,
Identification and Control of Robots, 2002, ch. 9). Those of the links are the same with and without the load
and are unknowns of their own, so that nothing has to be known of the arm but its geometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.kinematics import Geometry, prismatic
from metro.robot.rigid_body import PARAMETERS, torque_regressor
from metro.units import Array

TELLS = 1e-3  # least singular value over the greatest, of parameters scaled to a like size
STATIC = 4  # mass and its first moments: what torques at rest may determine


@dataclass(frozen=True, eq=False)
class Carried:
    """A load on the flange, in the flange's frame.

    Attributes
    ----------
    mass : kg. centre : (3,) m. inertia : (6,) kg m² about the centre, xx, xy, xz, yy, yz, zz; NaN if the
        torques do not determine them.
    covariance : (10, 10) of mass, centre and inertia; NaN where inertia is not identifiable.
    rms : (n,) N m, residual torque of each joint. dof : of the residuals.
    """

    mass: float
    centre: Array
    inertia: Array
    covariance: Array
    rms: Array
    dof: int


def identify_payload(
    dh: Geometry, q: Array, torque: Array, loaded: Array, motion: tuple[Array, Array] | None = None
) -> Carried:
    """Return the load from joint torques with and without it.

    Parameters
    ----------
    dh : of n joints. q : (m, n) rad (m of a linear axis). torque : (m, k) N m, of the motors of the k joints
        that turn, at the joints. loaded : (m,) whether the load is on the flange. motion : ``rate`` and
        ``acceleration``, (m, n) each, rad/s and rad/s²; None at rest.

    Raises
    ------
    ValueError
        If the samples do not determine mass and centre.

    Notes
    -----
    Each joint has an offset, and in motion a viscous and a Coulomb friction, of its own, as unknowns. Joints
    are weighted by what they leave (two steps). Errors are those of independent samples.
    """
    still, moving = np.zeros_like(q), motion is not None
    rate, acceleration = motion or (still, still)
    driven = ~prismatic(dh)
    regressor = torque_regressor(dh, q, rate, acceleration)[:, driven]
    own = regressor[..., -PARAMETERS:] * loaded[:, None, None]
    nuisance = np.concatenate([regressor, _friction(rate[:, driven], moving)], axis=-1)
    own = own if moving else own[..., :STATIC]
    values, covariance, left, dof = _weighted(own, nuisance, torque)
    if moving and values is None:
        values, covariance, left, dof = _weighted(own[..., :STATIC], nuisance, torque)
    if values is None:
        raise ValueError(
            "the poses do not determine mass and centre of gravity of the load: expected torques with and "
            "without it, in poses that tilt the flange in several directions"
        )
    return carried_of(values, covariance, left, dof)


def _friction(rate: Array, moving: bool) -> Array:
    """Columns (m, n, …) of each joint's offset and, in motion, viscous and Coulomb friction."""
    eye = np.eye(rate.shape[1])
    parts = [np.ones_like(rate), *((rate, np.sign(rate)) if moving else ())]
    return np.concatenate([part[..., None] * eye for part in parts], axis=-1)


def _weighted(own: Array, nuisance: Array, torque: Array) -> tuple[Array | None, Array, Array, int]:
    """Least squares weighted by joint: values, covariance, rms by joint; no values if not determined."""
    weight, values = np.ones(torque.shape[1]), None
    covariance, rms, dof = np.zeros((0, 0)), np.zeros(0), 0
    for _ in range(2):
        flat, others = ((part * weight[:, None]).reshape(torque.size, -1) for part in (own, nuisance))
        size, right = np.linalg.norm(flat, axis=0), (torque * weight).ravel()
        basis = _span(others)
        flat, right = flat - basis @ (basis.T @ flat), right - basis @ (basis.T @ right)
        if not (size > 0.0).all():
            return None, covariance, rms, dof
        spread = np.linalg.svd(flat / size, compute_uv=False)
        dof = len(right) - basis.shape[1] - flat.shape[1]
        if spread[-1] < TELLS * spread[0] or spread[0] < TELLS or dof < 1:
            return None, covariance, rms, dof
        inverse = np.linalg.pinv(flat / size) / size[:, None]
        values = inverse @ right
        left = (right - flat @ values).reshape(torque.shape)
        covariance = float(np.sum(left**2)) / dof * inverse @ inverse.T
        rms = np.sqrt(np.mean((left / weight) ** 2, axis=0))
        weight = 1.0 / np.maximum(rms, 1e-9 * max(float(rms.max()), 1e-12))
    return values, covariance, rms, dof


def _span(columns: Array) -> Array:
    """Orthonormal basis of the columns, (m, rank)."""
    size = np.linalg.norm(columns, axis=0)
    left, spread, _ = np.linalg.svd(columns[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    return np.asarray(left[:, spread > 1e-9 * spread[0]])


def carried_of(values: Array, covariance: Array, rms: Array, dof: int) -> Carried:
    """Turn mass, first moments and inertia about the flange's origin into those about the centre."""
    count = len(values)
    found, change = about_centre(values), np.empty((count, count))
    for k in range(count):
        step = 1e-6 * max(abs(values[k]), 1e-3)
        aside = step * np.eye(count)[k]
        change[:, k] = (about_centre(values + aside) - about_centre(values - aside)) / (2.0 * step)
    full = np.full((PARAMETERS, PARAMETERS), np.nan)
    full[:count, :count] = change @ covariance @ change.T
    inertia = found[STATIC:] if count == PARAMETERS else np.full(6, np.nan)
    return Carried(float(found[0]), found[1:STATIC], inertia, full, rms, dof)


def about_centre(values: Array) -> Array:
    """Mass, centre and (of ten) inertia about it, from mass, first moments and inertia about the origin."""
    mass, centre = values[0], values[1:STATIC] / values[0]
    if len(values) == STATIC:
        return np.concatenate([[mass], centre])
    x, y, z = centre
    steiner = mass * np.array([y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y])
    return np.concatenate([[mass], centre, values[STATIC:] - steiner])
