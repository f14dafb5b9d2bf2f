"""The wall that a run leaves: its normal, its start, and the place at which the tool begins to leave it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from metro.batch.batch import Batch
from metro.observables.cut.conditions import work_from_feed
from metro.units import MM, Array

# outward normal (y) of the wall in the feed frame: down milling makes it at immersion π (−y), up at 0 (+y)
FACING = {"down": 1.0, "up": -1.0}


@dataclass(frozen=True, eq=False)
class Wall:
    """A machined wall in the work frame; lengths in m.

    Attributes
    ----------
    along : (3,) direction of feed.
    normal : (3,) out of the remaining material; zero for a slot, which has two walls.
    start : place along the feed of the face where the tool enters. length : of the wall.
    leaving : distance before the wall's end at which the engaged arc begins to leave the block.
    """

    along: Array
    normal: Array
    start: float
    length: float
    leaving: float

    def steady(self, x: Array) -> np.ndarray:
        """Mask of the places along the wall (m from its start) at which the tool is wholly engaged."""
        return np.asarray((x >= 0.0) & (x <= self.length - self.leaving))

    def phase(self, x: Array, margin: float) -> np.ndarray:
        """Phase of the cut at places along the wall, int: odd where the tool enters or leaves the block.

        0 before the block, 1 while it enters, 2 wholly engaged, 3 while it leaves, 4 behind. ``margin`` (m)
        before and after a change: what is measured at a place is a mean over its surroundings.
        """
        leaves = self.length - self.leaving
        ends = (-self.leaving - margin, min(margin, leaves - margin), leaves - margin, self.length + margin)
        passed = [x > end for end in (ends[0], ends[2])] + [x >= end for end in (ends[1], ends[3])]
        return np.asarray(np.sum(passed, axis=0))


def wall(batch: Batch, run: str) -> Wall:
    """Return the wall of a run from the manifest and the run table.

    Without ``work.size_mm`` the work's origin is taken to be on the entry face. Without a length of the cut
    or of the work the wall has no end.
    """
    row: Any = batch.runs.loc[run]
    turn = work_from_feed(batch, run)
    along = turn[:, 0]
    size = np.asarray((batch.manifest.get("work") or {}).get("size_mm", (math.inf,) * 3), dtype=float) * MM
    known = bool(np.isfinite(size).all())
    start = float(np.minimum(along[:2] * size[:2], 0.0).sum()) if known else 0.0
    extent = float(np.abs(along[:2] * size[:2]).sum()) if known else math.inf
    cut = float(row["cut_length_mm"]) * MM
    length = min(cut, extent) if math.isfinite(cut) else extent
    normal = turn[:, 1] * FACING.get(str(row["direction"]), 0.0)
    return Wall(along, normal, start, length, _reach(batch, float(row["radial_depth_mm"]) * MM))


def _reach(batch: Batch, radial_depth: float) -> float:
    """Distance ahead of its axis at which the tool touches the work, m: R sinφ at the arc's widest place."""
    diameter = float((batch.manifest.get("tool") or {}).get("diameter_mm", 0.0)) * MM
    depth = min(radial_depth, diameter / 2) if math.isfinite(radial_depth) else diameter / 2
    return math.sqrt(depth * (diameter - depth))
