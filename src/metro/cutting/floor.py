"""The floor that the orbit before left in helical milling, and how far it is above the tip.

A tool that sinks on a helix has material before it up to the floor on which it stood last. Near the hole's
axis, where it stands all the time, there is none; at the wall it is a whole pitch: it was there an orbit ago.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from metro.compiled import compiled
from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter


class Floor(NamedTuple):
    """A helix: its ``pitch``, m, 0 where the path is level; radii of the ``orbit`` and of the ``tool``, m.

    ``outward``: 1 where the hole's wall is on the side of −y of the feed frame (a path that turns left), −1
    where it is on that of +y.
    """

    pitch: float
    orbit: float
    tool: float
    outward: float


def floor_of(cutter: Cutter, cut: Cut) -> Floor:
    """Return the floor of a cut; its pitch is 0 unless the cut is on a helix."""
    if not cut.pitch or not cut.curvature:
        return Floor(0.0, 0.0, cutter.radius, 1.0)
    return Floor(cut.pitch, 1.0 / abs(cut.curvature), cutter.radius, math.copysign(1.0, cut.curvature))


@compiled
def floor_at(floor: Floor, sine: float, cosine: float) -> float:
    """Return how high the floor is above the tip, m, before the tool at an immersion.

    The tool covers a place of the floor while its axis is, about the hole's, within an angle w of it. Since
    it left the place, 1 − w/π of an orbit has gone by: of the pitch, that much is left to cut.
    """
    across, out = floor.tool * abs(sine), floor.orbit - floor.outward * floor.tool * cosine
    return floor.pitch * (1.0 - math.atan2(across, out) / math.pi)
