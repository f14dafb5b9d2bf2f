"""Helical milling: the tool on a helix, its periphery inclined by the ramp, its bottom edges in cut."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter
from metro.cutting.law import EdgeLaw
from metro.cutting.time_signal import time_signal
from metro.units import Array

BOTTOM_EDGES = ("kfac", "kfae")


@dataclass(frozen=True)
class Helix:
    """Helical milling: the tool travels on a helix of ``radius`` m, sinking ``pitch`` m per orbit.

    ``axial_feed`` is the axial feed per tooth, m, which the bottom edges cut.
    """

    radius: float
    pitch: float
    axial_feed: float

    @property
    def ramp(self) -> float:
        """Ramp angle of the path, rad."""
        return math.atan(self.pitch / (2.0 * math.pi * self.radius))


def ramped(vectors: Array, ramp: float) -> Array:
    """Incline the feed frame of (n, 3, …) vectors downwards by the ramp angle: x and z turn about y."""
    c, s = math.cos(ramp), math.sin(ramp)
    x, y, z = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    return np.stack([c * x + s * z, y, c * z - s * x], axis=1)


def turn(angle: float | Array) -> Array:
    """Matrices (…, 3, 3) that turn a vector about z, counter-clockwise, by angles (…), rad."""
    matrix = np.zeros((*np.shape(angle), 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = np.cos(angle)
    matrix[..., 1, 0] = np.sin(angle)
    matrix[..., 0, 1] = -matrix[..., 1, 0]
    matrix[..., 2, 2] = 1.0
    return matrix


def bottom_thrust(cutter: Cutter, helix: Helix) -> Array:
    """Thrust of all bottom edges along z per unit of K_Fac and of K_Fae, (2,): N R s_ta, m², and N R, m.

    It is steady: the bottom edges are in the work over the whole revolution ([T] eq. 7 and 8).
    """
    reach = cutter.teeth * cutter.radius
    return np.array([reach * helix.axial_feed, reach])


def helical_signal(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    helix: Helix,
    coefficients: Array,
    *,
    speed: float,
    orbit_speed: float,
    time: Array,
    phase: float = 0.0,
    direction: float = 0.0,
    true_path: bool = False,
) -> Array:
    """Force on the tool at given times, (n, 3) N, in the fixed work frame.

    Peripheral forces of the feed frame, inclined by the ramp; the bottom edges' thrust, which is along the
    spindle and not inclined; all turned to the direction of feed (physics.md §2). The feed turns as well, so
    the teeth pass it at the spindle's and the orbit's speed together. True paths follow the orbit's curve. A
    ``cut`` whose pitch is 0 is taken to its full depth, as [T] does.

    Parameters
    ----------
    coefficients : (8,) SI, ``COEFFICIENTS`` then ``BOTTOM_EDGES``.
    speed, orbit_speed : of the spindle (clockwise) and of the orbit (counter-clockwise positive), rad/s.
    phase : immersion of tooth 0 at t = 0, rad. direction : of feed at t = 0,
        counter-clockwise from work +x, rad.
    """
    relative = speed + orbit_speed
    curved = replace(cut, curvature=math.copysign(1.0 / helix.radius, orbit_speed))
    force = time_signal(
        cutter, law, curved, coefficients[:6], speed=relative, time=time, phase=phase, true_path=true_path
    )
    force = ramped(force, helix.ramp)
    force[:, 2] += bottom_thrust(cutter, helix) @ coefficients[6:]
    return np.asarray((turn(direction + orbit_speed * time) @ force[..., None])[..., 0])
