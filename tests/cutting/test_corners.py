"""Raw edges that teeth pass little by little, against a simulator that cuts along rays through the block."""

import math

import numpy as np
import pytest
from chip_grids import bounds_of, chips_left

from metro.cutting.chip import Cut
from metro.cutting.corners import is_outer, raw_edges
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import engagement
from metro.cutting.force import force_basis, mean_basis
from metro.cutting.law import EdgeLaw
from metro.cutting.passes import OFF_COSINE, OFF_SINE, passes
from virtual_cell.chips import Engagement as TrueEngagement
from virtual_cell.chips import Tool
from virtual_cell.milling import Cut as TrueCut
from virtual_cell.milling import forces, in_millimetres
from virtual_cell.motion import Straight

RADIUS, HELIX, DEPTH, FEED = 6e-3, math.radians(30), 2e-3, 0.13e-3
SHEAR, EDGE = (842.0, 317.0, 176.0), (14.2, 17.8, 3.9)  # N/mm², N/mm
ALUMINIUM = np.array([842e6, 317e6, 176e6, 14.2e3, 17.8e3, 3.9e3])


def simulated_mean(direction, width):
    """Mean force of a simulated side cut over whole revolutions, (3,) N."""
    path = Straight(FEED * 3 * 100, 0.06, side=direction, edge=RADIUS - width)
    sharp = Tool(RADIUS, HELIX, 2 * math.pi * np.arange(3) / 3)
    cut = TrueCut(TrueEngagement(sharp, path, 200 * math.pi, 0.0, DEPTH), in_millimetres(SHEAR, EDGE))
    return forces(cut, np.arange(3600) / 3600 / 100).mean(axis=0)


@pytest.mark.parametrize("width", [1e-3, 4e-3, 6e-3, 9e-3])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_mean_forces_of_a_side_cut_are_those_of_a_simulation_of_the_block(direction, width):
    tool = Cutter(RADIUS, HELIX, evenly_pitched(3))
    cut = Cut(FEED, DEPTH, engagement("side", direction, width, RADIUS))
    expected = simulated_mean(direction, width)
    found, table = (mean_basis(tool, EdgeLaw(), cut, True), force_basis(tool, EdgeLaw(), cut, True))
    assert found @ ALUMINIUM == pytest.approx(expected, abs=3e-4 * np.abs(expected).max())
    assert table.mean(axis=0) @ ALUMINIUM == pytest.approx(found @ ALUMINIUM, rel=1e-4)


@pytest.mark.parametrize("width", [1e-3, 4e-3, 9e-3])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_between_tip_and_foot_the_edge_is_between_the_tip_and_what_was_cleared(direction, width):
    angle = 2 * math.pi * np.arange(36) / 36
    engaged = engagement("side", direction, width, RADIUS)
    tool = Cutter(RADIUS, HELIX, evenly_pitched(3), 80e-6, 0.7)
    before = passes(tool, Cut(FEED, DEPTH, engaged), True, angle)
    raw = raw_edges(engaged, RADIUS, True)
    line = RADIUS - width if direction == "up" else width - RADIUS
    side, some = (1, []) if direction == "up" else (0, [])
    assert raw.line[side] == pytest.approx(line)
    for row in np.ndindex(before.rows.shape[:2]):
        rows = before.rows[row]
        limits = bounds_of(before, raw, *row)[1][side]
        tip, foot = limits if is_outer(side, line) else limits[::-1]

        def edge(phi, rows=rows):
            """Chip, tip and edge, from the axis, on the ray at φ."""
            off = rows[-1, OFF_SINE] * math.sin(phi) + rows[-1, OFF_COSINE] * math.cos(phi)
            chip = chips_left(before.scale, rows, np.array([phi])).min()
            return chip, RADIUS + off, line / math.cos(phi)

        chip_at_tip, at_tip, crossing = edge(tip)
        assert crossing == pytest.approx(at_tip, abs=1e-9)
        some.append(chip_at_tip > 0.0)
        if chip_at_tip > 0.0:
            chip, at_foot, crossing = edge(foot)
            assert crossing == pytest.approx(at_foot - chip, abs=1e-9)
        else:
            assert foot == tip
    assert 0.0 < np.mean(some) < 1.0
