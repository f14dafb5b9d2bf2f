"""What the friction of each joint does along the paths of the cuts, as the idle runs show it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from metro.joint_columns import Axes
from metro.observables.joint_force import friction
from metro.observables.problem import Refusal
from metro.robot.drive_torques import PRESLIDING, TURNING, slid
from metro.robot.friction import Friction
from metro.robot.kinematics import Arm
from metro.robot.motion import Motion
from metro.robot.presliding import IdlePath, Presliding, presliding
from metro.robot.stribeck import Stribeck, stribeck
from metro.signals.waves import SMOOTH, variance
from metro.units import MRAD, Array

# Columns of joints in the table ``joint_torque``.
NOISE, WANDER, IDLE = "noise{}_nm", "wander{}_nm", "idle{}_nm"
START, TURN, PEAK = "start{}", "presliding{}_mrad", "peak{}"


def with_friction(
    runs: list[pd.DataFrame], arm: Arm, found: tuple[Friction, Motion] | Refusal
) -> pd.DataFrame:
    """Put the tables of all runs into one, with what the friction of each joint does along them.

    That is its state where each path begins, the turn over which it follows, and by how much it is above its
    mean over all cuts, by the speed of the joint. ``found`` : the friction that the idle runs identify.
    """
    axes = arm.axes
    states = [_rubbed(table, arm, found) for table in runs]
    wander = slow_noise(runs, axes)
    columns = zip(*(axes.driven(name) for name in (IDLE, NOISE, START, TURN, PEAK)), strict=True)
    rows: list[dict[str, Any]] = [{} for _ in runs]
    for joint, slow, (own, noise, start, turn, peak) in zip(axes.turning, wander, columns, strict=True):
        paths = []
        for table, state in zip(runs, states, strict=True):
            q, rate = (table[names[joint]].to_numpy() for names in (axes.positions, axes.rates))
            # Of the noise of the difference, half of its variance is that of the idle run.
            white = 0.5 * table[noise].iloc[0] ** 2 / table["samples"].iloc[0]
            sd = np.sqrt(variance(len(table), np.array([white]), np.array([0.5 * slow**2])))[:, 0]
            unit = axes.units[joint]
            seen = state[:, joint] if np.isfinite(state[:, joint]).all() else None
            paths.append(IdlePath(q * unit, rate * unit, table[own].to_numpy(), sd, seen))
        following = presliding(paths)
        for row, began in zip(rows, following.start, strict=True):
            row |= {start: float(began), turn: following.turn / MRAD}
        curve = _by_speed(paths, following)
        levels = [curve.at(path.rate) for path in paths]
        mean = float(np.concatenate(levels).mean())
        for row, level in zip(rows, levels, strict=True):
            row |= {peak: level / mean}
    return pd.concat([run.assign(**row) for run, row in zip(runs, rows, strict=True)], ignore_index=True)


def _by_speed(paths: Sequence[IdlePath], following: Presliding) -> Stribeck:
    """Return how the friction of a joint falls with its speed; not at all where its friction is not seen."""
    turn = following.turn if math.isfinite(following.turn) else PRESLIDING
    seen = [
        (path.rate, slid(path.q, path.rate, turn, float(start)), path.rubbed)
        for path, start in zip(paths, following.start, strict=True)
        if path.rubbed is not None
    ]
    if not seen:
        return Stribeck()
    rate, state, rubbed = (np.concatenate(parts) for parts in zip(*seen, strict=True))
    # The weight that was fitted is off by a smooth curve along each path: it has no more values than that.
    return stribeck(rate, state, rubbed, friction.CLEAR * math.sqrt(len(rate) / (SMOOTH * len(seen))))


def _rubbed(table: pd.DataFrame, arm: Arm, found: tuple[Friction, Motion] | Refusal) -> Array:
    axes = arm.axes
    torque = np.zeros((len(table), len(axes)))
    torque[:, axes.turning] = table[axes.driven(IDLE)].to_numpy()
    return friction.rubbed(found, arm.dh, table[axes.positions].to_numpy() * axes.units, torque)


def slow_noise(runs: Sequence[pd.DataFrame], axes: Axes) -> Array:
    """Return the level of the slow noise (k,), N m, rms over the runs: each says little of it."""
    levels = np.array([table[axes.driven(WANDER)].iloc[0] for table in runs], dtype=float)
    return np.asarray(np.sqrt((levels**2).mean(axis=0)))


def smooth(torque: Array, s: Array, rate: Array) -> Array:
    """Return the torques (m, k) of an idle run along its path ``s`` (m,), without what is noise in them.

    Their noise is in the difference of cut and idle run, too, where a share of it would pass for theirs.
    ``rate`` (m, k), rad/s.
    """
    place = 2.0 * (s - s[0]) / (s[-1] - s[0]) - 1.0
    steps = np.tanh(rate / TURNING)
    shapes = np.column_stack([np.polynomial.legendre.legvander(place, SMOOTH - 1), steps])
    return np.asarray(shapes @ np.linalg.lstsq(shapes, torque)[0])
