"""A machine that chatters, and tests made on it: what a boundary batch may hide is a field of the machine."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.hammer import receptance
from virtual_cell.milling import Coefficients
from virtual_cell.modes import Modes
from virtual_cell.regeneration import Trials
from virtual_cell.units import Array


@dataclass(frozen=True)
class Machine:
    """Tool, cut and structure as they really are.

    Attributes
    ----------
    modes : along x and along y, at standstill. law : of the force.
    diameter, feed, radial : m. teeth : of the tool, of no helix. direction : up, down or slot.
    turned, ploughing, runout, runout_angle, uneven : as in :class:`virtual_cell.regeneration.Trials`.
    softening, damping_growth : relative change of all stiffnesses (mass constant), of all damping ratios, per
        rev/min. yielding : relative growth of all compliances per metre of depth, mass constant.
    speed_exponent, speed_reference : the force of the chip goes as (speed/reference)^−exponent; rev/min.
    mislabelled : share of the tests whose label is wrong.
    """

    modes: tuple[Modes, Modes]
    law: Coefficients
    diameter: float
    teeth: int
    feed: float
    radial: float
    direction: str
    turned: float = 0.0
    ploughing: float = 0.0
    runout: float = 0.0
    runout_angle: float = 0.0
    uneven: tuple[float, ...] = ()
    softening: float = 0.0
    damping_growth: float = 0.0
    yielding: float = 0.0
    speed_exponent: float = 0.0
    speed_reference: float = 1.0
    mislabelled: float = 0.0

    @property
    def immersion(self) -> tuple[float, float]:
        """Angles between which a tooth meets the work, rad."""
        swept = math.acos(1.0 - 2.0 * self.radial / self.diameter)
        return {"up": (0.0, swept), "down": (math.pi - swept, math.pi), "slot": (0.0, math.pi)}[
            self.direction
        ]

    @property
    def repeats(self) -> int:
        """How often in a turn a cut without chatter repeats: with each tooth, if no tooth differs.

        Chatter may be locked to the turns (for example at each second tooth, which cuts for two): a
        comparison of whole turns does not show it.
        """
        return 1 if self.runout or any(self.uneven) else self.teeth

    @property
    def frequencies(self) -> Array:
        """Damped frequencies of all modes, Hz."""
        return np.concatenate([modes.damped for modes in self.modes])

    @property
    def fast(self) -> float:
        """Speed, rev/min, at which the fastest mode makes five waves per turn: about the fastest tested."""
        return 60.0 * float(self.frequencies.max()) / 5.0

    @property
    def level(self) -> float:
        """Depth (m) about which the boundary lies at its lowest, by one mode and the mean of the cut.

        Tlusty's rule, b = −1 / (2 K μ N* min Re G), μ one half, with N* teeth in the cut on the average.
        """
        hz = self.frequencies
        about = np.linspace(0.5 * hz.min(), 1.5 * hz.max(), 2000)
        lowest = min(float(receptance(modes, about).real.min()) for modes in self.modes)
        entry, leave = self.immersion
        return -2.0 * math.pi / (self.law.ktc * self.teeth * (leave - entry) * lowest)

    def modes_at(self, rpm: Array, depth: Array) -> tuple[Modes, Modes]:
        """Modes of both axes in each of n tests, (n, m)."""
        factor = (1.0 + self.softening * rpm[:, None]) / (1.0 + self.yielding * depth[:, None])
        growth = 1.0 + self.damping_growth * rpm[:, None]
        x, y = (
            Modes(m.damped * np.sqrt(factor), m.damping * growth, m.stiffness * factor) for m in self.modes
        )
        return x, y

    def trials(self, rpm: Array, depth: Array, *, scatter: float, entry: int) -> Trials:
        """Return tests (n,) at ``rpm`` and ``depth`` (m); scatter and entry as in :class:`Trials`."""
        return Trials(
            self.modes_at(rpm, depth),
            self.law,
            self.teeth,
            self.feed,
            rpm,
            depth,
            entry=entry,
            scatter=scatter,
            immersion=self.immersion,
            turned=self.turned,
            ploughing=self.ploughing,
            runout=self.runout,
            runout_angle=self.runout_angle,
            strength=(rpm / self.speed_reference) ** -self.speed_exponent,
            uneven=self.uneven,
        )


@dataclass(frozen=True)
class Programme:
    """Tests that are made, and how the machine is measured.

    Attributes
    ----------
    rpm : speeds, rising. held_out : those that are held out. depths : m, tried at each speed.
    beside : tests kept on either side of the boundary, at each speed. records : of the force, of every test.
    per_turn : steps of the march, a multiple of the teeth. seed : of its scatter.
    hammer_noise : of the receptances, rms relative to the largest. band : Hz, in which these are known.
    declared : ktc and krc, N/m², as the manifest has them.
    """

    rpm: tuple[float, ...]
    held_out: tuple[float, ...]
    depths: tuple[float, ...]
    beside: int
    declared: tuple[float, float]
    records: bool = False
    per_turn: int = 120
    seed: int = 0
    hammer_noise: float = 0.005
    band: tuple[float, float] = (60.0, 900.0)
