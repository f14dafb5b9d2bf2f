"""Gears of an arm's joints: errors of transmission, springs in three pieces with hysteresis, gaps.

Ranges: 2 to 30 arcsec of transmission error in all, most of it once and twice per turn of the joint and per
turn of the motor, little at the teeth's order, part of which changes its sign with the direction; harmonic
drives up to a third softer below a tenth of their torque than above, in series with shafts and bearings that
are linear, with a lost motion of some arcsec at a few per cent of it (Tuttle and Seering, IEEE Trans. Robot.
Autom. 12 (1996) 368; Taghirad and Belanger, J. Dyn. Sys. Meas. Control 120 (1998) 496; makers' catalogues).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.units import DEG, Array
from virtual_cell.world.arm.dahl import dragged
from virtual_cell.world.draws import between, per_joint

_ARCSEC = DEG / 3600.0
RATIO = (154.0, 161.0, 147.0, 118.0, 121.0, 101.0)  # motor turns per turn of the joint
_CONTACT = 0.004  # s in which a link that nothing holds crosses its gap


@dataclass(frozen=True, eq=False)
class Transmission:
    """Errors of transmission: waves over the joint's angle; ``order`` per turn, ``size`` rad, each (6, k).

    ``flank``: share of each wave that changes its sign with the direction in which the joint turns.
    """

    order: Array
    size: Array
    phase: Array
    flank: Array

    def error(self, q: Array, sliding: Array) -> Array:
        """Angle (n, 6), rad, by which the links are ahead of the motors, at joint angles (n, 6)."""
        wave = self.size * np.sin(self._angle(q))
        sides = 1.0 - self.flank + self.flank * sliding[..., None]
        return np.asarray((wave * sides).sum(axis=-1))

    def line(self, q: Array, sliding: Array, joint: int, wave: int) -> Array:
        """Angle (n,), rad, of one wave of a joint (from 0) at its angles and sliding (n,)."""
        only = np.zeros_like(self.size)
        only[joint, wave] = self.size[joint, wave]
        alone = replace(self, size=only)
        at, way = (np.outer(values, np.eye(6)[joint]) for values in (q, sliding))
        return np.asarray(alone.error(at, way)[:, joint])

    def slope(self, q: Array) -> Array:
        """Return the slope (n, 6) of the error by the angle: by virtual work, the torque it adds."""
        return np.asarray((self.size * self.order * np.cos(self._angle(q))).sum(axis=-1))

    def _angle(self, q: Array) -> Array:
        return np.asarray(q[..., None] * self.order + self.phase)


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs of the joints, from the middle of their gaps.

    Attributes
    ----------
    stiffness : (6,) N m/rad, of the middle piece. knees : (6, 2) N m, where the pieces meet. ratio : (6, 2)
        stiffness of the first and of the last piece over that of the middle one.
    lost, turning : (6,) rad of lost motion, and the torque, N m, over which it turns round.
    eased : (6, 2) stiffness in the cut over that of load tests, at small and at large torques; ``eased_at``
        (6,) N m between the two.
    gap : (6,) rad, whole, in the cut. drag : (6,) N m that holds a link within its gap.
    """

    stiffness: Array
    knees: Array
    ratio: Array
    lost: Array
    turning: Array
    eased: Array
    eased_at: Array
    gap: Array
    drag: Array

    def elastic(self, torque: Array) -> Array:
        """Twist (…, 6), rad, of the springs alone."""
        size = np.abs(torque)
        low = np.minimum(size, self.knees[:, 0])
        middle = np.clip(size - self.knees[:, 0], 0.0, self.knees[:, 1] - self.knees[:, 0])
        high = np.maximum(size - self.knees[:, 1], 0.0)
        twist = low / self.ratio[:, 0] + middle + high / self.ratio[:, 1]
        return np.asarray(np.sign(torque) * twist / self.stiffness)

    def in_cut(self, torque: Array) -> Array:
        """Twist (…, 6), rad, of the springs alone as they are in the cut."""
        size = np.abs(torque)
        easy = np.minimum(size, self.eased_at) / self.eased[:, 0]
        hard = np.maximum(size - self.eased_at, 0.0) / self.eased[:, 1]
        return self.elastic(np.sign(torque) * (easy + hard))

    def hysteresis(self, torque: Array) -> Array:
        """Lost motion (n, 6), rad, along torques (n, 6), N m."""
        steps = np.diff(torque, axis=0, prepend=torque[:1])
        return np.asarray(self.lost * dragged(steps, self.turning, start=np.tanh(torque[0] / self.turning)))

    def rattle(self, torque: Array, dt: float) -> Array:
        """Where the links are within their gaps, (n, 6), rad, under torques (n, 6), N m, at even times.

        A link follows the torque beyond its drag until a flank stops it, and stays where nothing moves it.
        """
        places = np.zeros_like(torque)
        for joint in np.flatnonzero(self.gap):
            half, drag = 0.5 * float(self.gap[joint]), float(self.drag[joint])
            pace = 2.0 * half * dt / (_CONTACT * drag)
            place = math.copysign(half, float(torque[0, joint])) if abs(torque[0, joint]) > drag else 0.0
            out = []
            for push in torque[:, joint].tolist():
                free = push - max(-drag, min(drag, push))
                place = max(-half, min(half, place + pace * free))
                out.append(place)
            places[:, joint] = out
        return places


def transmission(rng: np.random.Generator) -> Transmission:
    """Draw errors of the gears; the teeth are those of the motor's pinion."""
    teeth, ratio = rng.integers(17, 41, 6), np.array(RATIO)
    ones = np.ones(6)
    order = np.stack([ones, 2.0 * ones, ratio, 2.0 * ratio, 4.0 * ratio, teeth * ratio / 3.0], axis=1)
    whole = per_joint(rng, 2.0, 30.0) * _ARCSEC
    share = np.exp(rng.uniform(np.log(0.5), np.log(1.5), order.shape))
    share *= np.array([0.7, 0.4, 0.1, 0.03, 0.008, 0.003])
    return Transmission(
        order,
        whole[:, None] * share,
        rng.uniform(0.0, 2.0 * math.pi, order.shape),
        rng.uniform(0.0, 0.4, order.shape),
    )


def springs(rng: np.random.Generator, stiffness: Array, rated: Array) -> Springs:
    """Draw the springs of six joints, three of them with harmonic drives; ``rated`` (6,) N m."""
    wrist = np.arange(6) >= 3
    share = np.where(wrist, rng.uniform(0.2, 0.5, 6), rng.uniform(0.05, 0.2, 6))  # of the gear in the twist
    soft = 1.0 / (1.0 - share + share / per_joint(rng, 0.65, 0.9))
    hard = 1.0 / (1.0 - share + share / per_joint(rng, 1.1, 1.4))
    lost = np.where(wrist, per_joint(rng, 0.8, 5.0), per_joint(rng, 0.4, 2.5)) * _ARCSEC
    return Springs(
        stiffness,
        knees=np.outer(rated, [0.12, 0.4]) * np.exp(rng.uniform(-0.3, 0.3, (6, 1))),
        ratio=np.stack([soft, hard], axis=1),
        lost=lost,
        turning=rated * between(rng, 0.02, 0.08),
        eased=np.ones((6, 2)),
        eased_at=0.1 * rated,
        gap=np.zeros(6),
        drag=0.01 * rated,
    )
