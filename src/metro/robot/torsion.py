"""How far the joints of an arm twist under a torque: springs that may harden, and a gap between gear teeth.

A joint's spring obeys T = k x + cubic x³ (stiffer the further it is twisted, as flexsplines and preloaded
bearings are); on top of it the joint passes half of its gap towards the side that the torque pushes it to.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from metro.units import Array

ZEROS, ONES = (0.0,) * 6, (1.0,) * 6
TURNING = 0.02  # of the largest torque: below it a joint is between the two ends of its gap


@dataclass(frozen=True)
class Torsion:
    """What the joints of an arm do beyond the linear springs of their compliances.

    Attributes
    ----------
    gap : (6,) whole gap, rad, in the cut alone (a static load has passed it before anything is read).
    cubic : (6,) hardening, N m/rad³, in the cut and under static loads.
    factor : (6,) stiffness in the cut relative to static loads.
    """

    gap: tuple[float, ...] = ZEROS
    cubic: tuple[float, ...] = ZEROS
    factor: tuple[float, ...] = ONES

    def with_joint(self, joint: int, *, gap: float = 0.0, cubic: float = 0.0, factor: float = 1.0) -> Torsion:
        """Return this with more gap and hardening of one joint (0 … 5), its stiffness times ``factor``."""
        by = np.arange(6) == joint
        return replace(
            self,
            gap=_tuple(np.array(self.gap) + gap * by),
            cubic=_tuple(np.array(self.cubic) + cubic * by),
            factor=_tuple(np.where(by, np.array(self.factor) * factor, self.factor)),
        )

    def in_cut(self, torque: Array, compliance: Array) -> tuple[Array, Array]:
        """Torsion (..., 6), rad, in the cut, and its derivative by the compliances, N m.

        Parameters
        ----------
        torque : (m, 6) on the links, N m, along one cut. compliance : (6,) of static loads, rad/(N m).
        """
        twist, slope = self.at_rest(torque / np.array(self.factor), compliance)
        return twist + passed(torque, np.array(self.gap)), slope

    def at_rest(self, torque: Array, compliance: Array) -> tuple[Array, Array]:
        """Torsion (..., 6), rad, under static loads, and its derivative by the compliances, N m."""
        if not any(self.cubic):
            return torque * compliance, torque
        cubic = np.array(self.cubic)
        twist = spring(torque, compliance, cubic)
        return twist, spring_slope(torque, twist, compliance, cubic)


def spring(torque: Array, compliance: Array, cubic: Array) -> Array:
    """Torsion x, rad, that balances T = x/c + cubic x³, in closed form.

    x + a x³ = c T with a = c · cubic has the one real root (2/√(3a)) sinh(⅓ arsinh(1.5 √(3a) c T)): Cardano's
    formula without its cancellation. A compliance below zero (a step of a fit) is a spring without hardening.

    Parameters
    ----------
    torque : (...) N m. compliance : rad/(N m). cubic : N m/rad³, none negative.
    """
    linear = np.asarray(torque * compliance)
    root = np.broadcast_to(np.sqrt(3.0 * np.maximum(compliance, 0.0) * cubic), linear.shape)
    hard = root > 0.0
    safe = np.where(hard, root, 1.0)
    return np.where(hard, 2.0 / safe * np.sinh(np.arcsinh(1.5 * safe * linear) / 3.0), linear)


def spring_slope(torque: Array, twist: Array, compliance: Array, cubic: Array) -> Array:
    """Slope of :func:`spring` in the compliance, N m: (T − cubic x³) / (1 + 3 c cubic x²)."""
    held = np.where(np.asarray(compliance) > 0.0, cubic, 0.0)
    return np.asarray((torque - held * twist**3) / (1.0 + 3.0 * compliance * held * twist**2))


def passed(torque: Array, gap: Array) -> Array:
    """How much of its gap each joint has passed, (m, 6), rad: half of it, to the side that the torque pushes.

    Parameters
    ----------
    torque : (m, 6) N m along one cut. gap : (6,) rad.
    """
    if not gap.any():
        return np.zeros_like(torque)
    largest = np.abs(torque).max(axis=0, initial=0.0)
    return np.asarray(0.5 * gap * np.tanh(torque / np.where(largest > 0.0, TURNING * largest, 1.0)))


def _tuple(values: Iterable[float]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
