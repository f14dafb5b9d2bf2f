"""What the motors carry in the cut beyond the idle run that is no cutting force: friction, gears."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.robot.by_joint import of_joints, put, raised
from metro.same import Same
from metro.units import MRAD, Array, ComplexArray

TURNING = 2e-4  # rad/s: below it a joint is turning round, and its friction is between its two levels
PRESLIDING = 3e-4  # rad: asperities and grease give way by 0.1 to 1 mrad before a joint slides
LEAST_TURN = 0.05 * MRAD  # half of the least turn that is found: below it friction goes over to that by speed
STARTED = 0.1  # of that turn: from which on a path has a direction


@dataclass(frozen=True)
class Ripple:
    """Torque of a gear that comes with the joint's angle: sine sin(order q) + cosine cos(order q), N m.

    ``joint`` from 0; ``order`` in cycles per revolution of the joint.
    """

    joint: int
    order: float
    sine: float
    cosine: float


@dataclass(frozen=True)
class DriveTorques:
    """Torques of the drives in the cut less those of the idle run; joints beyond an entry have none.

    Attributes
    ----------
    reversal : Coulomb level of the cut less that of the idle run, N m.
    warmup : slope of the Coulomb level from the start of the cut's log, N m/s.
    presliding : turn over which the friction of a joint follows when it turns round, rad (or m); NaN of a
        joint where it is not known, which is taken as ``PRESLIDING``.
    viscous : friction in proportion to the joint's speed, the cut's less the idle run's, N m s/rad.
    ripple : of the gears, in the cut alone (what both runs have at the same place cancels).
    """

    reversal: tuple[float, ...] = ()
    warmup: tuple[float, ...] = ()
    presliding: tuple[float, ...] = ()
    viscous: tuple[float, ...] = ()
    ripple: tuple[Ripple, ...] = ()

    def with_friction(
        self, joint: int, *, reversal: float = 0.0, warmup: float = 0.0, viscous: float = 0.0
    ) -> DriveTorques:
        """Return these with more friction in one joint, from 0."""
        return replace(
            self,
            reversal=raised(self.reversal, joint, reversal),
            warmup=raised(self.warmup, joint, warmup),
            viscous=raised(self.viscous, joint, viscous),
        )

    def with_presliding(self, joint: int, turn: float) -> DriveTorques:
        """Return these with the friction of one joint, from 0, following over another ``turn``, rad."""
        return replace(self, presliding=put(self.presliding, joint, turn, math.nan))

    def turns(self, count: int) -> list[float]:
        """Return the turn over which the friction of each of ``count`` joints follows, rad."""
        known = of_joints(self.presliding, count, math.nan)
        return [PRESLIDING if math.isnan(turn) else turn for turn in known.tolist()]

    def at(
        self,
        q: Array,
        rate: Array,
        t: Array,
        width: Array | float = 0.0,
        *,
        start: Array | None = None,
        peak: Array | None = None,
    ) -> Array:
        """Torque (m, n), N m, on top of that of the idle run, each the mean over ``width`` s.

        Parameters
        ----------
        q, rate : (m, n) angles, rad, and speeds, rad/s, of the joints. t : (m,) s from the log's start.
        start : (n,) friction over its level where the path begins, −1 … 1; else the joints moved as there.
        peak : (m, n) Coulomb friction at these speeds over its level; else it is that at all speeds.
        """
        reversal, warmup, viscous = (
            of_joints(each, rate.shape[1]) for each in (self.reversal, self.warmup, self.viscous)
        )
        torque = rate * viscous if viscous.any() else np.zeros_like(rate)
        turns = self.turns(rate.shape[1])
        for joint in np.flatnonzero((reversal != 0.0) | (warmup != 0.0)):
            level = (reversal[joint] + t * warmup[joint]) * (1.0 if peak is None else peak[:, joint])
            first = None if start is None else float(start[joint])
            torque[:, joint] += level * _slid(Same(q), Same(rate), int(joint), turns[joint], first)
        for one in self.ripple:
            wave = rippling(q[:, one.joint], rate[:, one.joint], width, np.array([one.order]))[:, 0]
            torque[:, one.joint] += one.sine * wave.imag + one.cosine * wave.real
        return torque


def rippling(q: Array, rate: Array, width: Array | float, orders: Array) -> ComplexArray:
    """Return ripples (m, f) of 1 N m of ``orders`` (f,), as complex amplitudes of a cosine.

    ``q``, ``rate`` (m,) rad and rad/s of the joint; each is the mean over ``width`` s.
    """
    cycles = np.outer(rate * width / (2.0 * np.pi), orders)
    return np.asarray(np.sinc(cycles) * np.exp(1j * np.outer(q, orders)))


# A search asks for the friction of one joint along one run again and again, and only its level differs.
@lru_cache(maxsize=256)
def _slid(q: Same[Array], rate: Same[Array], joint: int, presliding: float, start: float | None) -> Array:
    return slid(q.value[:, joint], rate.value[:, joint], presliding, start)


def slid(q: Array, rate: Array, presliding: float, start: float | None = None) -> Array:
    """Friction along a path over its level, (m,), −1 … 1.

    It follows the way, whatever the speed: once a joint turns round, it tends to the other level over the
    turn of ``presliding`` (Dahl, AIAA J. 14 (1976) 1675, exactly for each step). Without presliding it
    follows the speed, and is between its levels where that is near none; a turn that is less than joints
    have is between the two, so that no fit meets a jump.

    Parameters
    ----------
    q, rate : (m,) rad and rad/s along the path; no friction where no speed is known. presliding : rad.
    start : of it where the path begins, −1 … 1; without it the joint moved before as it does there.
    """
    if presliding < LEAST_TURN or not rate.any():
        by_way = max(presliding, 0.0) / LEAST_TURN if rate.any() else 0.0
        by_speed = (1.0 - by_way) * np.tanh(rate / TURNING)
        return by_speed + by_way * slid(q, rate, LEAST_TURN, start) if by_way else by_speed
    state = _as_it_moves(q, presliding) if start is None else start
    steps = np.diff(q)
    kept = np.exp(-np.abs(steps) / presliding)
    along = [state]
    for share, more in zip(kept.tolist(), (np.sign(steps) * (1.0 - kept)).tolist(), strict=True):
        along.append(share * along[-1] + more)
    return np.array(along)


def _as_it_moves(q: Array, presliding: float) -> float:
    away = np.flatnonzero(np.abs(q - q[0]) > STARTED * presliding)
    return float(np.sign(q[away[0]] - q[0])) if len(away) else 0.0
