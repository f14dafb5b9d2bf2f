"""Troubles of the work and what holds it, which no effect of a library describes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence, bump, over_plate


@dataclass(frozen=True)
class HeatedSide:
    """A cold plate that the cut heats from above: it bends while it is cut, and is flat again afterwards.

    ``rise`` m, of the corners against the middle once it is warm; ``time`` s, in which it gets warm.
    """

    rise: float
    time: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a bend that grows while the face is cut."""
        rise = self.rise * (1.0 + 0.1 * rng.standard_normal())
        size = np.array(run.passes.size)

        def bent(cutting: Cutting) -> Array:
            away = ((cutting.points - size / 2.0) ** 2).sum(axis=1) / (size @ size / 4.0)
            return np.asarray(rise * -np.expm1(-cutting.t / self.time) * (away - 1.0 / 3.0))

        return Influence(height=bent)


@dataclass(frozen=True)
class CoolantSwitched:
    """Coolant that somebody turns on in the middle of some faces: tool and work shrink within seconds.

    ``shrink`` m; ``time`` s; ``share`` of the faces in which it happens.
    """

    shrink: float
    time: float
    share: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a height that changes from a moment on, another one in each face."""
        at, happens = rng.uniform(0.15, 0.75) * run.duration, rng.uniform() < self.share

        def shrunk(cutting: Cutting) -> Array:
            since = np.maximum(cutting.t - at, 0.0)
            return np.asarray(self.shrink * -np.expm1(-since / self.time))

        return Influence(height=shrunk if happens else None)


@dataclass(frozen=True)
class CreepingShim:
    """A shim under one corner that creeps under the clamp, fast at first: the work is twisted ever more.

    ``sinks`` m, by the end of the session; ``corner`` signs of u and v; ``time`` s, from which on it is slow.
    """

    sinks: float
    corner: tuple[float, float]
    time: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return the form of the free work after so much of the session."""
        del rng
        sunk = self.sinks * math.log1p(run.started / self.time) / math.log1p(run.whole / self.time)

        def twisted(cutting: Cutting) -> Array:
            u, v = over_plate(cutting.points, run.passes.size)
            lever = 0.25 * (1.0 + self.corner[0] * u) * (1.0 + self.corner[1] * v)
            return np.asarray(sunk * lever**1.5)

        return Influence(height=twisted)


@dataclass(frozen=True)
class ChipUnderClamp:
    """A chip between work and support in some faces: the work lies high there, and is cut too deep.

    ``height``, ``radius`` m; ``share`` of the faces.
    """

    height: float
    radius: float
    share: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a dent near one of the supports."""
        happens = rng.uniform() < self.share
        place = rng.choice([0.15, 0.5, 0.85], 2) * np.array(run.passes.size)
        height = self.height * math.exp(rng.normal(0.0, 0.3))

        def dented(cutting: Cutting) -> Array:
            return -height * bump(np.hypot(*(cutting.points - place).T), self.radius)

        return Influence(height=dented if happens else None)


@dataclass(frozen=True)
class VacuumRelease:
    """A vacuum cup that lets go in the middle of a face: from then on the plate stands high above it.

    ``lift``, ``radius`` m; ``place`` shares of the plate; ``share`` of the faces.
    """

    lift: float
    radius: float
    place: tuple[float, float]
    share: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a dent in what is cut after the cup has let go."""
        happens, at = rng.uniform() < self.share, rng.uniform(0.1, 0.7) * run.duration
        place = np.array(self.place) * np.array(run.passes.size)

        def lifted(cutting: Cutting) -> Array:
            gone = np.clip((cutting.t - at) / 0.7, 0.0, 1.0)
            return np.asarray(-self.lift * gone * bump(np.hypot(*(cutting.points - place).T), self.radius))

        return Influence(height=lifted if happens else None)


@dataclass(frozen=True)
class HardInclusion:
    """Inclusions in the work, elsewhere in each plate, over which the force is larger.

    ``more`` relative, of the force; ``radius`` m; ``share`` of the plates that have one.
    """

    more: float
    radius: float
    share: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a force that rises while the front of the cutter is in the inclusion."""
        happens = rng.uniform() < self.share
        passes = run.passes
        x, y = (rng.uniform(0.2, 0.8, 2) * np.array(passes.size)).tolist()
        along, across = (x, y) if passes.along == 0 else (y, x)

        def harder(number: int, s: Array, t: Array) -> Array:
            del t
            aside = float(passes.axes[number]) - across
            if abs(aside) >= passes.radius:
                return np.ones(len(s))
            front = s + 0.7 * math.sqrt(passes.radius**2 - aside**2)
            return np.asarray(1.0 + self.more * bump(np.abs(front - along), self.radius))

        return Influence(gain=harder if happens else None)


@dataclass(frozen=True)
class ThinPlate:
    """A plate that gets thinner face by face and hums in its middle, ever more and at a lower frequency.

    ``hz`` of the first face, as the passes sample it; ``drop`` relative, of it over the session; ``size`` m,
    amplitude of the last face.
    """

    hz: float
    drop: float
    size: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a hum in the middle of the plate."""
        hz, phase = self.hz * (1.0 - self.drop * run.share), rng.uniform(0.0, 2.0 * math.pi)
        size = self.size * (0.3 + 0.7 * run.share**2)

        def humming(cutting: Cutting) -> Array:
            u, v = over_plate(cutting.points, run.passes.size)
            mode = np.cos(0.5 * math.pi * u) * np.cos(0.5 * math.pi * v)
            return np.asarray(size * mode * np.sin(2.0 * math.pi * hz * cutting.t + phase))

        return Influence(height=humming)
