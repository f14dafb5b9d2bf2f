"""The programmed path of a face: its passes, the passages of the rim over points, the force along a pass."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.force import COEFFICIENTS, Cut, mean_force
from metro.cutting.law import EdgeLaw
from metro.observables.cut import conditions as cutting_force
from metro.surface.footprint import Window, window
from metro.units import DEG, MM, Array

RETURN_SPEED, RETURN_PAUSE = 0.2, 0.6  # m/s, s: values of the contract if return_s is blank
RAMP_POINTS = 17
NARROW = 0.8  # of the declared width of cut, below which the force of a pass is another one
ASIDE_POINTS = 2001  # over the work, by which widths are measured
STEP = 0.01  # s, of the force along a pass
NARROWEST = 1 * MM  # half width of a disc beside the path: twice its length is then still below 5 mm


@dataclass(frozen=True)
class Path:
    """Straight one-way passes: start points (passes, 2) m, lengths (passes,) m, and their ``direction``.

    ``direction`` is a complex number of size one; all passes have it to within ``spread``, rad.
    """

    start: Array
    length: Array
    direction: complex
    spread: float

    def along(self, x: Array, y: Array) -> Array:
        """Position of points in the direction of travel, m."""
        return np.asarray(x * self.direction.real + y * self.direction.imag)

    def aside(self, x: Array, y: Array) -> Array:
        """Position of points across the direction of travel, to its left, m."""
        return np.asarray(y * self.direction.real - x * self.direction.imag)


@dataclass(frozen=True, eq=False)
class Passages:
    """Every time that the cutter's rim went over each point of a face.

    Attributes
    ----------
    x, y : (n, k) position of the tool's centre at the passage, m.
    rim : (n, k) position of the point on the rim: angle from the left of the feed clockwise, rad.
    number : (n, k) index of the pass. along : (n, k) way from the start of the pass, m.
    valid : (n, k) whether there is such a passage (points have different numbers of passages).
    """

    x: Array
    y: Array
    rim: Array
    number: np.ndarray
    along: Array
    valid: np.ndarray


@dataclass(frozen=True, eq=False)
class Pace:
    """Position of the axis on a face over time.

    Attributes
    ----------
    speed : feed, m/s. period : from the start of a pass to that of the next, s.
    edge, leaving : (passes,) way of the axis from the start of a pass to the block's edge, and to that where
        it leaves the block, m; NaN if the size of the work is not known.
    radius : of the cutter, m: the force falls while the front half of the cutter leaves.
    """

    speed: float
    period: float
    edge: Array
    leaving: Array
    radius: float

    def time(self, passages: Passages) -> Array:
        """Time of each passage from the start of the first pass, (n, k) s."""
        return np.asarray(passages.number * self.period + passages.along / self.speed)

    def inside(self, passages: Passages) -> Array:
        """Distance of the axis past the block's edge at each passage, (n, k) m."""
        return np.asarray(passages.along - self.edge[passages.number])

    def outside(self, passages: Passages) -> Array:
        """Distance of the axis past the edge where it leaves the block, (n, k) m; negative before."""
        return np.asarray(passages.along - self.leaving[passages.number])


def make_path(table: pd.DataFrame) -> Path:
    """Return the passes of a path table; ValueError if no pass has two points."""
    ends = (
        table.groupby("pass", sort=False)[["x_mm", "y_mm"]].agg(["first", "last"]).to_numpy(dtype=float) * MM
    )
    step = (ends[:, 1] - ends[:, 0]) + 1j * (ends[:, 3] - ends[:, 2])
    moved = np.abs(step) > 0
    if not moved.any():
        raise ValueError("no pass of the path has two points")
    turn = step[moved] / np.abs(step[moved])
    mean = complex(np.median(turn.real), np.median(turn.imag))
    mean = mean / abs(mean) if abs(mean) > 0.1 else complex(turn[0])
    spread = float(np.abs(np.angle(turn / mean)).max())
    return Path(ends[moved][:, [0, 2]], np.abs(step[moved]), mean, spread)


def passages(path: Path, x: Array, y: Array, radius: float) -> Passages:
    """Every time that the rim of a cutter of ``radius`` goes over the points ``x``, ``y`` (n,) m.

    An end mill is dished, so that its rim cuts. A pass that reaches a point goes over it twice: in front of
    the axis and behind it.
    """
    start_along, start_aside = path.along(*path.start.T), path.aside(*path.start.T)
    ahead = path.along(x, y)[:, None] - start_along
    across = path.aside(x, y)[:, None] - start_aside
    half = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    reached = np.abs(across) < radius
    along = np.stack([ahead - half, ahead + half], axis=2)
    valid = reached[:, :, None] & (along >= 0) & (along <= path.length[:, None])
    number = np.broadcast_to(np.arange(len(path.length))[:, None], along.shape[1:])
    most = max(1, int(valid.sum(axis=(1, 2)).max()))
    flat = valid.reshape(len(x), -1)
    kept = np.argsort(~flat, axis=1, kind="stable")[:, :most]
    rows = np.arange(len(x))[:, None]
    taken = np.broadcast_to(number, along.shape).reshape(len(x), -1)[rows, kept]
    way = along.reshape(len(x), -1)[rows, kept]
    centre_x = path.start[taken, 0] + way * path.direction.real
    centre_y = path.start[taken, 1] + way * path.direction.imag
    sides = np.stack([half, -half], axis=2)  # the point is ahead of the axis, then behind it
    rim = np.arctan2(sides, across[:, :, None]).reshape(len(x), -1)[rows, kept]
    parts = (centre_x, centre_y, rim, taken, way, flat[rows, kept])
    # Passage after passage: a face is asked for its lowest passage at all of its points, many times over, and
    # to go along the few passages of one point, then along those of the next, takes three times as long.
    return Passages(*map(np.asfortranarray, parts))


def disc_along(table: pd.DataFrame, pitch: float) -> Window:
    """Return the disc over which heights are averaged along a path, of a cloud with this ``pitch``, m.

    It is no wider than a third of the spacing of the passes, where discs of this width beside it show more.
    """
    path = make_path(table)
    third = _third(path)
    return window(pitch, third / 2 if third >= 2 * NARROWEST else math.inf, path.direction)


def beside(table: pd.DataFrame) -> pd.DataFrame:
    """Return the points of a path table moved aside by a third of the spacing of its passes, to either side.

    A dished cutter leaves a groove along each pass, whose shape is only visible beside the middle. The table
    is empty if discs there would overlap those of the path.
    """
    path = make_path(table)
    third = _third(path)
    if third < 2 * NARROWEST:
        return table[:0]
    left = third / MM * np.array([-path.direction.imag, path.direction.real])
    return pd.concat(
        [
            table.assign(x_mm=table["x_mm"] + side * left[0], y_mm=table["y_mm"] + side * left[1])
            for side in (-1, 1)
        ],
        ignore_index=True,
    )


def _third(path: Path) -> float:
    """Return a third of the spacing of the passes, m; 0 if there is but one."""
    gaps = np.diff(np.sort(path.aside(*path.start.T)))
    return float(np.median(gaps[gaps > 0])) / 3 if (gaps > 0).any() else 0.0


def turn_from_declared(batch: Batch, run: str, path: Path) -> float:
    """Angle from the declared feed direction to that of the path, rad; the path is trusted."""
    declared = float(batch.runs["feed_direction_deg"].astype(float).fillna(0.0)[run])
    return math.remainder(cmath.phase(path.direction) - declared * DEG, 2 * math.pi)


def narrow_passes(batch: Batch, run: str, path: Path, radius: float) -> np.ndarray:
    """Mark the passes that find less of the declared width of cut left than :data:`NARROW` of it, (passes,).

    Earlier passes have taken what their cutter went over, and beside the work there is none. Where the size
    of the work is not known, no pass is narrow.
    """
    corners = _corners(batch, path, aside=True)
    declared = float(batch.runs["radial_depth_mm"].astype(float)[run]) * MM
    if not (np.isfinite(corners).all() and declared > 0.0):
        return np.zeros(len(path.length), dtype=bool)
    place = np.linspace(corners.min(), corners.max(), ASIDE_POINTS)
    left, width = np.ones(len(place), dtype=bool), np.ptp(corners) / (len(place) - 1)
    narrow = []
    for aside in path.aside(*path.start.T):
        taken = left & (np.abs(place - aside) <= radius)
        narrow.append(taken.sum() * width < NARROW * declared)
        left &= ~taken
    return np.array(narrow)


def make_pace(batch: Batch, run: str, path: Path, tool: Cutter) -> Pace:
    """Return the pace of the axis: passes at the feed of the run table, then returns."""
    rate = float(batch.runs["spindle_rpm"].astype(float)[run]) / 60
    speed = cutting_force.cut(batch, run, tool.radius).feed_per_tooth * tool.teeth * rate
    way = float(path.length.max())
    pause = float(batch.runs["return_s"].astype(float)[run]) if "return_s" in batch.runs else math.nan
    period = way / speed + (pause if pause >= 0 else way / RETURN_SPEED + RETURN_PAUSE)
    corners, start = _corners(batch, path), path.along(*path.start.T)
    return Pace(speed, period, corners.min() - start, corners.max() - start, tool.radius)


def work_size(batch: Batch) -> tuple[float, float]:
    """Length of the work along x and y, m; NaN if the manifest does not give it."""
    size = (batch.manifest.get("work") or {}).get("size_mm") or (math.nan, math.nan)
    return float(size[0]) * MM, float(size[1]) * MM


def _corners(batch: Batch, path: Path, *, aside: bool = False) -> Array:
    """Position along the direction of travel of the work's corners, (4,) m, or ``aside`` of it.

    One corner is the origin.
    """
    x, y = work_size(batch)
    across = path.aside if aside else path.along
    return across(*np.array([[0, 0], [x, 0], [0, y], [x, y]]).T)


def force_over_period(
    batch: Batch, run: str, values: Mapping[str, float], path: Path, tool: Cutter
) -> tuple[Array, float, float]:
    """Return force on the tool (n, 3) N, work frame, over a pass and return, the period (s) and speed (m/s).

    The force rises while the cutter enters the block, whose corner is the work frame's origin, and falls
    while it leaves.
    """
    pace, way = make_pace(batch, run, path, tool), float(path.length.max())
    corners = _corners(batch, path)
    count = round(pace.period / STEP)
    centre = path.along(*path.start[0]) + pace.speed * pace.period * np.arange(count) / count
    ramp = np.linspace(-tool.radius, 0.0, RAMP_POINTS)
    entering, leaving = _ramps(batch, run, values, tool, -ramp / tool.radius)
    cutting = centre <= path.along(*path.start[0]) + way
    force = np.empty((count, 3))
    for axis in range(3):
        rise = np.interp(centre - corners.min(), ramp, entering[:, axis])
        fall = np.interp(centre - corners.max(), ramp, leaving[:, axis])
        force[:, axis] = np.where(cutting, rise + fall - leaving[0, axis], 0.0)
    turn = cutting_force.turn_about_z(cmath.phase(path.direction))
    return force @ turn.T, pace.period, pace.speed


def _ramps(
    batch: Batch, run: str, values: Mapping[str, float], tool: Cutter, edge: Array
) -> tuple[Array, Array]:
    """Mean forces (k, 3), feed frame, with the block's edge ``edge`` radii ahead of the axis: entry, exit.

    Teeth cut where sin φ > edge while the cutter enters, and where sin φ < edge while it leaves.
    """
    whole = cutting_force.cut(batch, run, tool.radius)
    si = np.array([values[name] for name in COEFFICIENTS]) * cutting_force.TO_SI
    first, last = whole.engagement.entry, whole.engagement.exit

    def force(entry: float, leave: float) -> Array:
        if leave - entry < 1e-9:
            return np.zeros(3)
        part = Cut(whole.feed_per_tooth, whole.axial_depth, Engagement(entry, leave))
        return mean_force(tool, EdgeLaw(), part, si)

    angles = np.arcsin(edge)
    entering = [force(max(first, a), min(last, math.pi - a)) for a in angles]
    leaving = [force(first, min(last, a)) + force(max(first, math.pi - a), last) for a in angles]
    return np.array(entering), np.array(leaving)
