"""Forces at given times against the table they are made from, and against integrals at those times."""

import math

import numpy as np
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import ANGLES, force_basis, mean_force
from metro.cutting.law import EdgeLaw
from metro.cutting.time_signal import time_signal

TITANIUM = np.array([10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3])
TOOL = Cutter(6e-3, math.radians(40), evenly_pitched(4), 5e-6, 0.7)
CUT = Cut(0.05e-3, 3e-3, Engagement(0.0, math.pi))
SPEED = 2 * math.pi * 50.0


def test_at_the_angles_of_the_table_it_is_the_table():
    time = (np.arange(3 * ANGLES) - ANGLES) / ANGLES / 50.0
    force = time_signal(TOOL, EdgeLaw(), CUT, TITANIUM, speed=SPEED, time=time, phase=0.0)
    table = force_basis(TOOL, EdgeLaw(), CUT) @ TITANIUM
    assert force == pytest.approx(np.tile(table, (3, 1)), abs=1e-8 * np.abs(table).max())


def test_the_phase_is_the_immersion_of_tooth_0_at_the_start():
    table = force_basis(TOOL, EdgeLaw(), CUT) @ TITANIUM
    force = time_signal(TOOL, EdgeLaw(), CUT, TITANIUM, speed=SPEED, time=np.zeros(1), phase=math.pi / 2)
    assert force[0] == pytest.approx(table[ANGLES // 4])


def test_between_the_angles_it_is_the_force_of_a_tool_turned_that_far():
    half = math.pi / ANGLES  # the teeth half a step on: a table between the angles of the other
    turned = Cutter(6e-3, TOOL.helix, tuple(a + half for a in TOOL.tooth_angles), 5e-6, 0.7 + half)
    time = np.arange(ANGLES) / ANGLES / 50.0
    force = time_signal(TOOL, EdgeLaw(), CUT, TITANIUM, speed=SPEED, time=time, phase=half)
    expected = force_basis(turned, EdgeLaw(), CUT) @ TITANIUM
    assert force == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())  # at the kinks
    assert np.sqrt(np.mean((force - expected) ** 2)) < 1e-4 * np.abs(expected).max()


def test_over_whole_revolutions_the_mean_is_the_mean_force():
    tool = Cutter(6e-3, math.radians(40), evenly_pitched(4))
    time = np.arange(10000) / 10000  # 50 revolutions
    mean = time_signal(tool, EdgeLaw(), CUT, TITANIUM, speed=SPEED, time=time, phase=0.3).mean(axis=0)
    assert mean == pytest.approx(mean_force(tool, EdgeLaw(), CUT, TITANIUM), rel=1e-3)
