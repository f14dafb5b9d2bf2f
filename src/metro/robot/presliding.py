"""How friction follows a joint that turns round, and in which state a path began, by idle runs.

A joint that comes from the other side, and starts slowly, still carries friction the other way over a turn of
some tenths of a milliradian, which may be centimetres of the path. The logs rarely hold what went before; the
idle run shows it, since nothing else of its torque fades over that turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.robot.drive_torques import LEAST_TURN, PRESLIDING, slid
from metro.signals.waves import SMOOTH, waves
from metro.units import MRAD, Array

MOST = 2.0 * MRAD  # turn that is tried: twice the largest that is found of joints with gears (docs/robot.md)
TRIED = 9
# Of -2 log-likelihood, two standard deviations: a turn is identified where half and twice of it are this much
# worse, and a joint came from elsewhere than as it moves at its start where that is this much better.
IDENTIFIED = 4.0
SEEN = 0.4  # of the level: twice what friction is seen to, beyond which a joint came from elsewhere
LEAST_CHANGE = 1e-3  # of the level and of the logarithm of the turn, to which they are sought


@dataclass(frozen=True, eq=False)
class IdlePath:
    """One joint along the path of one idle run.

    ``q``, ``rate`` (m,) rad, rad/s; ``torque`` (m,) N m; ``sd`` (m,) N m of the noise of its waves;
    ``rubbed`` (m,) what of the torque is friction, over its Coulomb level; None where that is not known.
    """

    q: Array
    rate: Array
    torque: Array
    sd: Array
    rubbed: Array | None = None


@dataclass(frozen=True, eq=False)
class Presliding:
    """How the friction of a joint follows its turns.

    ``turn`` : over which it follows, rad; NaN where the idle runs do not identify it. ``start`` (r,) friction
    over its level where each path begins, −1 … 1.
    """

    turn: float
    start: Array


@dataclass(frozen=True)
class _Whitened:
    """Parts of one torque in units of its noise, beside a polynomial: measured, from state 0, by the state.

    Of them only the scalar products are needed; ``moved`` is the state of a joint that moved as at its start.
    """

    measured_slid: float
    slid_slid: float
    measured_start: float
    slid_start: float
    start_start: float
    moved: float

    def state(self, level: float) -> float:
        """Return the likeliest state at the start, −1 … 1, of friction of a level, N m."""
        return self._likeliest(level)[1]

    def cost(self, level: float) -> float:
        """Return −2 log-likelihood, but for a constant, at the likeliest state."""
        return self._likeliest(level)[0]

    def _likeliest(self, level: float) -> tuple[float, float]:
        free = (self.measured_start - level * self.slid_start) / max(
            level * self.start_start, np.finfo(float).tiny
        )
        best = min(max(free, -1.0), 1.0)
        return min((self._at(level, self.moved), self.moved), (self._at(level, best) + IDENTIFIED, best))

    def _at(self, level: float, state: float) -> float:
        shape_shape = self.slid_slid + 2.0 * state * self.slid_start + state**2 * self.start_start
        return level**2 * shape_shape - 2.0 * level * (self.measured_slid + state * self.measured_start)


def presliding(paths: Sequence[IdlePath]) -> Presliding:
    """Identify the turn over which the friction of a joint follows, and its state where each path begins.

    The level is that of all runs together. Beside friction each torque has a polynomial along its path, of
    gravity. Where the turn is not identified, the states are those of the usual one. A joint that keeps its
    direction in all runs shows only the product of the level and of what its state lacks: then the least
    level is taken, since of levels any order of magnitude is as likely.

    Parameters
    ----------
    paths : of the one joint, r runs.
    """
    from scipy.optimize import minimize_scalar

    def cost(logarithm: float) -> float:
        return _level(paths, math.exp(logarithm))[1]

    grid = np.linspace(math.log(LEAST_TURN), math.log(MOST), TRIED)
    costs = [cost(one) for one in grid]
    best = int(np.argmin(costs))
    around = grid[max(best - 1, 0)], grid[min(best + 1, TRIED - 1)]
    found = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": LEAST_CHANGE})
    beside = min(cost(float(found.x) + step) for step in (-math.log(2.0), math.log(2.0)))
    turn = math.exp(float(found.x)) if beside > float(found.fun) + IDENTIFIED else math.nan
    used = turn if math.isfinite(turn) else PRESLIDING
    level, _ = _level(paths, used)
    return Presliding(turn, np.array([_start(path, used, level) for path in paths]))


def _start(path: IdlePath, turn: float, level: float) -> float:
    """Return the state of friction where a path begins: as it was seen, else the likeliest for a ``level``.

    A joint that hardly moves keeps its state along the path, where only its weight tells friction from it.
    """
    if path.rubbed is None:
        return _whitened(path, turn).state(level)
    rest, from_one = (slid(path.q, path.rate, turn, start) for start in (0.0, 1.0))
    by_state = from_one - rest
    seen = float(by_state @ (path.rubbed - rest)) / max(float(by_state @ by_state), np.finfo(float).tiny)
    moved = float(slid(path.q, path.rate, turn)[0])
    return float(np.clip(seen, -1.0, 1.0)) if abs(seen - moved) > SEEN else moved


def _level(paths: Sequence[IdlePath], turn: float) -> tuple[float, float]:
    """Return the likeliest level of friction, N m, and −2 log-likelihood at it."""
    from scipy.optimize import minimize_scalar

    parts = [_whitened(path, turn) for path in paths]
    least = min(float(path.sd.min()) for path in paths)  # below it no level is seen
    most = max(least, *(float(np.ptp(path.torque)) for path in paths))

    def cost(logarithm: float) -> float:
        level = math.exp(logarithm)
        return 2.0 * math.log(least + level) + sum(part.cost(level) for part in parts)

    grid = np.linspace(math.log(least), math.log(most), TRIED)
    best = int(np.argmin([cost(one) for one in grid]))
    around = grid[max(best - 1, 0)], grid[min(best + 1, TRIED - 1)]
    found = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": LEAST_CHANGE})
    return math.exp(float(found.x)), float(found.fun)


def _whitened(path: IdlePath, turn: float) -> _Whitened:
    count = len(path.q)
    rest, from_one = (slid(path.q, path.rate, turn, start) for start in (0.0, 1.0))
    level = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, count), SMOOTH - 1)
    columns = waves(np.column_stack([path.torque, rest, from_one - rest, level])) / path.sd[:, None]
    smooth, _ = np.linalg.qr(columns[:, 3:])
    shapes = columns[:, :3] - smooth @ (smooth.T @ columns[:, :3])
    moved = float(slid(path.q, path.rate, turn)[0])
    measured, from_none, by_state = shapes.T
    return _Whitened(
        measured_slid=float(measured @ from_none),
        slid_slid=float(from_none @ from_none),
        measured_start=float(measured @ by_state),
        slid_start=float(from_none @ by_state),
        start_start=float(by_state @ by_state),
        moved=moved,
    )
