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


def stribeck(rate: Array, torque: Array, noise: float) -> Stribeck:
    """Fit the curve to means of friction.

    Parameters
    ----------
    rate : (k,) rad/s. torque : (k,) N m that resist there. noise : of each mean, N m.
    """
    if len(rate) < 2:
        return Stribeck()
    size, speed = np.sign(rate) * torque, np.abs(rate)
    tried = [_fitted(size, speed, float(creep), noise) for creep in CREEPS]
    return min(tried, key=lambda one: one[0])[1]


def _fitted(size: Array, speed: Array, creep: float, noise: float) -> tuple[float, Stribeck]:
    """Return -2 log-likelihood and the curve of one ``creep``: least squares, with what is believed of it."""
    columns = np.column_stack([np.ones_like(speed), np.exp(-((speed / creep) ** 2)), speed])
    belief = np.array([[0.0, 1.0 / (ABOVE_SD * max(float(np.median(size)), noise)), 0.0]])
    rows, right = np.vstack([columns / noise, belief]), np.append(size / noise, 0.0)
    found = np.linalg.lstsq(rows, right)[0]
    if found[0] <= 0.0 or found[1] <= 0.0:
        return float(np.sum((size - np.median(size)) ** 2)) / noise**2, Stribeck()
    return float(np.sum((right - rows @ found) ** 2)), Stribeck(float(found[1] / found[0]), creep)
