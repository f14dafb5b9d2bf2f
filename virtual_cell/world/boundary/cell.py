"""A machine, its tool and its work as they really are, and the tests that are made on it.

What a batch hides is a field of the cell; fields at their defaults do nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from virtual_cell.units import DEG, MM, Array
from virtual_cell.world.boundary.chatter import Cuts, Law
from virtual_cell.world.boundary.flank import Flank
from virtual_cell.world.boundary.resonances import Resonances, state_matrices

_SLIDING = 3e-4  # m/s, from which on dry friction is full
_CLOGGED = 0.22  # of the turns in which chips are cut again, where they are


@dataclass(frozen=True)
class Spindle:
    """How a spindle turns.

    Attributes
    ----------
    off : relative error of the nominal speed. wander, wander_s : relative standard deviation, and time over
        which it changes, s. droop : relative, at entry.
    sag : relative loss of speed under a cut as deep as the lowest boundary.
    bearing : relative change of the bearings' stiffness at the fastest speed; bent : its exponent.
    damped : relative growth of all damping at the fastest speed, in proportion to the speed.
    whirl : gyroscopic rate over the speed of the spindle.
    """

    off: float
    wander: float
    wander_s: float
    droop: float
    bearing: float
    bent: float
    damped: float
    sag: float = 0.0
    whirl: float = 0.0


@dataclass(frozen=True)
class Tool:
    """A tool.

    Attributes
    ----------
    diameter : m. unequal : (N,) m, by which each tooth reaches further. runout, runout_angle : m, rad.
    uneven : (N,) rad, by which teeth are from their even pitch.
    """

    diameter: float
    unequal: Array
    runout: float
    runout_angle: float
    uneven: tuple[float, ...] = ()

    @property
    def teeth(self) -> int:
        """How many."""
        return len(self.unequal)

    @property
    def angles(self) -> Array:
        """(N,) places of the teeth, rad, clockwise."""
        even = 2.0 * math.pi * np.arange(self.teeth) / self.teeth
        return even + np.array(self.uneven) if self.uneven else even

    @property
    def reach(self) -> Array:
        """(N,) by which each tooth cuts further than nominal, m."""
        reach: Array = self.unequal + self.runout * np.cos(self.angles - self.runout_angle)
        return reach


@dataclass(frozen=True)
class Session:
    """What changes from test to test.

    Attributes
    ----------
    common, own : relative standard deviations of the chip force, of all coefficients together and each alone.
    drift : relative change of the chip force from the first to the last test.
    depth_off, depth_sd : error of the nominal depth, that all tests share and of each, m.
    grain : of the force, from step to step. settling : turns over which a tool enters.
    warming : relative change of all stiffness over the session.
    """

    common: float
    own: float
    drift: float
    depth_off: float
    depth_sd: float
    grain: float
    settling: float
    warming: float = 0.0


@dataclass(frozen=True)
class Mishap:
    """What no library has an effect for; nothing by default.

    Attributes
    ----------
    speed_exponent : the chip force goes as (cutting speed)^−exponent.
    thinner : relative loss of the stiffness of the work, first to last test.
    from_share : share of the session after which something has happened. harder, duller : factor on the chip
        force, and on the width of the wear land, from then on; wetter : factor on the radial force alone.
    clamped : factor on all stiffness in the cuts, mass constant: the tool was clamped anew after the hammer.
    play, loose : half of a gap, m, and the share of the stiffness that is missing inside it.
    friction : N, dry. clogging : mean relative growth of the chip force in turns that cut chips again.
    wavy, waves : relative height of the waves of uneven stock, and how many pass in a turn.
    """

    speed_exponent: float = 0.0
    thinner: float = 0.0
    from_share: float = 1.0
    harder: float = 1.0
    duller: float = 1.0
    wetter: float = 1.0
    clamped: float = 1.0
    play: float = 0.0
    loose: float = 0.0
    friction: float = 0.0
    clogging: float = 0.0
    wavy: float = 0.0
    waves: float = 0.0


@dataclass(frozen=True)
class Cell:
    """All of it.

    Attributes
    ----------
    feed, radial : m, radial of cuts that are no slots.
    direction : up, down or slot, of the first kind of cut. fast : about the fastest speed tested, rev/min.
    flats : rad, by which the directions that were struck are turned from x and y.
    mistaken : share of labels that are exchanged.
    """

    resonances: Resonances
    spindle: Spindle
    tool: Tool
    law: Law
    flank: Flank
    session: Session
    feed: float
    radial: float
    direction: str
    fast: float
    flats: float = 0.0
    mishap: Mishap = field(default_factory=Mishap)
    mistaken: float = 0.0

    def immersion(self, direction: str) -> tuple[float, float]:
        """Angles between which a tooth meets the work, rad."""
        swept = math.acos(1.0 - 2.0 * self.radial / self.tool.diameter)
        return {"up": (0.0, swept), "down": (math.pi - swept, math.pi), "slot": (0.0, math.pi)}[direction]

    @property
    def level(self) -> float:
        """Depth (m) about which the lowest boundary lies, by Tlusty's rule for the mean of the cut."""
        hz = self.resonances.hz
        about = np.linspace(0.5 * hz.min(), 1.5 * hz.max(), 1500)
        felt = self.resonances.receptance(about)
        lowest = min(float(felt[:, i, i].real.min()) for i in (0, 1))
        entry, leave = self.immersion(self.direction)
        return -2.0 * math.pi / (self.law.ktc * self.tool.teeth * (leave - entry) * lowest)

    def bearings(self, rpm: Array) -> Array:
        """Relative change (n,) of the bearings' stiffness at speeds (n,)."""
        change: Array = self.spindle.bearing * (rpm / self.fast) ** self.spindle.bent
        return change

    def stiffer(self, rpm: Array, progress: Array) -> Array:
        """Factor (n, m) on each stiffness, mass constant, at speeds (n,) and places (n,) in the session."""
        r = self.resonances
        of_spindle = 1.0 + self.bearings(rpm)[:, None] * r.bearing
        of_work = 1.0 - self.mishap.thinner * progress[:, None] * (r.bearing == 0.0)
        whole = of_spindle * of_work * (1.0 + self.session.warming * progress[:, None])
        return np.asarray(np.maximum(whole * self.mishap.clamped, 0.1))


@dataclass(frozen=True)
class Plan:
    """n tests as they are asked for.

    ``rpm`` and ``depth`` (n,), rev/min and m, nominal; ``direction`` (n,); ``progress`` (n,) place of each in
    the session, 0 to 1.
    """

    rpm: Array
    depth: Array
    direction: tuple[str, ...]
    progress: Array


def made(cell: Cell, plan: Plan, turns: int, rng: np.random.Generator) -> Cuts:
    """Return the tests as they are made."""
    n, s, spindle, odd = len(plan.rpm), cell.session, cell.spindle, cell.mishap
    true_depth = np.maximum(plan.depth + s.depth_off + s.depth_sd * rng.standard_normal(n), 0.02 * MM)
    level = cell.level
    rpm = plan.rpm * (1.0 + spindle.off) * (1.0 - np.clip(spindle.sag * true_depth / level, 0.0, 0.5))
    late = plan.progress >= odd.from_share
    common = 1.0 + s.common * rng.standard_normal((n, 1)) + s.drift * plan.progress[:, None]
    strength = common * (1.0 + s.own * rng.standard_normal((n, 3)))
    strength = strength * (rpm / (0.6 * cell.fast))[:, None] ** -odd.speed_exponent
    strength = strength * np.where(late, odd.harder, 1.0)[:, None]
    strength[:, 1] *= np.where(late, odd.wetter, 1.0)
    worn = (1.0 + cell.flank.growth * plan.progress) * np.where(late, odd.duller, 1.0)
    a, b, c = state_matrices(
        cell.resonances,
        cell.stiffer(rpm, plan.progress),
        1.0 + spindle.damped * rpm / cell.fast,
        spindle.whirl * rpm * (2.0 * math.pi / 60.0),
    )
    entry, leave = np.array([cell.immersion(direction) for direction in plan.direction]).T
    softest = [float(cell.resonances.stiffness[near].min()) for near in _near_axes(cell.resonances)]
    clog = 1.0 + np.where(
        rng.random((n, turns)) < _CLOGGED,
        odd.clogging * true_depth[:, None] / level * rng.random((n, turns)) * 2.0,
        0.0,
    )
    phase = 2.0 * math.pi * rng.random((n, 1))
    wave = 1.0 + odd.wavy * np.sin(2.0 * math.pi * odd.waves * np.arange(turns) + phase)
    return Cuts(
        *(a, b, c, cell.law, cell.flank, 0.5 * cell.tool.diameter, cell.feed),
        *(cell.tool.angles, cell.tool.reach, rpm, true_depth, entry, leave, strength, worn),
        wandering(spindle, rpm, turns, s.settling, rng),
        clog,
        wave,
        s.grain,
        s.settling,
        play=odd.play,
        play_force=(odd.loose * softest[0], odd.loose * softest[1]),
        friction=(odd.friction, odd.friction),
        sliding=_SLIDING,
    )


def _near_axes(r: Resonances) -> tuple[np.ndarray, np.ndarray]:
    """Which resonances are nearer to x, and to y; all where none is."""
    along_x = np.abs(np.cos(r.heading)) >= math.cos(45.0 * DEG)
    near = [np.flatnonzero(which) for which in (along_x, ~along_x)]
    every = np.arange(len(r.hz))
    return (near[0] if len(near[0]) else every), (near[1] if len(near[1]) else every)


def wandering(spindle: Spindle, rpm: Array, turns: int, settling: float, rng: np.random.Generator) -> Array:
    """Relative deviation (n, turns) of the speed: a slow wander, and a droop when the tool enters."""
    turn = 60.0 / rpm
    kept = np.exp(-turn / spindle.wander_s)
    course = np.zeros((len(rpm), turns))
    value = rng.standard_normal(len(rpm))
    for i in range(turns):
        course[:, i] = value
        value = kept * value + np.sqrt(1.0 - kept**2) * rng.standard_normal(len(rpm))
    since = np.maximum(np.arange(turns) - settling, 0.0) * turn[:, None]
    entered = np.minimum(np.arange(turns) / settling, 1.0)
    drooped: Array = spindle.wander * course - spindle.droop * entered * np.exp(-since / 0.3)
    return drooped
