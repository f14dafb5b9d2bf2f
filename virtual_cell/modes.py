"""Modes of a structure at the tool tip: oscillators of given frequency, damping and stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array


@dataclass(frozen=True)
class Modes:
    """Modes of one direction, each (m,): ``damped`` frequency (Hz), damping ratio, stiffness (N/m).

    Or (n, m): those of each of n tests.
    """

    damped: Array
    damping: Array
    stiffness: Array

    @property
    def omega(self) -> Array:
        """Undamped angular frequencies (m,), rad/s."""
        undamped: Array = 2.0 * math.pi * self.damped / np.sqrt(1.0 - self.damping**2)
        return undamped

    def steps(self, dt: float | Array) -> tuple[Array, Array]:
        """Exact step (…, m, 2, 2) of position and velocity; effect (…, m, 2) of a unit force held over it.

        ``dt`` is a time step, s, or an array (…) of them.
        """
        decay, turn = self.damping * self.omega, 2.0 * math.pi * self.damped
        time = np.asarray(dt, dtype=float)[..., None]
        e, c, s = np.exp(-decay * time), np.cos(turn * time), np.sin(turn * time)
        step = np.empty((*e.shape, 2, 2))
        step[..., 0, 0] = e * (c + decay / turn * s)
        step[..., 0, 1] = e * s / turn
        step[..., 1, 0] = -e * self.omega**2 / turn * s
        step[..., 1, 1] = e * (c - decay / turn * s)
        push = np.stack([1.0 - step[..., 0, 0], -step[..., 1, 0]], axis=-1) / self.stiffness[..., None]
        return step, push
