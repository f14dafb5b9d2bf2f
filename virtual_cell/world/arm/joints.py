"""Friction of an arm's joints: presliding, Stribeck, load and warmth, integrated in time.

Ranges: presliding 1e-4 to 1e-3 rad and Stribeck speeds of 1 to 20 mrad/s with 10 to 60 % above Coulomb,
viscous friction that falls by half while an arm warms up, and 0.3 to 2 % of the load torque as friction
(Bittencourt and Gunnarsson, J. Dyn. Sys. Meas. Control 134 (2012) 051013; Ruderman et al., IEEE Trans. Ind.
Electron. 56 (2009) 3840).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array
from virtual_cell.world.arm.dahl import dragged
from virtual_cell.world.draws import between, per_joint


@dataclass(frozen=True, eq=False)
class Joints:
    """Friction of six joints.

    Attributes
    ----------
    coulomb, viscous : (6,) of cold joints, N m and N m s/rad.
    breakaway : (6,) share by which friction at rest is above Coulomb. creep : (6,) Stribeck speed, rad/s.
    bristle : (6,) rad of motion in which friction turns round.
    by_load : (6,) friction per torque on the joint.
    thinning, wearing_in : share of viscous and of Coulomb friction that a warm joint has lost.
    behind : (6,) share of the friction that acts behind the gear's spring, where no encoder is.
    """

    coulomb: Array
    viscous: Array
    breakaway: Array
    creep: Array
    bristle: Array
    by_load: Array
    thinning: float
    wearing_in: float
    behind: Array

    def level(self, rate: Array, load: Array, warmth: float) -> Array:
        """Size (n, 6), N m, of dry friction at speeds (n, 6), rad/s, under torques (n, 6), N m."""
        peak = 1.0 + self.breakaway * np.exp(-((rate / self.creep) ** 2))
        dry: Array = self.coulomb * (1.0 - self.wearing_in * warmth) * peak + self.by_load * np.abs(load)
        return dry

    def friction(self, rate: Array, load: Array, dt: float, warmth: float) -> tuple[Array, Array]:
        """Torque (n, 6), N m, of friction at even times, and its dry part over its level, −1 … 1.

        ``warmth``: 0 cold, 1 warm.
        """
        level = self.level(rate, load, warmth)
        width = self.bristle * level / self.coulomb
        dry = dragged(rate * dt, width, level, start=np.sign(rate[0]) * level[0])
        viscous = self.viscous * (1.0 - self.thinning * warmth) * rate
        return np.asarray(dry + viscous), np.asarray(dry / level)


def drawn(rng: np.random.Generator, coulomb: Array, viscous: Array) -> Joints:
    """Draw the joints of one arm about the friction (6,) of its kind."""
    return Joints(
        coulomb * per_joint(rng, 0.7, 1.4),
        viscous * per_joint(rng, 0.7, 1.4),
        breakaway=per_joint(rng, 0.1, 0.6),
        creep=per_joint(rng, 1e-3, 0.02),
        bristle=per_joint(rng, 1e-4, 1e-3),
        by_load=per_joint(rng, 0.003, 0.02),
        thinning=float(rng.uniform(0.35, 0.55)),
        wearing_in=between(rng, 0.02, 0.12),
        behind=per_joint(rng, 0.005, 0.04),
    )


@dataclass(frozen=True)
class Warming:
    """How warm the joints are, 0 … 1, at a time of the session.

    ``before`` s the arm ran before the session. ``constant`` s of warming. ``final`` share of the warmth that
    running at these feeds reaches.
    """

    before: float
    constant: float
    final: float

    def at(self, t: float) -> float:
        """Warmth ``t`` s after the session began."""
        return self.final * (1.0 - float(np.exp(-(t + self.before) / self.constant)))


def warming(rng: np.random.Generator) -> Warming:
    """Draw how an arm warms up: over half an hour or more, from cold or not quite."""
    return Warming(
        float(rng.uniform(0.0, 5400.0)), between(rng, 1200.0, 4500.0), float(rng.uniform(0.4, 1.0))
    )
