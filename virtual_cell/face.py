"""Face milling: passes over a plate, and the surface that they and what is around them leave.

Of the dished cutter the rim cuts: in every pass it goes over a point twice, in front of the axis and behind
it, and the surface is as low as the lowest of all these cuts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array

_RETURN_SPEED, _RETURN_PAUSE = 0.2, 0.6  # m/s, s


@dataclass(frozen=True)
class Passes:
    """One-way passes along one direction of the plate.

    Attributes
    ----------
    size : (2,) of the plate along work x, y, m. along : 0 feed along x, 1 along y.
    width : m between passes. radius : of the cutter, m. speed : feed, m/s. lead : way of the axis before and
        after, m.
    """

    size: tuple[float, float]
    along: int
    width: float
    radius: float
    speed: float
    lead: float

    @property
    def length(self) -> float:
        """Length of the plate along the feed, m."""
        return self.size[self.along]

    @property
    def axes(self) -> Array:
        """Where across the plate the axis runs, pass by pass, m: the block is on the tool's −y side.

        The free side is at the plate's far edge for feed along x, and at its near edge for feed along y.
        """
        reach = np.arange(1, round(self.size[1 - self.along] / self.width) + 1) * self.width - self.radius
        return self.size[1] - reach if self.along == 0 else reach

    def points(self, s: Array, number: int) -> Array:
        """Points (n, 2) of the work frame at ``s`` (m) along pass ``number``."""
        at = np.empty((len(s), 2))
        at[:, self.along], at[:, 1 - self.along] = s, self.axes[number]
        return at

    @property
    def period(self) -> float:
        """Time from the start of one pass to the start of the next, s."""
        way = self.length + 2.0 * self.lead
        return way / self.speed + way / _RETURN_SPEED + _RETURN_PAUSE


@dataclass(frozen=True)
class Surroundings:
    """What else shapes a face.

    Attributes
    ----------
    tilt : of the spindle about work x, y, rad. growth : of the tool, m/s. bow : (xx, xy, yy), m.
    vibration : Hz, m; ``phase`` of it where the face begins, rad. entry : how much too high the tip is where
        the axis comes over the plate's edge, m, and over which length that goes, m.
    settling : m, by which the tool grows once it is no longer cooled, the time (s) that this takes, and from
        when on, s.
    levels : (passes,) how high each pass is set, m; None: all at zero.
    spot : x, y, radius and height of a bump, m. sag : m, of the cross-rail: goes with v³.
    """

    tilt: tuple[float, float] = (0.0, 0.0)
    growth: float = 0.0
    bow: tuple[float, float, float] = (0.0, 0.0, 0.0)
    vibration: tuple[float, float] = (0.0, 0.0)
    phase: float = 0.0
    entry: tuple[float, float] = (0.0, 1.0)
    settling: tuple[float, float, float] = (0.0, 1.0, 0.0)
    levels: Array | None = None
    spot: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)
    sag: float = 0.0

    def of_tip(self, number: int, s: Array, t: Array) -> Array:
        """How much higher (n,), m, the tip is in a pass, with the axis at ``s`` (m) at times ``t`` (s)."""
        high = self.vibration[1] * np.sin(2.0 * math.pi * self.vibration[0] * t + self.phase)
        length, constant, begins = self.settling
        high -= self.growth * t + length * -np.expm1(-np.maximum(t - begins, 0.0) / constant)
        high += np.where(s >= 0.0, self.entry[0] * np.exp(-np.maximum(s, 0.0) / self.entry[1]), 0.0)
        return np.asarray(high + (0.0 if self.levels is None else float(self.levels[number])))

    def of_plate(self, points: Array, size: tuple[float, float]) -> Array:
        """How much higher (n,), m, the finished face is at ``points`` (n, 2), m."""
        u, v = (2.0 * points / np.array(size) - 1.0).T
        away = np.hypot(*(points - np.array(self.spot[:2])).T) / self.spot[2]
        bump = self.spot[3] * np.where(away < 1.0, 0.5 + 0.5 * np.cos(math.pi * away), 0.0)
        return np.asarray(
            self.bow[0] * u * u + self.bow[1] * u * v + self.bow[2] * v * v + self.sag * v**3 + bump
        )


def surface(passes: Passes, heights: list[tuple[Array, Array]], around: Surroundings, points: Array) -> Array:
    """Return the height (n,), m, of the face at ``points`` (n, 2), m: the lowest cut of all passes."""
    lowest = np.full(len(points), np.inf)
    for number, (s, z) in enumerate(heights):
        begun = number * passes.period
        across = points[:, 1 - passes.along] - passes.axes[number]
        under = np.abs(across) < passes.radius
        half = np.sqrt(passes.radius**2 - across[under] ** 2)
        for side in (1.0, -1.0):  # in front of the axis, behind it
            axis = points[under, passes.along] - side * half
            t = begun + (axis + passes.lead) / passes.speed
            offset = np.empty((int(under.sum()), 2))
            offset[:, passes.along], offset[:, 1 - passes.along] = side * half, across[under]
            cut = np.interp(axis, s, z) + offset @ np.array([-around.tilt[1], around.tilt[0]])
            lowest[under] = np.minimum(lowest[under], cut + around.of_tip(number, axis, t))
    face: Array = lowest + around.of_plate(points, passes.size)
    return face
