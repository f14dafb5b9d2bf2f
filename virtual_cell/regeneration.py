"""Cutting tests of a tool on a flexible structure, marched in time: chatter grows until teeth leave the cut.

All tests march together. Each keeps the surface that all passes before left, direction by direction, in a
frame that moves with the tool: a tooth cuts what lies beyond the surface, and nothing where it has jumped
clear of it. The modes move exactly under a force held over a step; the force held is that of the middle of
the step, extrapolated from the two before, so that the march is of second order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.milling import Coefficients
from virtual_cell.modes import Modes
from virtual_cell.units import Array


@dataclass(frozen=True)
class Trials:
    """Cuts by a tool of zero helix, as they really are.

    Attributes
    ----------
    modes : of the two directions of the plane of cutting.
    coefficients : law of the force; its ``wear`` is per metre of feed.
    teeth, feed : number of teeth, feed per tooth (m).
    rpm, depth : (n,) speeds and axial depths (m).
    runout, runout_angle : offset of the tool from the axis (m), its direction from tooth 0 (rad).
    orbit : by what angle (rad) the direction of feed turns in each revolution of the spindle.
    scatter : relative standard deviation of the force from step to step: chips that break, hard grains.
    entry : turns over which the depth grows from nothing, as on the first orbit of a helix.
    immersion : angles from +y clockwise between which a tooth meets the work, rad.
    turned : angle by which the modes are turned from x towards y, rad.
    ploughing : process damping, its coefficient over the tool's radius, N/m²: a tooth that moves into the
        work at v is pushed back by this, times depth and v over the spindle's angular speed.
    strength : (n,) or one: how many times the force of the chip is that of the law.
    uneven : (N,) how far teeth are from their even pitch, rad, clockwise; to the next step of the march.
    """

    modes: tuple[Modes, Modes]
    coefficients: Coefficients
    teeth: int
    feed: float
    rpm: Array
    depth: Array
    runout: float = 0.0
    runout_angle: float = 0.0
    orbit: float = 0.0
    scatter: float = 0.0
    entry: int = 0
    immersion: tuple[float, float] = (0.0, math.pi)
    turned: float = 0.0
    ploughing: float = 0.0
    strength: Array | float = 1.0
    uneven: tuple[float, ...] = ()


@dataclass(frozen=True)
class History:
    """What happened: force on the tool (n, steps, 3), N; tip (n, steps, 2), m; its acceleration, m/s²."""

    dt: Array
    force: Array
    tip: Array
    acceleration: Array

    def at(self, test: int, t: Array, what: str = "force") -> Array:
        """Return a channel of one test at times ``t`` (s); before the start, what it was at the start."""
        from scipy.interpolate import CubicSpline

        values = getattr(self, what)[test]
        inside = np.clip(t / self.dt[test], 0.0, len(values) - 1.0)
        smooth: Array = CubicSpline(np.arange(len(values)), values)(inside)
        return smooth


def march(trials: Trials, turns: int, per_turn: int, seed: int = 0) -> History:
    """Cut all tests for some ``turns`` of the spindle, in ``per_turn`` steps each (a multiple of the teeth).

    The tool starts at rest.
    """
    rng = np.random.default_rng(seed)
    count, steps = len(trials.rpm), turns * per_turn
    dt = 60.0 / (trials.rpm * per_turn)
    structure = _Structure(trials.modes, dt, trials.turned)
    angle = 2.0 * math.pi * (np.arange(per_turn) + 0.5) / per_turn
    tooth, feed = _teeth(trials, per_turn)
    eccentric = trials.runout * np.cos(trials.runout_angle - angle[tooth] + angle[0])
    surface = np.zeros((count, per_turn))
    force, tip, acceleration = (np.zeros((count, steps, d)) for d in (3, 2, 2))
    for i in range(steps):
        turn, at = i / per_turn, (i + tooth) % per_turn
        sine, cosine = np.sin(angle[at]), np.cos(angle[at])
        tip[:, i] = structure.tip
        reach = tip[:, i, :1] * sine + tip[:, i, 1:] * cosine + eccentric
        inside = (angle[at] > trials.immersion[0]) & (angle[at] < trials.immersion[1])
        advance = np.where(inside, feed * np.sin(angle[at] + trials.orbit * turn), 0.0)
        chip = cleared(surface, at, reach, advance)
        depth = trials.depth * min(1.0, (turn + 1.0 / per_turn) / max(trials.entry, 1e-9))
        depth = depth * (1.0 + trials.scatter * rng.standard_normal(count))
        per_depth = _per_depth(trials, chip, turn, sine, cosine)
        if trials.ploughing:
            per_depth[:, :2] += _ploughing(trials, chip, structure.velocity, sine, cosine)
        force[:, i] = per_depth * depth[:, None]
        acceleration[:, i] = structure.acceleration(force[:, i])
        structure.step(1.5 * force[:, i] - 0.5 * force[:, max(i - 1, 0)])
    return History(dt, force, tip, acceleration)


def _teeth(trials: Trials, per_turn: int) -> tuple[np.ndarray, Array]:
    """Return the places of the teeth (N,), in steps, and the feed (N,), m, since the one before passed by."""
    tooth = np.arange(trials.teeth) * (per_turn // trials.teeth)
    if not trials.uneven:
        return tooth, np.full(trials.teeth, trials.feed)
    tooth = tooth + np.round(np.array(trials.uneven) * per_turn / (2.0 * math.pi)).astype(int)
    ahead = np.mod(np.roll(tooth, -1) - tooth, per_turn)
    return tooth, trials.feed * trials.teeth * ahead / per_turn


def _per_depth(trials: Trials, chip: Array, turn: float, sine: Array, cosine: Array) -> Array:
    """Force on the tool (n, 3) per depth, N/m, of chips (n, N), m, after some turns."""
    worn = trials.coefficients.worn(trials.feed * trials.teeth * turn)
    tangential, radial, axial = trials.coefficients.per_length(chip, worn)
    parts = [-(tangential * cosine + radial * sine), tangential * sine - radial * cosine, axial]
    return np.stack([part.sum(axis=1) * trials.strength for part in parts], axis=1)


def _ploughing(trials: Trials, chip: Array, velocity: Array, sine: Array, cosine: Array) -> Array:
    """Force on the tool (n, 2) per depth, N/m, of flanks that rub on the waves that they cut."""
    into = (velocity[:, :1] * sine + velocity[:, 1:] * cosine) * (chip > 0.0)
    rubbed = -trials.ploughing * 60.0 / (2.0 * math.pi * trials.rpm[:, None]) * into
    return np.stack([(rubbed * sine).sum(axis=1), (rubbed * cosine).sum(axis=1)], axis=1)


def cleared(surface: Array, at: np.ndarray, reach: Array, advance: Array) -> Array:
    """Chip thickness (n, N), m, of teeth that reach so far in directions ``at``; leaves the new surface.

    ``surface`` (n, directions) is where all earlier passes left it, in a frame that has moved by ``advance``
    since the last of them. Where the tool has passed by, there is no material that it could meet.
    """
    ahead = advance > 0.0
    old = surface[:, at] - advance
    surface[:, at] = np.where(ahead, np.maximum(old, reach), 0.0)
    chip: Array = np.where(ahead, np.maximum(reach - old, 0.0), 0.0)
    return chip


class _Structure:
    """Modes of both directions as they move, test by test."""

    def __init__(self, modes: tuple[Modes, Modes], dt: Array, turned: float) -> None:
        names = Modes.__dataclass_fields__
        self._modes = Modes(*(np.concatenate([getattr(m, name) for m in modes], axis=-1) for name in names))
        self._axis = np.repeat([0, 1], [m.damped.shape[-1] for m in modes])
        c, s = math.cos(turned), math.sin(turned)
        self._along = np.array([[c, s], [-s, c]])  # rows: the directions of the modes
        self._first = np.searchsorted(self._axis, [0, 1])
        self._step, self._push = self._modes.steps(dt)
        self._x = np.zeros((len(dt), len(self._axis)))
        self._v = np.zeros_like(self._x)

    @property
    def tip(self) -> Array:
        """Displacement (n, 2), m."""
        return self._over_modes(self._x)

    @property
    def velocity(self) -> Array:
        """Velocity (n, 2), m/s."""
        return self._over_modes(self._v)

    def acceleration(self, force: Array) -> Array:
        """Acceleration (n, 2), m/s², under a force (n, 3), N."""
        m = self._modes
        per_mass = m.omega**2 / m.stiffness
        along = force[:, :2] @ self._along.T
        return self._over_modes(
            per_mass * along[:, self._axis] - 2.0 * m.damping * m.omega * self._v - m.omega**2 * self._x
        )

    def step(self, force: Array) -> None:
        """Move on by a step under a force (n, 3), N, that is held over it."""
        s, p, f = self._step, self._push, (force[:, :2] @ self._along.T)[:, self._axis]
        x, v = self._x, self._v
        self._x = s[..., 0, 0] * x + s[..., 0, 1] * v + p[..., 0] * f
        self._v = s[..., 1, 0] * x + s[..., 1, 1] * v + p[..., 1] * f

    def _over_modes(self, values: Array) -> Array:
        total: Array = np.add.reduceat(values, self._first, axis=1) @ self._along
        return total
