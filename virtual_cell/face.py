"""Face milling with a tip that yields: passes over a plate, the surface they leave, and a scan of it.

The mean cutting force (teeth pass far above the arm's modes) drives the arm's tip mass on a stiffness that
depends on where on the plate the tip is. Of the flat-bottomed cutter the rim cuts: in every pass it goes over
a point twice, in front of the axis and behind it, and the surface is as low as the lowest of all these cuts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.noise import quantised
from virtual_cell.units import MM, UM, Array

_STEP = 0.002  # s, of the motion of the tip
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

    ``tilt`` of the spindle about work x, y, rad; ``growth`` of the tool, m/s; ``bow`` (xx, xy, yy), m;
    ``vibration`` Hz, m.
    """

    tilt: tuple[float, float] = (0.0, 0.0)
    growth: float = 0.0
    bow: tuple[float, float, float] = (0.0, 0.0, 0.0)
    vibration: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Tip:
    """Dynamics of the tip: ``mass`` (3, 3), kg; C = a0 M + a1 K; ``stiffness`` (n, 2) → (n, 3, 3), N/m."""

    mass: Array
    a0: float
    a1: float
    stiffness: Callable[[Array], Array]


def tip_heights(passes: Passes, tip: Tip, force: Callable[[Array], Array]) -> list[tuple[Array, Array]]:
    """Return, pass by pass, lengths ``s`` (n,) and the tip's height (n,), both m.

    ``force(s)`` (n, 3), N, work frame, acts on it; the tip goes on ringing on its way back.
    """
    state: Array = np.zeros((3, 3))
    count = round(passes.period / _STEP)
    s = -passes.lead + passes.speed * _STEP * np.arange(count)
    cutting = s < passes.length + passes.lead
    load = np.where(cutting[:, None], force(s), 0.0)
    heights = []
    for number in range(len(passes.axes)):
        inside = np.clip(s, 0.0, passes.length)
        stiffness = tip.stiffness(passes.points(inside, number))
        moved, state = _newmark(tip, stiffness, load, state)
        heights.append((s[cutting], moved[cutting, 2]))
    return heights


def _newmark(tip: Tip, stiffness: Array, load: Array, state: Array) -> tuple[Array, Array]:
    """Average-acceleration integration; ``state`` holds position, velocity and acceleration, (3, 3)."""
    x, v, a = state
    out = np.empty_like(load)
    dynamic = (
        tip.mass * (4.0 / _STEP**2) + (tip.a0 * tip.mass + tip.a1 * stiffness) * (2.0 / _STEP) + stiffness
    )
    inverse = np.linalg.inv(dynamic)
    for i, f in enumerate(load):
        damping = tip.a0 * tip.mass + tip.a1 * stiffness[i]
        push = (
            f + tip.mass @ (x * (4.0 / _STEP**2) + v * (4.0 / _STEP) + a) + damping @ (x * (2.0 / _STEP) + v)
        )
        new = inverse[i] @ push
        speed = (new - x) * (2.0 / _STEP) - v
        a = (speed - v) * (2.0 / _STEP) - a
        x, v = new, speed
        out[i] = x
    return out, np.array([x, v, a])


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
            cut += around.vibration[1] * np.sin(2.0 * math.pi * around.vibration[0] * t) - around.growth * t
            lowest[under] = np.minimum(lowest[under], cut)
    u, v = (2.0 * points / np.array(passes.size) - 1.0).T
    face: Array = lowest + around.bow[0] * u * u + around.bow[1] * u * v + around.bow[2] * v * v
    return face


@dataclass(frozen=True)
class Scanner:
    """An optical scanner.

    ``spacing`` and ``sigma``, m; ``to_work`` (4, 4), mm; ``height_error``, m, and ``tilt_error`` of
    registration, standard deviations.
    """

    spacing: float
    sigma: float
    to_work: Array
    height_error: float = 10.0 * UM
    tilt_error: float = 5e-5


def scan(
    scanner: Scanner, size: tuple[float, float], height: Callable[[Array], Array], rng: np.random.Generator
) -> Array:
    """Return a cloud (n, 3), mm, scanner coordinates, of a face with ``height(points)``.

    Half of the variance of the noise is correlated over about 1 mm, half is white.
    """
    grid = [np.arange(0.5, extent / scanner.spacing) * scanner.spacing for extent in size]
    points = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 2)
    points = points + rng.uniform(-0.3, 0.3, points.shape) * scanner.spacing
    points = np.clip(points, 1e-6, np.array(size) - 1e-6)
    noise = _correlated(points, size, rng) + rng.standard_normal(len(points))
    z = height(points) + scanner.sigma * math.sqrt(0.5) * noise
    tilt = scanner.tilt_error * rng.standard_normal(2)
    z += scanner.height_error * rng.standard_normal() + (points - np.array(size) / 2.0) @ tilt
    inverse = np.linalg.inv(scanner.to_work)
    cloud = np.column_stack([points, z]) / MM @ inverse[:3, :3].T + inverse[:3, 3]
    return quantised(cloud, 1e-3)


def _correlated(points: Array, size: tuple[float, float], rng: np.random.Generator) -> Array:
    """Noise of unit variance (n,) at points, correlated over about 1 mm."""
    from scipy.interpolate import RegularGridInterpolator
    from scipy.ndimage import gaussian_filter

    pitch = 0.25 * MM
    shape = [math.ceil(extent / pitch) + 1 for extent in size]
    field = gaussian_filter(rng.standard_normal(shape), 1.0 * MM / pitch / math.sqrt(2.0), mode="wrap")
    axes = [np.arange(n) * pitch for n in shape]
    noise: Array = RegularGridInterpolator(axes, field / field.std())(points)
    return noise
