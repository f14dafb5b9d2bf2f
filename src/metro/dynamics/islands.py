"""All crossings of the unit circle at a speed, not the lowest alone: islands of stability and of chatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.dynamics import collocation, crossings
from metro.dynamics.lobes import chatter_hz, discretised, groups, kind
from metro.dynamics.system import Cut, Structure
from metro.units import Array

_POINTS = (0.75, 12)  # per radian of the fastest vibration, and further ones per panel
_ANGLES = (60, 300)  # of the scan; the second where the first did not find all
_CHECKED = np.linspace(0.15, 1.0, 7)  # shares of the depth at which the unstable multipliers are counted


@dataclass(frozen=True)
class Crossings:
    """Crossings of all speeds, by speed and rising depth.

    Attributes
    ----------
    speed : (c,) index of the spindle speed.
    depth : (c,) axial depth, m.
    chatter_hz : (c,) Hz.
    kind : (c,) "hopf" or "flip".
    multipliers : (c,) how many multipliers leave the unit circle there as the depth grows: two of a pair, one
        of a flip; negative where they come back.
    complete : (k,) per speed, whether the crossings account for the unstable multipliers of every depth that
        was checked.
    """

    speed: np.ndarray
    depth: Array
    chatter_hz: Array
    kind: np.ndarray
    multipliers: np.ndarray
    complete: np.ndarray

    def unstable(self, speed: int, depth: float) -> int:
        """How many multipliers are outside the unit circle at speed index ``speed`` and ``depth``, m."""
        below = (self.speed == speed) & (self.depth < depth)
        return int(self.multipliers[below].sum())


def all_crossings(structure: Structure, cut: Cut, rpm: Array, deepest: float) -> Crossings:
    """Find every depth up to ``deepest`` (m) at which stability changes, at speeds ``rpm`` (k,), rev/min."""
    rpm = np.asarray(rpm, dtype=float)
    parts, complete = [], np.ones(len(rpm), dtype=bool)
    for members in groups(structure, cut, rpm):
        group = members
        for angles in _ANGLES:
            crossings_of_group = _of_group(structure, cut, rpm[group], deepest, angles)
            last = angles == _ANGLES[-1]
            kept = crossings_of_group.complete[crossings_of_group.speed] | last
            parts.append(
                (
                    group[crossings_of_group.speed],
                    crossings_of_group.depth,
                    crossings_of_group.chatter_hz,
                    crossings_of_group.kind,
                    crossings_of_group.multipliers,
                    kept,
                )
            )
            complete[group] = crossings_of_group.complete
            group = group[~crossings_of_group.complete]
            if not len(group):
                break
    speed, depth, frequency, label, count, kept = (np.concatenate(c) for c in zip(*parts, strict=True))
    order = np.lexsort((depth, speed))
    order = order[kept[order]]
    columns = (speed[order], depth[order], frequency[order], label[order], count[order])
    return Crossings(*columns, complete)


def _of_group(structure: Structure, cut: Cut, rpm: Array, deepest: float, count: int) -> Crossings:
    arc, equation = discretised(structure, cut, rpm, *_POINTS)
    start = crossings.scan(structure, collocation.reduced(equation), count, np.inf)
    near = start.take(start.distinct())
    near = near.take(near.inverse > 0.7 / deepest)  # refined, it may turn out less deep
    refined = crossings.refine(equation, near, 6)
    inside = np.flatnonzero(refined.converged & (refined.at.inverse * deepest >= 1.0))
    once = inside[refined.at.take(inside).distinct()]
    at = refined.at.take(once)
    frequency = chatter_hz(structure, arc, equation.period[at.speed], at.theta, refined.shape[once])
    label = kind(at.theta)
    leave = np.where(refined.leaves[once], 1, -1) * np.where(label == "flip", 1, 2)
    complete = np.ones(len(rpm), dtype=bool)
    result = Crossings(at.speed, 1.0 / at.inverse, frequency, label, leave, complete)
    for depth in _CHECKED * deepest:
        outside = np.abs(collocation.multipliers(equation, np.full(len(rpm), depth))) > 1.0
        counted = [result.unstable(speed, depth) for speed in range(len(rpm))]
        complete &= outside.sum(axis=1) == counted
    return result
