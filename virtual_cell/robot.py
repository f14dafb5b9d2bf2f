"""A robot on a straight path: what its joints do, what its controller logs, where its tip really is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.noise import quantised, sensor_noise
from virtual_cell.units import DEG, MM, Array

_PERIOD = 0.012  # s, of the log
_NODE = 1.0 * MM  # spacing of the inverse kinematics along the path


@dataclass(frozen=True)
class Drives:
    """Joint drives: friction, tracking and noise, each (6,) where not said otherwise.

    ``coulomb`` N m, ``viscous`` N m s/rad; ``lag`` of tracking, s; ``reversal`` tracking error after a joint
    turns round, rad; ``ripple`` of tracking, rad, and its ``ripple_order`` per radian; ``torque_noise`` N m.
    """

    coulomb: Array
    viscous: Array
    lag: float
    reversal: Array
    ripple: Array
    ripple_order: Array
    torque_noise: float


@dataclass(frozen=True)
class Path:
    """A straight path in the work frame at constant speed, as joint angles.

    ``s`` (m,) length, m, along the path from its start; ``q`` (m, 6), rad; ``position`` (m, 3) of the tip,
    base frame, m.
    """

    speed: float
    s: Array
    q: Array
    position: Array

    def at(self, s: Array) -> Array:
        """Joint angles (n, 6) at lengths ``s``."""
        from scipy.interpolate import CubicSpline

        angles: Array = CubicSpline(self.s, self.q)(s)
        return angles

    def rate(self, s: Array) -> Array:
        """Joint speeds (n, 6), rad/s, at lengths ``s``."""
        from scipy.interpolate import CubicSpline

        rates: Array = CubicSpline(self.s, self.q).derivative()(s) * self.speed
        return rates


def straight_path(arm: Arm, ends: tuple[Array, Array], axes: Array, speed: float, start: Array) -> Path:
    """Path between two tip positions (base frame, m), fixed tool axes, from joint angles near ``start``."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    s = np.linspace(0.0, length, round(length / _NODE) + 1)
    position = ends[0] + np.outer(s / length, ends[1] - ends[0])
    return Path(speed, s, arm.follow(position, axes, start), position)


def tracking(drives: Drives, path: Path, s: Array) -> Array:
    """Tracking errors (n, 6), rad, of every pass: lag, ripple of the gears, a bump after each reversal."""
    q, rate = path.at(s), path.rate(s)
    error = -rate * drives.lag + drives.ripple * np.sin(drives.ripple_order * q)
    nodes = path.rate(path.s)
    for joint in range(6):
        for turn in np.nonzero(np.diff(np.sign(nodes[:, joint])))[0]:
            after = np.maximum((s - path.s[turn]) / (4.0 * MM), 0.0)
            error[:, joint] -= (
                np.sign(nodes[turn + 1, joint]) * drives.reversal[joint] * after * np.exp(1.0 - after)
            )
    return error


def tip_error(arm: Arm, drives: Drives, path: Path, s: Array) -> Array:
    """Displacement (n, 3), m, base frame, of the tip by the tracking errors, by exact kinematics."""
    wanted, error = path.at(s), tracking(drives, path, s)
    return np.array([arm.pose(q + e)[0] - arm.pose(q)[0] for q, e in zip(wanted, error, strict=True)])


def log(
    arm: Arm,
    drives: Drives,
    path: Path,
    force: Callable[[Array], Array] | None,
    rng: np.random.Generator,
    *,
    begin: float,
) -> dict[str, Array]:
    """Return the controller's log of one pass, columns of the contract.

    ``force(s)`` (n, 3), N, base frame, acts on the tip at lengths ``s``; None in an idle run. The log starts
    at length ``begin`` (m) of the path and ends at its end.
    """
    count = int((path.s[-1] - begin) / path.speed / _PERIOD)
    t = np.arange(count) * _PERIOD
    s = begin + t * path.speed
    wanted, rate = path.at(s), path.rate(s)
    error = tracking(drives, path, s) + rng.normal(0.0, 2e-6, (count, 6))
    friction = drives.coulomb * np.tanh(rate / 2e-4) + drives.viscous * rate
    torque = np.array([arm.gravity(q) for q in wanted]) + friction
    if force is not None:
        loads = force(s)
        torque -= np.array([arm.jacobian(q)[:3].T @ f for q, f in zip(wanted, loads, strict=True)])
    torque += np.stack([sensor_noise(count, drives.torque_noise, rng) for _ in range(6)], axis=1)
    columns = {"t_s": t}
    columns |= {f"q{i}_set_deg": wanted[:, i - 1] / DEG for i in range(1, 7)}
    columns |= {f"q{i}_deg": quantised((wanted + error)[:, i - 1] / DEG, 1e-5) for i in range(1, 7)}
    return columns | {f"tau{i}_nm": quantised(torque[:, i - 1], 0.1) for i in range(1, 7)}
