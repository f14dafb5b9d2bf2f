"""Causes outside any library of effects, in the work and at the edge: each made as it happens."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.units import MM, Array
from virtual_cell.world.force.cause import Cause, Moment
from virtual_cell.world.force.cutter import RealTool
from virtual_cell.world.force.cutting import Change, Points

_SPOTS, _CHIPS, _EDGE = 1, 2, 3  # streams of a run's random numbers


@dataclass(frozen=True)
class Spots(Cause):
    """Hard spots and voids: always there. ``per_metre`` of path, so much ``harder``, ``size`` (m) wide."""

    per_metre: float
    harder: float
    size: float

    def metal(self, moment: Moment) -> Change | None:
        """Each is a ball of which a cut shows some section."""
        rng, length = moment.rng(_SPOTS), moment.feed * moment.duration
        count = int(rng.poisson(self.per_metre * length))
        if count == 0 or moment.plan.operation == "helical":
            return None
        middle = rng.uniform(0.0, length, count)
        aside = rng.uniform(-1.0, 1.0, count) * 0.5 * moment.plan.radial_depth_mm * MM
        kind = np.where(rng.uniform(size=count) < 0.3, -0.5, 1.0) * self.harder

        def change(points: Points) -> tuple[Array, float]:
            factor = np.ones_like(points.x)
            for x, y, more in zip(middle, aside, kind, strict=True):
                away = ((points.x - x) ** 2 + (points.y - y) ** 2) / self.size**2
                factor += more * np.exp(-0.5 * np.minimum(away, 60.0))
            return factor, 1.0

        return change


@dataclass(frozen=True)
class CreepingShim(Cause):
    """A shim under the work creeps with the logarithm of time: thinner by ``total`` m after a session."""

    total: float
    early: float

    def depth(self, moment: Moment, t: Array, x: Array) -> Array | float:
        """Let the work sink away from the tool."""
        del t, x
        return -self.total * math.log1p(moment.share / self.early) / math.log1p(1.0 / self.early)


@dataclass(frozen=True)
class Recutting(Cause):
    """Chips that are not cleared are cut again: now and then a few teeth in a row cut so much more."""

    more: float
    chance: float
    teeth: float

    def metal(self, moment: Moment) -> Change | None:
        """Passages of teeth in clumps of ``teeth`` on the mean."""
        tooth_s = 60.0 / (moment.plan.spindle_rpm * 3.0)
        count = int((moment.duration + 1.0) / tooth_s) + 1
        rng = moment.rng(_CHIPS)
        state, states = False, np.zeros(count)
        leave, enter = 1.0 / self.teeth, self.chance / (self.teeth * (1.0 - self.chance))
        for i, u in enumerate(rng.uniform(size=count)):
            state = u > leave if state else u < enter
            states[i] = state * self.more

        def change(points: Points) -> tuple[Array, float]:
            place = np.clip(((points.t + 0.5) / tooth_s).astype(int), 0, count - 1)
            return 1.0 + states[place], 1.0

        return change


@dataclass(frozen=True)
class CoatingLoss(Cause):
    """One tooth loses its coating after so many metres: it rubs more, cuts harder, and is shorter."""

    which: int
    after_m: float
    rubs: float
    harder: float
    shorter: float

    def tool(self, moment: Moment, tool: RealTool) -> RealTool:
        """Shorten the tooth once it has happened."""
        if moment.metres < self.after_m:
            return tool
        radial = np.array(np.broadcast_to(tool.radial, (tool.teeth,)), dtype=float)
        radial[self.which] -= self.shorter
        return replace(tool, radial=radial)

    def metal(self, moment: Moment) -> Change | None:
        """Change the law of the tooth once it has happened."""
        if moment.metres < self.after_m:
            return None

        def change(points: Points) -> tuple[Array, Array]:
            bare = points.tooth == self.which
            return 1.0 + self.harder * bare, 1.0 + self.rubs * bare

        return change


@dataclass(frozen=True)
class SpeedDependence(Cause):
    """Heat softens the metal: shear falls with a power of the cutting speed."""

    exponent: float
    reference: float

    def metal(self, moment: Moment) -> Change | None:
        """By the programmed speed."""
        factor = (moment.spindle / self.reference) ** -self.exponent

        def change(points: Points) -> tuple[float, float]:
            del points
            return factor, 1.0

        return change


@dataclass(frozen=True)
class SlantedBlank(Cause):
    """The blank gets thicker along the path, by ``rise`` per length."""

    rise: float

    def depth(self, moment: Moment, t: Array, x: Array) -> Array | float:
        """Right where the tool was touched off: at the face."""
        del moment, t
        return self.rise * np.maximum(x, 0.0)


@dataclass(frozen=True)
class HardSkin(Cause):
    """A rolled or cast skin: the uppermost ``thick`` (m) of what is cut are so much ``harder``."""

    thick: float
    harder: float

    def metal(self, moment: Moment) -> Change | None:
        """By height above the tip."""
        below = moment.plan.axial_depth_mm * MM - self.thick
        if moment.plan.operation == "helical":  # the first orbit alone meets the skin
            return None
        return lambda points: (1.0 + self.harder * (points.z > below), 1.0)


@dataclass(frozen=True)
class BuiltUpEdge(Cause):
    """An edge builds up and breaks off: while it is there, a tooth cuts easier and rubs more."""

    eased: float
    seconds: float

    def metal(self, moment: Moment) -> Change | None:
        """Two states, that last ``seconds`` on the mean, alike for all teeth."""
        rng = moment.rng(_EDGE)
        lasts = rng.exponential(self.seconds, 4 + int(6.0 * (moment.duration + 1.0) / self.seconds))
        ends, first = np.cumsum(lasts) - 0.5, int(rng.integers(2))

        def change(points: Points) -> tuple[Array, Array]:
            there = (np.searchsorted(ends, points.t) + first) % 2
            return 1.0 - self.eased * there, 1.0 + self.eased * there

        return change
