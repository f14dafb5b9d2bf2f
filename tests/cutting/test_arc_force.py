"""Orders of a force along the arc, against the time-domain simulator, which traces chips."""

import math
from dataclasses import replace

import numpy as np
import pytest

from metro.cutting.arc_force import arc_force
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import engagement
from metro.cutting.force import Cut
from metro.signals.orders import from_amplitudes, order_matrix
from virtual_cell.chips import Engagement, Tool
from virtual_cell.milling import Coefficients, forces
from virtual_cell.milling import Cut as SimulatedCut
from virtual_cell.motion import Straight

RADIUS, DEPTH, FEED, HELIX, KTC = 6e-3, 3e-3, 0.02e-3, 0.5, 1e9
ANGLES = (0.0, 2.0, 4.3)
SHARES = (0.4, -0.25)
HIGHEST = 12


@pytest.mark.parametrize(("side", "width"), [("slot", 2 * RADIUS), ("up", 4e-3), ("down", 4e-3)])
def test_orders_are_those_of_simulated_teeth(side, width):
    spindle = 200.0
    speed = FEED * len(ANGLES) * spindle / (2.0 * math.pi)
    path = Straight(speed, 0.05, side=side, edge=RADIUS - width)
    tool = Tool(RADIUS, HELIX, np.array(ANGLES))
    plain = Coefficients(KTC, 0.0, 0.0, 0.0, 0.0, 0.0)
    time = np.arange(2880) * 2.0 * math.pi / (spindle * 2880)
    simulated = [
        forces(SimulatedCut(Engagement(tool, path, spindle, 0.0, DEPTH), law), time)
        for law in (replace(plain, jammed=SHARES), plain)
    ]
    wave = simulated[0] - simulated[1]
    cut = Cut(FEED, DEPTH, engagement("slot" if side == "slot" else "side", side, width, RADIUS))
    cutter = Cutter(RADIUS, HELIX, ANGLES)
    orders = 0.5 * (arc_force(cutter, cut, 0, HIGHEST) + arc_force(cutter, cut, 2, HIGHEST))
    turn = order_matrix(spindle * time, HIGHEST)
    predicted = turn @ from_amplitudes(orders @ np.array(SHARES)) * KTC * FEED
    filtered = turn @ (turn.T @ wave) / len(time)
    assert np.abs(filtered).max() > 10.0
    assert np.abs(predicted - filtered).max() < 0.02 * np.abs(filtered).max()
