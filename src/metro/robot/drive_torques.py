"""What the motors carry in the cut beyond the idle run that is no cutting force: friction, gears."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from metro.units import Array

NONE = (0.0,) * 6
TURNING = 2e-4  # rad/s: below it a joint is turning round, and its friction is between its two levels


@dataclass(frozen=True)
class Ripple:
    """Torque of a gear that comes with the joint's angle: sine sin(order q) + cosine cos(order q), N m.

    ``joint`` 0 … 5; ``order`` in cycles per revolution of the joint.
    """

    joint: int
    order: float
    sine: float
    cosine: float


@dataclass(frozen=True)
class DriveTorques:
    """Torques of the drives in the cut less those of the idle run.

    Attributes
    ----------
    reversal : (6,) Coulomb level of the cut less that of the idle run, N m.
    warmup : (6,) slope of the Coulomb level from the start of the cut's log, N m/s.
    viscous : (6,) friction in proportion to the joint's speed, the cut's less the idle run's, N m s/rad.
    ripple : of the gears, in the cut alone (what both runs have at the same place cancels).
    """

    reversal: tuple[float, ...] = NONE
    warmup: tuple[float, ...] = NONE
    viscous: tuple[float, ...] = NONE
    ripple: tuple[Ripple, ...] = ()

    def with_friction(
        self, joint: int, *, reversal: float = 0.0, warmup: float = 0.0, viscous: float = 0.0
    ) -> DriveTorques:
        """Return these with more friction in one joint (0 … 5)."""
        return replace(
            self,
            reversal=_raised(self.reversal, joint, reversal),
            warmup=_raised(self.warmup, joint, warmup),
            viscous=_raised(self.viscous, joint, viscous),
        )

    def at(self, q: Array, rate: Array, t: Array, width: Array | float = 0.0) -> Array:
        """Torque (m, 6), N m, on top of that of the idle run, each the mean over ``width`` s.

        Parameters
        ----------
        q, rate : (m, 6) angles, rad, and speeds, rad/s, of the joints. t : (m,) s from the log's start.
        """
        torque: Array = rate * np.array(self.viscous)
        if any(self.reversal) or any(self.warmup):
            torque += np.tanh(rate / TURNING) * (np.array(self.reversal) + np.outer(t, self.warmup))
        for one in self.ripple:
            angle = one.order * q[:, one.joint]
            cycles = one.order * rate[:, one.joint] * width / (2.0 * np.pi)
            mean = one.sine * np.sin(angle) + one.cosine * np.cos(angle)
            torque[:, one.joint] += np.sinc(cycles) * mean
        return torque


def _raised(values: Iterable[float], joint: int, by: float) -> tuple[float, ...]:
    return tuple(value + by * (i == joint) for i, value in enumerate(values))
