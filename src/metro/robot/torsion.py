"""How far the joints of an arm twist under a torque: springs that may harden, and a gap between gear teeth.

A joint's spring obeys T = k x + cubic x³ (stiffer the further it is twisted, as flexsplines and preloaded
bearings are), in series with what stays straight (its link, its seat). On top of it the joint passes half of
its gap towards the side that the torque pushes it to, where that overcomes the drag beyond the gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from metro.robot.by_joint import of_joints, put, raised, scaled
from metro.units import Array

TURNING = 0.02  # of the largest torque: below it a joint is between the two ends of its gap


class Twist(NamedTuple):
    """Twist of joints, (..., n) rad, and its slopes by their compliances, N m, and straight shares, rad."""

    angle: Array
    by_compliance: Array
    by_straight: Array


@dataclass(frozen=True)
class Torsion:
    """What the joints of an arm do beyond the linear springs of their compliances.

    Joints beyond an entry have no gap and no hardening, and the stiffness of static loads.

    Attributes
    ----------
    gap : whole gap, rad, in the cut alone (a static load has passed it before anything is read).
    drag : torque, N m, that holds a link within its gap.
    cubic : hardening, N m/rad³, in the cut and under static loads.
    factor : stiffness in the cut relative to static loads.
    """

    gap: tuple[float, ...] = ()
    drag: tuple[float, ...] = ()
    cubic: tuple[float, ...] = ()
    factor: tuple[float, ...] = ()

    def with_joint(
        self, joint: int, *, gap: float = 0.0, drag: float = 0.0, cubic: float = 0.0, factor: float = 1.0
    ) -> Torsion:
        """Return this with more gap and hardening of one joint, from 0, its stiffness times ``factor``.

        ``drag`` is that of the whole gap.
        """
        return replace(
            self,
            gap=raised(self.gap, joint, gap),
            drag=put(self.drag, joint, drag) if gap else self.drag,
            cubic=raised(self.cubic, joint, cubic),
            factor=scaled(self.factor, joint, factor),
        )

    def in_cut(self, torque: Array, compliance: Array, straight: Array | float = 0.0) -> Twist:
        """Twist in the cut.

        Parameters
        ----------
        torque : (m, n) on the links, N m, along one cut. compliance : (n,) of static loads, rad/(N m).
        straight : (n,) share of it that does not harden.
        """
        twist = self.at_rest(torque / self.factors(torque.shape[-1]), compliance, straight)
        return twist._replace(angle=twist.angle + self.passed(torque))

    def passed(self, torque: Array) -> Array:
        """How much of its gap each joint has passed under torques (m, n), N m, along one cut: (m, n) rad."""
        count = torque.shape[-1]
        return passed(torque, of_joints(self.gap, count), of_joints(self.drag, count))

    def factors(self, count: int) -> Array:
        """Stiffness in the cut relative to static loads, of ``count`` joints, (n,)."""
        return of_joints(self.factor, count, 1.0)

    def at_rest(self, torque: Array, compliance: Array, straight: Array | float = 0.0) -> Twist:
        """Twist under static loads (..., n), N m."""
        if not any(self.cubic):
            return Twist(torque * compliance, torque, np.zeros_like(torque))
        cubic = of_joints(self.cubic, torque.shape[-1])
        hardening = (1.0 - straight) * compliance
        twist = spring(torque, hardening, cubic)
        slope = spring_slope(torque, twist, hardening, cubic)
        return Twist(
            twist + straight * compliance * torque,
            (1.0 - straight) * slope + straight * torque,
            compliance * (torque - slope),
        )


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


def passed(torque: Array, gap: Array, drag: Array) -> Array:
    """How much of its gap each joint has passed, (m, n), rad: half of it, to the side that the torque pushes.

    A torque below the drag leaves the link somewhere within the gap, the nearer to its middle the smaller it
    is: where, depends on what was before.

    Parameters
    ----------
    torque : (m, n) N m along one cut. gap : (n,) rad. drag : (n,) N m.
    """
    if not gap.any():
        return np.zeros_like(torque)
    largest = np.abs(torque).max(axis=0, initial=0.0)
    turning = np.hypot(np.where(largest > 0.0, TURNING * largest, 1.0), drag)
    return np.asarray(0.5 * gap * np.tanh((torque / turning) ** 3))
