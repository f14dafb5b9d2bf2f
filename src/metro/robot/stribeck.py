"""How much friction is above its Coulomb level where a joint creeps, by idle runs (Stribeck).

Friction that changes, by another seal or grease, changes at every speed by the same share of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import MRAD, Array

# Bittencourt and Gunnarsson, J. Dyn. Sys. Meas. Control 134 (2012) 051013: 10 to 60 % above Coulomb friction,
# over speeds of 1 to 20 mrad/s.
ABOVE_SD = 0.35
CREEPS = np.geomspace(1.0, 20.0, 13) * MRAD


@dataclass(frozen=True)
class Stribeck:
    """``above`` the Coulomb level at rest, relative to it, which fades over speeds of ``creep``, rad/s."""

    above: float = 0.0
    creep: float = float(CREEPS[-1])

    def at(self, rate: Array) -> Array:
        """Friction (m,) at speeds (m,), rad/s, over its Coulomb level, less what is viscous."""
        return np.asarray(1.0 + self.above * np.exp(-((rate / self.creep) ** 2)))


def stribeck(rate: Array, state: Array, friction: Array, noise: float) -> Stribeck:
    """Fit the curve to friction along paths.

    Parameters
    ----------
    rate : (k,) rad/s. state : (k,) of presliding, −1 … 1. friction : (k,) over its level. noise : of it.
    """
    tried = [_fitted(rate, state, friction, float(creep), noise) for creep in CREEPS]
    return min(tried, key=lambda one: one[0])[1]


def _fitted(rate: Array, state: Array, friction: Array, creep: float, noise: float) -> tuple[float, Stribeck]:
    """Return -2 log-likelihood and the curve of one ``creep``: least squares, with what is believed of it."""
    columns = np.column_stack([state, state * np.exp(-((rate / creep) ** 2)), rate])
    rows = np.vstack([columns / noise, [[0.0, 1.0 / ABOVE_SD, 0.0]]])
    right = np.append(friction / noise, 0.0)
    level, above, viscous = np.linalg.lstsq(rows, right)[0]
    if level <= 0.0 or above <= 0.0:
        (level, viscous), above = np.linalg.lstsq(rows[:, [0, 2]], right)[0], 0.0
    left = right - rows @ (level, above, viscous)
    return float(left @ left), Stribeck(float(above / level) if level > 0.0 else 0.0, creep)
