"""Troubles of the machine, its supply and the scanner, which no effect of a library describes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence, bump


@dataclass(frozen=True)
class CornerBlending:
    """A controller that rounds the corner at the end of a pass in height, too.

    ``dip`` m, where the pass ends; ``way`` m, over which it comes.
    """

    dip: float
    way: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a height that bends away towards the end of every pass."""
        del rng

        def rounded(cutting: Cutting) -> Array:
            into = np.clip((cutting.s - run.passes.length + self.way) / self.way, 0.0, 1.4)
            return np.asarray(self.dip * into**2)

        return Influence(height=rounded)


@dataclass(frozen=True)
class WornWay:
    """A stretch of the machine's way that is worn: it dips at one place of the machine, not of the work.

    ``dip``, ``half`` m, depth and half length of the stretch; ``places`` shares of the plate's length where
    it is, for each location of the work.
    """

    dip: float
    half: float
    places: tuple[float, float]

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a dip across the passes or along them."""
        del rng
        at = self.places[run.location - 1] * run.passes.size[0]

        def worn(cutting: Cutting) -> Array:
            axis = cutting.points[:, 0] - cutting.offset[:, 0]
            return self.dip * bump(np.abs(axis - at), self.half)

        return Influence(height=worn)


@dataclass(frozen=True)
class PowerSag:
    """A supply that sags now and then: the spindle slows down, and every tooth takes more.

    ``loss`` of speed, relative; ``lasts`` s; ``often`` per minute of cutting.
    """

    loss: float
    lasts: float
    often: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a larger force for some seconds at moments of their own in each face."""
        times = rng.uniform(0.0, run.duration, int(rng.poisson(self.often * run.duration / 60.0)))
        more = (1.0 - run.edge_share) * (1.0 / (1.0 - self.loss) - 1.0)

        def sagging(number: int, s: Array, t: Array) -> Array:
            del number, s
            within = np.zeros(len(t))
            for start in times:
                since = t - start
                ramps = np.minimum(
                    np.clip(since / 0.3, 0.0, 1.0), np.clip((self.lasts - since) / 0.5, 0.0, 1.0)
                )
                within = np.maximum(within, ramps)
            return np.asarray(1.0 + more * within)

        return Influence(gain=sagging)


@dataclass(frozen=True)
class LostInsert:
    """An insert that is lost in the middle of a face, and not missed for the rest of the session.

    One edge less rubs, the next one takes a double chip and gets blunt. ``from_share`` of the session;
    ``blunter`` growth of the edge force, relative; ``shorter`` m, how much higher the others cut, until the
    tool is measured for the next face.
    """

    from_share: float
    blunter: float
    shorter: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return another force and a step in height."""
        del rng
        place = self.from_share * run.count
        first = math.floor(place)
        if run.order < first:
            return Influence()
        at = (place - first) * run.duration if run.order == first else -math.inf
        change = run.edge_share * ((1.0 - 1.0 / run.teeth) * (1.0 + self.blunter) - 1.0)

        def blunt(number: int, s: Array, t: Array) -> Array:
            del number, s
            return np.where(t >= at, 1.0 + change, 1.0)

        def stepped(cutting: Cutting) -> Array:
            return np.where(cutting.t >= at, self.shorter, 0.0)

        return Influence(height=stepped if run.order == first else None, gain=blunt)


@dataclass(frozen=True)
class SnaggingHose:
    """A hose that snags at one posture of the wrist: it pulls ever more along a pass until it slips.

    ``pull`` m, height of the tip just before; ``wrist`` at which it snags.
    """

    pull: float
    wrist: str

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a saw tooth along each pass, whose end is another one each time."""
        slips = rng.uniform(0.35, 0.9, len(run.passes.axes)) * run.passes.length

        def snagging(cutting: Cutting) -> Array:
            at = float(slips[cutting.number])
            pulled = np.clip(cutting.s / at, 0.0, 1.0)
            return np.asarray(self.pull * np.where(cutting.s < at, pulled, np.exp((at - cutting.s) / 0.004)))

        return Influence(height=snagging if run.wrist == self.wrist else None)


@dataclass(frozen=True)
class ScannerWheel:
    """An eccentric wheel of the scanner's axis: a wave along the way of the scanner, not of the cutter.

    ``size`` m; ``length`` m, circumference; ``direction`` rad, of the way in the work.
    """

    size: float
    length: float
    direction: float

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return an error of the reading that begins anywhere on the wheel."""
        del run
        begins = rng.uniform(0.0, 2.0 * math.pi)
        towards = np.array([math.cos(self.direction), math.sin(self.direction)])

        def read(points: Array) -> Array:
            angle = 2.0 * math.pi * (points @ towards) / self.length + begins
            return np.asarray(self.size * (np.sin(angle) + 0.2 * np.sin(2.0 * angle + 0.5)))

        return Influence(reading=read)
