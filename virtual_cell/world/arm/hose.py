"""The package of hoses and cables along an arm: it pulls as a spring, and drags as it bends to and fro."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array
from virtual_cell.world.arm.dahl import dragged
from virtual_cell.world.draws import per_joint

_CARRIED = np.array([0.5, 0.0, 0.3, 1.0, 1.0, 1.0])  # how much of it each joint bends


@dataclass(frozen=True, eq=False)
class Hose:
    """A package: ``pull`` (6,) N m/rad about ``rest`` (6,) rad; ``drag`` (6,) N m.

    The drag turns round over ``width`` (6,) rad.
    """

    pull: Array
    rest: Array
    drag: Array
    width: Array

    def torque(self, q: Array, start: Array) -> Array:
        """Torque (n, 6), N m, that the drives need for it at joint angles (n, 6), rad.

        ``start`` (6,) −1 … 1: what the last motion left of the drag.
        """
        steps = np.diff(q, axis=0, prepend=q[:1])
        return np.asarray(self.pull * (q - self.rest) + self.drag * dragged(steps, self.width, start=start))


def drawn(rng: np.random.Generator, q: Array) -> Hose:
    """Draw a package for an arm that works near joint angles ``q`` (6,), rad."""
    return Hose(
        _CARRIED * per_joint(rng, 2.0, 15.0),
        q + rng.uniform(-1.0, 1.0, 6),
        _CARRIED * per_joint(rng, 0.3, 3.0),
        per_joint(rng, 0.005, 0.05),
    )
