"""The force of a side cut from entry to exit: its mean over a turn by place, and its ripple within a turn.

The chips are traced for one turn at places of the entry and of the exit and once, finely, in full cut, not
all along the wall: between entry and exit nothing changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.chips import Engagement, Tool
from virtual_cell.milling import Coefficients, Cut, forces
from virtual_cell.motion import Straight
from virtual_cell.units import MM, RPM, Array

_PER_TURN, _PLACES = 72, 14
_FINE = 2880  # of 72, orders that are not seen would fold to seen ones: 6 % of order 9
_BALANCE = 5  # each iteration gains a factor of compliance × slope of the force: about ten


@dataclass(frozen=True)
class SideCut:
    """What is cut: tool, metal, and programmed settings; lengths in m, ``speed`` of the feed m/s."""

    tool: Tool
    coefficients: Coefficients
    spindle_rpm: float
    speed: float
    axial: float
    radial: float
    direction: str
    length: float

    @property
    def reach(self) -> float:
        """How far ahead of its axis the tool touches the block."""
        return math.sqrt(self.radial * (2.0 * self.tool.radius - self.radial))


@dataclass(frozen=True)
class SideForce:
    """Force on the tool, feed frame, N.

    Attributes
    ----------
    x : (m,) places of the axis, m from the face where the tool enters. mean : (m, 3) over a turn.
    turn : (_FINE, 3) one turn in full cut. spindle : rad/s. phase : of the spindle at t = 0.
    """

    x: Array
    mean: Array
    turn: Array
    spindle: float
    phase: float

    def mean_at(self, x: Array) -> Array:
        """Mean over a turn (n, 3) with the axis at places ``x`` (n,), m; zero outside of the block."""
        return np.stack([np.interp(x, self.x, part, left=0.0, right=0.0) for part in self.mean.T], axis=1)

    def at(self, t: Array, x: Array, rate: float) -> Array:
        """Force (n, 3) at times ``t`` (s) and places ``x``, as a sensor of ``rate`` (Hz) can follow it."""
        mean = self.mean_at(x)
        share = np.linalg.norm(mean, axis=1) / np.linalg.norm(self.turn.mean(axis=0))
        spectrum = np.fft.rfft(self.turn, axis=0)
        order = np.arange(len(spectrum))
        spectrum[(order == 0) | (order * self.spindle / (2.0 * math.pi) > 0.45 * rate)] = 0.0
        ripple = np.fft.irfft(spectrum, _FINE, axis=0)
        angle = np.mod(self.phase + self.spindle * t, 2.0 * math.pi)
        grid = np.arange(_FINE) * (2.0 * math.pi / _FINE)
        within = np.stack([np.interp(angle, grid, one, period=2.0 * math.pi) for one in ripple.T], axis=1)
        return np.asarray(mean + share[:, None] * within)


def full_cut(cut: SideCut) -> Array:
    """Mean force (3,), N, over a turn in full cut, feed frame, at the programmed radial depth."""
    mean: Array = _full_turn(cut, cut.spindle_rpm * RPM, 0.0).mean(axis=0)
    return mean


def side_force(
    cut: SideCut, give: Callable[[Array], float], *, speed_error: float, phase: float
) -> SideForce:
    """Force of a cut at the remaining radial depth where the wall stands proud by ``give(force)``, m.

    ``force`` (3,) is the mean in full cut, feed frame. ``speed_error`` relative, of the spindle.
    """
    spindle = cut.spindle_rpm * RPM * (1.0 + speed_error)
    proud = 0.0
    for _ in range(_BALANCE):
        turn = _full_turn(cut, spindle, proud)
        proud = give(turn.mean(axis=0))
    step = np.linspace(-1.0 * MM, cut.reach + 1.0 * MM, _PLACES)
    places = np.concatenate([step - cut.reach, cut.length - cut.reach + step])
    mean = _turns(cut, spindle, proud, places, _PER_TURN).mean(axis=1)
    mean[[0, -1]] = 0.0
    mean[[_PLACES - 1, _PLACES]] = turn.mean(axis=0)
    return SideForce(places, mean, turn, spindle, phase)


def _full_turn(cut: SideCut, spindle: float, proud: float) -> Array:
    """Force (_FINE, 3), N, over one turn in full cut."""
    return np.asarray(_turns(cut, spindle, proud, np.array([0.5 * cut.length]), _FINE)[0])


def _turns(cut: SideCut, spindle: float, proud: float, places: Array, samples: int) -> Array:
    """Force (places, samples, 3), N, over one turn about each place of the axis, m."""
    edge = cut.tool.radius - cut.radial + proud
    motion = Straight(cut.speed, 0.0, cut.length, cut.direction, edge)
    turn = 2.0 * math.pi / spindle
    t = places[:, None] / cut.speed + (np.arange(samples) / samples - 0.5) * turn
    engaged = Cut(Engagement(cut.tool, motion, spindle, 0.0, cut.axial), cut.coefficients)
    return forces(engaged, t.ravel()).reshape(len(places), samples, 3)
