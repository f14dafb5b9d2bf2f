"""Reading tables for many boundaries and many draws of the errors at once."""

from __future__ import annotations

from metro.compiled import compiled
from metro.loop.labels.evidence import Draws, Grids
from metro.units import Array


@compiled
def read(grids: Grids, draws: Draws, depth: Array, unsure: Array, total: Array) -> None:
    """Add to ``total`` (t, s, j) what the tables say of log depths (t, p), which are ``unsure`` (t, p).

    Between two depths it is interpolated linearly; beyond the first and the last it stays.
    """
    last = grids.value.shape[2] - 1
    for t in range(depth.shape[0]):
        for s in range(draws.size.shape[0]):
            z = draws.size[s]
            for q in range(grids.point.shape[0]):
                p = grids.point[q]
                at = depth[t, p] + draws.deviations[s, p] + unsure[t, p] * draws.own[s, p]
                place = (at - grids.start[q, z]) / grids.step[q, z]
                place = min(max(place, 0.0), float(last))
                below = min(int(place), last - 1)
                share = place - below
                table = grids.value[q, z]
                total[t, s, grids.speed[q]] += table[below] + share * (table[below + 1] - table[below])
