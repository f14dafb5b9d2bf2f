"""What the elements of the deformation belong to: a wall that was cut, load tests, and what is believed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array


@dataclass(frozen=True, eq=False)
class CutWall:
    """Inputs of a run's deformation, at m points evenly spaced along the wall.

    Attributes
    ----------
    commanded, actual : (m, n) joint angles of the log of the cut, rad. rate : (m, n) their speeds, rad/s.
    force : (m, 3) on the tool, work frame, N. normal : (3,) of the wall, out of the material.
    spacing, cutoff : of the points and of the profile's filter, m. kept : (n,) points that are compared.
    source : of the force.
    harder : (n, 3) height that the compared points gain, m, if the force is wrong along work x, y or z by its
        whole size; None where the force is taken as right.
    weight : (m, n) torque of the arm's weight on the link of each joint less that in mid-wall, where the work
        was touched, N m; None where it is not known.
    waves : (n, c) height by which the compared points gain per unit of each wave of the gears, m; None
        without.
    """

    commanded: Array
    actual: Array
    rate: Array
    force: Array
    normal: Array
    spacing: float
    cutoff: float
    kept: np.ndarray
    source: str = ""
    harder: Array | None = None
    weight: Array | None = None
    waves: Array | None = None


@dataclass(frozen=True, eq=False)
class LoadTest:
    """Static loads: joint angles (m, n) rad, forces (m, 3) N, which displacements (m, 3) were measured."""

    joints: Array
    force: Array
    measured: np.ndarray


@dataclass(frozen=True, eq=False)
class KnownParameters:
    """Base parameters of which something is known beforehand: their indices."""

    places: np.ndarray
