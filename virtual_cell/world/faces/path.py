"""The path of the tip as the controller drives it: gears that do not turn evenly, cycles, raw stock."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import MM, MS, UM, Array
from virtual_cell.world.draws import uniform
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence


@dataclass(frozen=True)
class GearWave:
    """Transmission errors of gears, after compensation: waves of the height over the plate.

    Attributes
    ----------
    size : m, standard deviation. lengths : m, of each wave. towards : rad, direction in which each runs.
    """

    size: float
    lengths: tuple[float, ...]
    towards: tuple[float, ...]

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return the waves at a pose, the same in each of its faces."""
        del rng
        # The phase follows from the pose: joints that stand elsewhere are elsewhere on their gears.
        own = np.random.default_rng(zlib.crc32(f"{run.wrist}{run.location}".encode()))
        phases = own.uniform(0.0, 2.0 * math.pi, len(self.lengths))

        def waves(cutting: Cutting) -> Array:
            axis = cutting.points - cutting.offset
            total = np.zeros(len(axis))
            for length, towards, phase in zip(self.lengths, self.towards, phases, strict=True):
                way = axis @ np.array([math.cos(towards), math.sin(towards)])
                total += np.sin(2.0 * math.pi * way / length + phase)
            return np.asarray(self.size * math.sqrt(2.0 / len(self.lengths)) * total)

        return Influence(height=waves)


def drawn_gears(rng: np.random.Generator) -> GearWave:
    """Draw what is left of transmission errors: 0.2–2 µm, two or three waves of 20–130 mm."""
    count = int(rng.integers(2, 4))
    lengths = tuple(drawn_size(rng, 20.0, 130.0) * MM for _ in range(count))
    return GearWave(
        drawn_size(rng, 0.2, 2.0) * UM, lengths, tuple(rng.uniform(0.0, 2.0 * math.pi, count).tolist())
    )


@dataclass(frozen=True)
class Pauses:
    """How the passes and the faces follow each other.

    Attributes
    ----------
    late : s, by which every pass begins later than programmed. jitter : s, standard deviation of that.
    between : s, shortest and longest pause between two faces. breaks : probability of a long one, of half an
        hour to an hour.
    """

    late: float
    jitter: float
    between: tuple[float, float]
    breaks: float

    def begun(self, count: int, period: float, rng: np.random.Generator) -> Array:
        """Return when each of ``count`` passes begins, s after the first."""
        every = period + self.late + self.jitter * rng.standard_normal(count - 1)
        return np.concatenate([[0.0], np.cumsum(every)])

    def pause(self, rng: np.random.Generator) -> float:
        """Return a pause between two faces, s."""
        long = rng.uniform(1800.0, 3600.0) if rng.uniform() < self.breaks else 0.0
        return float(rng.uniform(*self.between) + long)


def drawn_pauses(rng: np.random.Generator) -> Pauses:
    """Draw a controller that blends and a person who clamps and scans."""
    shortest = uniform(rng, 150.0, 400.0)
    return Pauses(
        drawn_size(rng, 5.0, 80.0) * MS,
        drawn_size(rng, 2.0, 12.0) * MS,
        (shortest, shortest * uniform(rng, 1.3, 3.0)),
        uniform(rng, 0.0, 0.15),
    )


@dataclass(frozen=True)
class Stock:
    """Raw plates that are no planes: the depth of cut changes over each. ``slope`` m, over a plate."""

    slope: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a force that goes with the depth, in another way over each plate."""
        rise = self.slope * rng.standard_normal(2)
        count = len(run.passes.axes)

        def deeper(number: int, s: Array, t: Array) -> Array:
            del t
            along, across = s / run.passes.length - 0.5, number / max(1, count - 1) - 0.5
            return np.asarray(1.0 + (rise[0] * along + rise[1] * across) / run.depth)

        return Influence(gain=deeper)
