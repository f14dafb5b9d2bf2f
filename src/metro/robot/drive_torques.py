"""What the motors carry in the cut beyond the idle run that is no cutting force: friction, gears."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from metro.robot.by_joint import of_joints, raised
from metro.units import Array

TURNING = 2e-4  # rad/s: below it a joint is turning round, and its friction is between its two levels


@dataclass(frozen=True)
class Ripple:
    """Torque of a gear that comes with the joint's angle: sine sin(order q) + cosine cos(order q), N m.

    ``joint`` from 0; ``order`` in cycles per revolution of the joint.
    """

    joint: int
    order: float
    sine: float
    cosine: float


@dataclass(frozen=True)
class DriveTorques:
    """Torques of the drives in the cut less those of the idle run; joints beyond an entry have none.

    Attributes
    ----------
    reversal : Coulomb level of the cut less that of the idle run, N m.
    warmup : slope of the Coulomb level from the start of the cut's log, N m/s.
    viscous : friction in proportion to the joint's speed, the cut's less the idle run's, N m s/rad.
    ripple : of the gears, in the cut alone (what both runs have at the same place cancels).
    """

    reversal: tuple[float, ...] = ()
    warmup: tuple[float, ...] = ()
    viscous: tuple[float, ...] = ()
    ripple: tuple[Ripple, ...] = ()

    def with_friction(
        self, joint: int, *, reversal: float = 0.0, warmup: float = 0.0, viscous: float = 0.0
    ) -> DriveTorques:
        """Return these with more friction in one joint, from 0."""
        return replace(
            self,
            reversal=raised(self.reversal, joint, reversal),
            warmup=raised(self.warmup, joint, warmup),
            viscous=raised(self.viscous, joint, viscous),
        )

    def at(self, q: Array, rate: Array, t: Array, width: Array | float = 0.0) -> Array:
        """Torque (m, n), N m, on top of that of the idle run, each the mean over ``width`` s.

        Parameters
        ----------
        q, rate : (m, n) angles, rad, and speeds, rad/s, of the joints. t : (m,) s from the log's start.
        """
        reversal, warmup, viscous = (
            of_joints(each, rate.shape[1]) for each in (self.reversal, self.warmup, self.viscous)
        )
        torque: Array = rate * viscous
        if reversal.any() or warmup.any():
            torque += np.tanh(rate / TURNING) * (reversal + np.outer(t, warmup))
        for one in self.ripple:
            angle = one.order * q[:, one.joint]
            cycles = one.order * rate[:, one.joint] * width / (2.0 * np.pi)
            mean = one.sine * np.sin(angle) + one.cosine * np.cos(angle)
            torque[:, one.joint] += np.sinc(cycles) * mean
        return torque
