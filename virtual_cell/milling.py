"""Milling forces in the time domain, from traced chips; forces act on the tool.

In helical milling the periphery cuts the full axial depth over the front half of the tool (the assumption of
the published model); the orbit, however, is the true circle of the tool's centre.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.chips import Chips, Engagement, chips
from virtual_cell.motion import Orbit
from virtual_cell.units import N_MM, N_MM2, Array


@dataclass(frozen=True)
class Coefficients:
    """Force law: shear (N/m²) and edge (N/m, per axial length) coefficients; K_c ∝ (h/h0)^−size_exponent.

    ``kfac`` and ``kfae`` belong to the bottom edges in helical milling; ``wear`` is the relative growth of
    the edge coefficients per metre cut. ``jammed``: tangential and radial force of chips that are wedged
    between tooth and wall where the tooth goes along the feed, in parts of K_tc × feed per tooth.
    """

    ktc: float
    krc: float
    kac: float
    kte: float
    kre: float
    kae: float
    kfac: float = 0.0
    kfae: float = 0.0
    size_exponent: float = 0.0
    size_reference: float = 1.0
    wear: float = 0.0
    jammed: tuple[float, float] = (0.0, 0.0)

    def softened(self, factor: float) -> Coefficients:
        """Coefficients with the shear of the periphery times a factor."""
        return replace(self, ktc=self.ktc * factor, krc=self.krc * factor, kac=self.kac * factor)

    def worn(self, metres: Array | float) -> Array | float:
        """Factor on the edge coefficients after some metres of cut."""
        return 1.0 + self.wear * metres

    def after(self, metres: float) -> Coefficients:
        """Coefficients of an edge that has cut some metres and wears no more while they are used."""
        factor = float(self.worn(metres))
        return replace(self, kte=self.kte * factor, kre=self.kre * factor, kae=self.kae * factor, wear=0.0)

    def per_length(self, h: Array, worn: Array | float) -> tuple[Array, Array, Array]:
        """Return tangential, radial, axial force per axial length, N/m, at chip thickness ``h`` (m)."""
        edge = np.where(h > 0.0, worn, 0.0)
        shear = np.maximum(h, 0.0)
        if self.size_exponent != 0.0:
            shear = shear ** (1.0 - self.size_exponent) * self.size_reference**self.size_exponent
        return (
            self.ktc * shear + self.kte * edge,
            self.krc * shear + self.kre * edge,
            self.kac * shear + self.kae * edge,
        )


def in_millimetres(
    shear: Iterable[float], edge: Iterable[float], bottom: tuple[float, float] = (0.0, 0.0)
) -> Coefficients:
    """Coefficients from K_tc, K_rc, K_ac (N/mm²), K_te, K_re, K_ae (N/mm) and K_Fac (N/mm²), K_Fae (N/mm)."""
    ktc, krc, kac = (k * N_MM2 for k in shear)
    kte, kre, kae = (k * N_MM for k in edge)
    return Coefficients(ktc, krc, kac, kte, kre, kae, bottom[0] * N_MM2, bottom[1] * N_MM)


@dataclass(frozen=True)
class Cut:
    """One pass of one tool; ``metres_before`` were cut in earlier runs.

    ``compliance`` (2, 2), m/N in the frame of the motion, lets the tip yield in x and y.
    """

    engagement: Engagement
    coefficients: Coefficients
    metres_before: float = 0.0
    compliance: Array | None = None

    def metres(self, t: Array) -> Array:
        """Length cut up to times ``t`` (s)."""
        return self.metres_before + self.engagement.motion.speed * np.maximum(t, 0.0)


def _edges(cut: Cut, traced: Chips) -> tuple[Array, Array, Array]:
    """Tangential, radial and axial force (N) on the traced points of a tooth."""
    law = cut.coefficients.per_length(traced.thickness, cut.coefficients.worn(cut.metres(traced.t)))
    dz = engaged(cut.engagement, traced)
    tangential, radial = _wedged(cut, traced)
    return (law[0] + tangential) * dz, (law[1] + radial) * dz, law[2] * dz


def _wedged(cut: Cut, traced: Chips) -> tuple[Array, Array]:
    """Tangential and radial force per axial length, N/m, of chips that a tooth drags along the wall.

    The chip of a revolution is as long as the feed, and the wall wedges it where it faces the tooth.
    """
    turns, motion = cut.engagement.spindle / (2.0 * math.pi), cut.engagement.motion
    per_tooth = motion.speed / (turns * cut.engagement.tool.teeth)
    feed = motion.direction(traced.t)
    across = traced.cos * np.cos(feed) - traced.sin * np.sin(feed)
    along = np.where(traced.thickness > 0.0, across**2, 0.0)
    tangential, radial = (
        share * cut.coefficients.ktc * per_tooth * along for share in cut.coefficients.jammed
    )
    return tangential, radial


def engaged(engagement: Engagement, traced: Chips) -> Array | float:
    """Width (m) of the slices of the traced points, or of what is below the floor that an orbit left."""
    dz = engagement.depth / len(engagement.slices)
    motion = engagement.motion
    if not isinstance(motion, Orbit) or not motion.pitch:
        return dz
    above = motion.ceiling(motion.direction(traced.t), traced.sin, traced.cos, traced.radius)
    return np.clip(above - traced.level * dz, 0.0, dz)


def _rigid(cut: Cut, t: Array) -> Array:
    """Force of the peripheral edges (n, 3), N, of a tool that follows its path."""
    force = np.zeros((3, len(t)))
    for tooth in range(cut.engagement.tool.teeth):
        traced = chips(cut.engagement, t, tooth)
        tangential, radial, axial = _edges(cut, traced)
        parts = (
            -tangential * traced.cos - radial * traced.sin,
            tangential * traced.sin - radial * traced.cos,
            axial,
        )
        for axis, part in enumerate(parts):
            force[axis] += np.bincount(traced.sample, part, len(t))
    return force.T


def forces(cut: Cut, t: Array) -> Array:
    """Return the force on the tool (n, 3), N, at evenly spaced times ``t`` (s).

    Feed frame for a straight cut, work frame for an orbit. A tool that yields starts undeflected at ``t[0]``.
    """
    if cut.compliance is None:
        force = _rigid(cut, t)
    else:
        from virtual_cell.yielding import yielding_force

        force = yielding_force(cut, t)
    motion = cut.engagement.motion
    return _helical(cut, motion, t, force) if isinstance(motion, Orbit) else force


def power(cut: Cut, t: Array) -> Array:
    """Return the power (n,), W, that the spindle delivers to the peripheral edges of a rigid tool."""
    total = np.zeros(len(t))
    for tooth in range(cut.engagement.tool.teeth):
        traced = chips(cut.engagement, t, tooth)
        total += np.bincount(traced.sample, _edges(cut, traced)[0] * traced.radius, len(t))
    return total * cut.engagement.spindle


def _helical(cut: Cut, orbit: Orbit, t: Array, force: Array) -> Array:
    """Incline the peripheral force by the ramp angle and add the bottom edges."""
    k, psi, tool = cut.coefficients, orbit.direction(t), cut.engagement.tool
    along = force[:, 0] * np.cos(psi) + force[:, 1] * np.sin(psi)
    cosine, sine = math.cos(orbit.ramp), math.sin(orbit.ramp)
    forward, up = along * cosine + force[:, 2] * sine, force[:, 2] * cosine - along * sine
    axial_feed = orbit.pitch * abs(orbit.rate) / (cut.engagement.spindle * tool.teeth)
    bottom = tool.teeth * tool.radius * (k.kfac * axial_feed + k.kfae)
    change = forward - along
    return np.stack(
        [force[:, 0] + change * np.cos(psi), force[:, 1] + change * np.sin(psi), up + bottom], axis=1
    )


def scattered(coefficients: Coefficients, relative: float, rng: np.random.Generator) -> Coefficients:
    """Return coefficients as they are in one run: each scatters by a relative standard deviation."""
    names = ("ktc", "krc", "kac", "kte", "kre", "kae", "kfac", "kfae")
    factors = 1.0 + relative * rng.standard_normal(len(names))
    changed = {name: getattr(coefficients, name) * f for name, f in zip(names, factors.tolist(), strict=True)}
    return replace(coefficients, **changed)
