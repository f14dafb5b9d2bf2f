"""Resonances that the tip feels: each moves along a line of its own, and all share one damping matrix.

The equations of motion are written in mass-normalised coordinates, with a full damping matrix: lines that are
not along the axes, damping that is not proportional, pairs that lie close together and gyroscopic forces are
all numbers of it. No transfer function of single modes is used anywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.units import Array


@dataclass(frozen=True)
class Resonances:
    """Resonances of tool, spindle, machine and work, m of them.

    Attributes
    ----------
    hz : (m,) undamped. damping : (m,) ratios. stiffness : (m,) N/m, along its own line.
    heading : (m,) rad, direction of that line from x towards y.
    shared : (m, m) symmetric, its diagonal 1: the damping of two resonances that have a joint in common.
    bearing : (m,) share of the strain energy that is in the spindle's bearings; 0: of the work.
    struck : (m,) whether a blow on the tool excites it.
    """

    hz: Array
    damping: Array
    stiffness: Array
    heading: Array
    shared: Array
    bearing: Array
    struck: np.ndarray

    @property
    def omega(self) -> Array:
        """(m,) rad/s."""
        return 2.0 * math.pi * self.hz

    @property
    def lines(self) -> Array:
        """Tip (2,) per mass-normalised coordinate, (m, 2), kg^−1/2."""
        along = np.stack([np.cos(self.heading), np.sin(self.heading)], axis=1)
        lines: Array = along * (self.omega / np.sqrt(self.stiffness))[:, None]
        return lines

    @property
    def of_damping(self) -> Array:
        """Damping matrix (m, m), 1/s."""
        root = np.sqrt(2.0 * self.damping * self.omega)
        matrix: Array = self.shared * np.outer(root, root)
        return matrix

    def felt_by_hammer(self) -> Resonances:
        """Return those that a blow on the tool excites."""
        at = np.flatnonzero(self.struck)
        parts = {name: getattr(self, name)[at] for name in self.__dataclass_fields__ if name != "shared"}
        return Resonances(**parts, shared=self.shared[np.ix_(at, at)])

    def with_one(self, hz: float, damping: float, stiffness: float, heading: float) -> Resonances:
        """Add one of the work or its fixture, which no blow on the tool excites."""
        m = len(self.hz)
        shared = np.eye(m + 1)
        shared[:m, :m] = self.shared
        return Resonances(
            np.append(self.hz, hz),
            np.append(self.damping, damping),
            np.append(self.stiffness, stiffness),
            np.append(self.heading, heading),
            shared,
            np.append(self.bearing, 0.0),
            np.append(self.struck, False),
        )

    def turned(self, angle: float) -> Resonances:
        """Turn all lines by an angle, rad, from x towards y."""
        return replace(self, heading=self.heading + angle)

    def warmer(self, change: float) -> Resonances:
        """Change all frequencies by a share, mass constant."""
        factor = 1.0 + change
        return replace(self, hz=self.hz * factor, stiffness=self.stiffness * factor**2)

    def receptance(self, frequency: Array, mass: float = 0.0) -> Array:
        """Receptance (f, 2, 2) of the tip, m/N, e^{+iωt}, with a mass (kg) stuck on it."""
        omega = 2.0 * math.pi * frequency[:, None, None]
        dynamic = np.diag(self.omega**2) - omega**2 * np.eye(len(self.hz)) + 1j * omega * self.of_damping
        lines = np.broadcast_to(self.lines, (len(frequency), *self.lines.shape))
        bare = self.lines.T @ np.linalg.solve(dynamic, lines)
        if not mass:
            return np.asarray(bare)
        return np.asarray(bare @ np.linalg.inv(np.eye(2) - omega**2 * mass * bare))


def state_matrices(
    resonances: Resonances, stiffer: Array, damped: Array, whirl: Array
) -> tuple[Array, Array, Array]:
    """Return A (n, 2m, 2m), B (2m, 2) and C (2, 2m) of n tests: ẋ = A x + B f, tip = C x.

    Parameters
    ----------
    stiffer : (n, m) factor on each stiffness, mass constant. damped : (n,) factor on the damping.
    whirl : (n,) rad/s: gyroscopic rate that couples what moves across to what moves along, without any loss.
    """
    m, n = len(resonances.hz), len(stiffer)
    a = np.zeros((n, 2 * m, 2 * m))
    a[:, :m, m:] = np.eye(m)
    index = np.arange(m)
    a[:, m + index, index] = -(resonances.omega**2) * stiffer
    across = np.sin(resonances.heading[None, :] - resonances.heading[:, None])
    spun = (resonances.bearing > 0.0).astype(float)
    gyroscopic = across * np.outer(spun, spun)
    a[:, m:, m:] = -damped[:, None, None] * resonances.of_damping + whirl[:, None, None] * gyroscopic
    b = np.concatenate([np.zeros((m, 2)), resonances.lines])
    c = np.concatenate([resonances.lines, np.zeros((m, 2))]).T
    return a, b, c
