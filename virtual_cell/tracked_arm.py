"""An arm of any geometry under a laser tracker: what its readings say, and where its point really is.

Frames are composed of rotations, pose by pose; gravity turns joints by the torques of bodies between them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

Array = np.ndarray
GRAVITY = 9.81  # m/s²
CENTRE = 0.4  # part of the way from a joint's end back to its start at which its body's mass is


@dataclass(frozen=True, eq=False)
class TrackedArm:
    """An arm with what it hides.

    Attributes
    ----------
    rows : (n, 5) true θ₀, α (rad), d, a (m), and a turn β about y behind each, rad.
    tool : (3,) m. masses : (n,) kg. compliance : (n,) rad/(N m) of the joints.
    turned : by joint from 0, coefficients (k, 2) of cos and sin of 1 … k times the angle, rad.
    lag : (n,) rad, half of what a joint stays behind on its way. base : rad/(N m), its tilt by the moment.
    growth : per kelvin, of the whole arm from its base. drift : (3,) m over the whole series.
    """

    rows: Array
    tool: Array
    masses: Array
    compliance: Array
    turned: Mapping[int, Array] = field(default_factory=dict)
    lag: Array | None = None
    base: float = 0.0
    growth: float = 0.0
    drift: Array | None = None

    def frames(self, q: Array) -> list[tuple[Rotation, Array]]:
        """Return rotations and origins before the first and after each joint, of angles (n,)."""
        turn, origin = Rotation.identity(), np.zeros(3)
        found = [(turn, origin)]
        for (theta, alpha, d, a, beta), angle in zip(self.rows, q, strict=True):
            about_z = turn * Rotation.from_rotvec([0.0, 0.0, theta + angle])
            origin = origin + turn.apply([0.0, 0.0, d]) + about_z.apply([a, 0.0, 0.0])
            turn = about_z * Rotation.from_rotvec([alpha, 0.0, 0.0]) * Rotation.from_rotvec([0.0, beta, 0.0])
            found.append((turn, origin))
        return found

    def true_angles(self, q: Array, came: Array, load: float = 0.0) -> Array:
        """Return where the joints really are, (n,), at readings (n,) approached from ``came`` (n,)."""
        angles = q.copy()
        for joint, coefficients in self.turned.items():
            orders = np.arange(1, len(coefficients) + 1) * q[joint]
            angles[joint] += np.sum(coefficients * np.column_stack([np.cos(orders), np.sin(orders)]))
        if self.lag is not None:
            angles = angles - self.lag * came
        return np.asarray(angles + self.compliance * self._torques(q, load)[1])

    def point(
        self, q: Array, came: Array, warmth: float = 0.0, part: float = 0.0, load: float = 0.0
    ) -> Array:
        """Return the point (3,) in the base, m.

        ``warmth`` in kelvin, ``part`` of the series that is over, ``load`` at the flange in kg.
        """
        turn, origin = self.frames(self.true_angles(q, came, load))[-1]
        at = origin + turn.apply(self.tool)
        if self.base:
            moment = self._torques(q, load)[0]
            at = at + self.base * np.cross([moment[0], moment[1], 0.0], at)
        at = at * (1.0 + self.growth * warmth)
        return np.asarray(at if self.drift is None else at + part * self.drift)

    def _torques(self, q: Array, load: float) -> tuple[Array, Array]:
        """Return the weights' moment about the base (3,), and their torques about the axes (n,), N m."""
        at = self.frames(q)
        own = [CENTRE * first[1] + (1.0 - CENTRE) * last[1] for first, last in pairwise(at)]
        centres = np.array([*own, at[-1][1]])
        weights = -GRAVITY * np.append(self.masses, load)[:, None] * [0.0, 0.0, 1.0]
        torques = [
            np.sum(np.cross(centres[joint:] - origin, weights[joint:]), axis=0) @ turn.apply([0.0, 0.0, 1.0])
            for joint, (turn, origin) in enumerate(at[:-1])
        ]
        return np.sum(np.cross(centres, weights), axis=0), np.array(torques)


def came_from(q: Array) -> Array:
    """Return the sign of each joint's last motion, (m, n); 0 before its first."""
    came, last = np.zeros_like(q), np.zeros(q.shape[1])
    for i in range(1, len(q)):
        step = q[i] - q[i - 1]
        last = np.where(step == 0.0, last, np.sign(step))
        came[i] = last
    return came


def tracked(
    arm: TrackedArm, q: Array, day: tuple[Array, ...], sigma: Array, rng: np.random.Generator
) -> Array:
    """Return what a tracker that stands anywhere sees of the point at readings (m, n): (m, 3), m.

    ``day``: of each pose how warm it is, (m,) K, which part of the series is over, (m,), and the load, (m,)
    kg. ``sigma``: (m,) standard deviation of a coordinate, m. Where the tracker stands is drawn first.
    """
    place = Rotation.from_euler("xyz", [rng.normal(0, 0.03), rng.normal(0, 0.03), rng.uniform(-3, 3)])
    foot, came = rng.normal(0, 2.0, 3), came_from(q)
    points = [arm.point(*each) for each in zip(q, came, *day, strict=True)]
    return np.asarray(place.apply(points) + foot + sigma[:, None] * rng.normal(size=(len(q), 3)))


def spanned(
    arm: TrackedArm,
    q: Array,
    day: tuple[Array, ...],
    *,
    stations: Array,
    sigma: Array,
    rng: np.random.Generator,
) -> Array:
    """Return the lengths (m, s), m, of wires from stations (s, 3) in the arm's base to the point.

    As for :func:`tracked`; ``sigma``: (m,) standard deviation of a length, m.
    """
    points = np.array([arm.point(*each) for each in zip(q, came_from(q), *day, strict=True)])
    lengths = np.linalg.norm(points[:, None] - stations, axis=2)
    return np.asarray(lengths + sigma[:, None] * rng.normal(size=lengths.shape))
