"""Where something that nobody wrote down can take hold of a run: one hook for each thing it can change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.session import Plan
from virtual_cell.units import Array
from virtual_cell.world.force.cutter import RealTool
from virtual_cell.world.force.cutting import Change
from virtual_cell.world.force.spindle import Turning
from virtual_cell.world.force.travel import Wobble


@dataclass(frozen=True)
class Moment:
    """A run and when it is cut.

    ``share`` of the session has passed and ``metres`` have been cut before it; ``seed`` is its own.
    ``duration`` of the record, s; ``feed`` m/s and ``spindle`` rad/s, as programmed; ``turn``: direction of
    feed, rad; ``rate`` Hz at which loads are computed.
    """

    plan: Plan
    share: float
    metres: float
    seed: int
    duration: float
    feed: float
    spindle: float
    turn: float
    rate: float

    def rng(self, stream: int) -> np.random.Generator:
        """Return a generator of this run's own for one cause."""
        return np.random.default_rng([self.seed, stream])


class Cause:
    """A cause that changes nothing; others override what they change."""

    def tool(self, moment: Moment, tool: RealTool) -> RealTool:
        """Return the tool as it is in this run."""
        del moment
        return tool

    def metal(self, moment: Moment) -> Change | None:
        """Return what scales shear and edge forces at cutting points."""
        del moment
        return None

    def depth(self, moment: Moment, t: Array, x: Array) -> Array | float:
        """Return by how much deeper (m) the tool cuts, at times ``t`` and places ``x`` (m) along the path."""
        del moment, t, x
        return 0.0

    def feed(self, moment: Moment, t: Array, x: Array) -> tuple[Array | float, Array | float]:
        """Return the relative change of the feed and the displacement across the path (m)."""
        del moment, t, x
        return 0.0, 0.0

    def speed(self, moment: Moment, t: Array) -> Array | float:
        """Return the relative change of the spindle's speed."""
        del moment, t
        return 0.0

    def wobble(self, moment: Moment, turning: Turning) -> Wobble | None:
        """Return how the spindle's axis moves."""
        del moment, turning
        return None

    def load(self, moment: Moment, t: Array, force: Array) -> Array:
        """Return the force (n, 3) on the tool, N, work frame, that is there in the place of ``force``."""
        del moment, t
        return force

    def signal(self, moment: Moment, t: Array, read: Array) -> Array:
        """Return what the sensor's axes (n, 3) feel in the place of ``read``, N."""
        del moment, t
        return read
