"""What yields beside the joints' own springs: links that bend, a base that tilts, joints that pull at others.

Joints make 50 to 80 % of the compliance of an arm, links and base the rest (Klimchik et al., Robot.
Comput.-Integr. Manuf. 35 (2015); Abele et al., Prod. Eng. 1 (2007) 387). The first modes of heavy arms lie at
6 to 25 Hz, with 2 to 12 % of critical damping (Schneider et al., Prod. Eng. 8 (2014) 59).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.units import Array
from virtual_cell.world.draws import between


@dataclass(frozen=True, eq=False)
class Links:
    """Compliance beside that of the joints, and the modes by which the tip follows it.

    Attributes
    ----------
    bend : (3,) of the links 1 to 3 across their length, rad/(N m). tilt : (2,) of the base about x and y.
    coupling : (6, 6) off-diagonal compliance of the joints, rad/(N m).
    modes : (Hz, damping, share of the motion) each.
    """

    bend: Array
    tilt: Array
    coupling: Array
    modes: tuple[tuple[float, float, float], ...]

    def compliance(self, arm: Arm, q: Array) -> Array:
        """Compliance (3, 3), m/N, of the tip in the base frame, that of the joints' springs left out."""
        tip, frames = arm.pose(q)[0], arm.frames(q)
        total = np.asarray(arm.jacobian(q)[:3] @ self.coupling @ arm.jacobian(q)[:3].T)
        for axis, soft in zip(np.eye(3)[:2], self.tilt, strict=True):
            moved = np.cross(axis, tip)
            total = total + soft * np.outer(moved, moved)
        for frame, soft in zip(frames[1:4], self.bend, strict=True):
            for axis in frame[:3, 1:3].T:
                moved = np.cross(axis, tip - frame[:3, 3])
                total = total + soft * np.outer(moved, moved)
        return total

    def followed(self, moved: Array, dt: float) -> Array:
        """Motion (n, 3) of the tip where without masses it were ``moved`` (n, 3), at even times."""
        from scipy import signal

        out = np.zeros_like(moved)
        for hz, damping, share in self.modes:
            omega = 2.0 * math.pi * hz
            system = ([omega**2], [1.0, 2.0 * damping * omega, omega**2])
            num, den, _ = signal.cont2discrete(system, dt, method="foh")
            out += share * (moved[0] + signal.lfilter(np.ravel(num), den, moved - moved[0], axis=0))
        return out


def drawn(rng: np.random.Generator, stiffness: Array) -> Links:
    """Draw links for joints of some ``stiffness`` (6,), N m/rad."""
    soft = 1.0 / stiffness
    coupling = np.zeros((6, 6))
    for i in range(5):
        pull = rng.uniform(-0.08, 0.08) * math.sqrt(soft[i] * soft[i + 1])
        coupling[i, i + 1] = coupling[i + 1, i] = pull
    first = between(rng, 6.5, 15.0)
    share = float(rng.uniform(0.55, 0.85))
    modes = (
        (first, between(rng, 0.05, 0.12), share),
        (first * rng.uniform(1.3, 1.8), between(rng, 0.05, 0.12), 1.0 - share),
    )
    return Links(
        soft[:3] * np.exp(rng.uniform(math.log(0.02), math.log(0.12), 3)),
        np.full(2, soft[1]) * np.exp(rng.uniform(math.log(0.03), math.log(0.15), 2)),
        coupling,
        modes,
    )
