"""Helical milling over one orbit: the published validation case, rotation by hand, energy."""

import math
from dataclasses import replace

import numpy as np
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import mean_force
from metro.cutting.helical import Helix, helical_signal, ramped, turn
from metro.cutting.law import EdgeLaw
from metro.cutting.time_signal import time_signal

# [T] §4.1: n 2000 rpm, s_t 0.06 mm, a_p 0.2 mm/rev, hole 19.05, tool 12 mm, N 4, β 40°; table 4
TITANIUM = np.array([10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3, 243.47e6, 33.072e3])
TOOL = Cutter(6e-3, math.radians(40), evenly_pitched(4))
CUT = Cut(0.06e-3, 0.2e-3, Engagement(0.0, math.pi))
ORBIT_RADIUS = 3.525e-3
SPEED = 2 * math.pi * 2000 / 60
ORBIT = 4 * 0.06e-3 * 2000 / 60 / ORBIT_RADIUS  # rad/s, of the tool's centre at the feed
HELIX = Helix(ORBIT_RADIUS, 0.2e-3, 0.2e-3 * ORBIT / SPEED / 4)
ONE_ORBIT = np.arange(40000) / 40000 * 2 * math.pi / ORBIT


def over_one_orbit(coefficients=TITANIUM, **options):
    return helical_signal(
        TOOL, EdgeLaw(), CUT, HELIX, coefficients, speed=SPEED, orbit_speed=ORBIT, time=ONE_ORBIT, **options
    )


def test_mean_thrust_of_the_published_case_is_the_sum_of_both_kinds_of_edges():
    # By hand, N and mm: periphery (N a/π) K_ac c + (N a/2) K_ae, inclined; bottom N R (K_Fac s_ta + K_Fae)
    side = 4 * 0.2 / math.pi * 5000 * 0.06 + 4 * 0.2 / 2 * 214.32
    along = -(4 * 0.2 / 4 * 11036.5 * 0.06 + 4 * 0.2 / math.pi * 100.03)
    ramp = math.atan(0.2 / (2 * math.pi * 3.525))
    axial_feed = 0.2 * (60 * ORBIT / (2 * math.pi)) / (2000 * 4)
    bottom = 4 * 6 * (243.47 * axial_feed + 33.072)
    expected = side * math.cos(ramp) - along * math.sin(ramp) + bottom
    assert over_one_orbit()[:, 2].mean() == pytest.approx(expected, rel=1e-5)
    assert bottom == pytest.approx(796.9, abs=0.1)


def test_over_one_orbit_the_forces_in_the_plane_go_once_round():
    force = over_one_orbit()
    mean = mean_force(TOOL, EdgeLaw(), CUT, TITANIUM[:6])
    assert np.abs(force[:, :2].mean(axis=0)).max() < 1e-3 * np.abs(mean).max()
    turn = np.exp(-1j * ORBIT * ONE_ORBIT)
    first = ((force[:, 0] + 1j * force[:, 1]) * turn).mean()
    ramp = HELIX.ramp
    assert first.imag == pytest.approx(mean[1], rel=1e-4)
    assert first.real == pytest.approx(mean[0] * math.cos(ramp) + mean[2] * math.sin(ramp), rel=1e-4)


def test_bottom_edges_push_along_the_spindle_only():
    with_bottom, without = over_one_orbit(), over_one_orbit(TITANIUM * np.repeat([1.0, 0.0], [6, 2]))
    assert np.array_equal(with_bottom[:, :2], without[:, :2])
    assert np.ptp(with_bottom[:, 2] - without[:, 2]) < 1e-9


def test_direction_turns_the_forces_counter_clockwise():
    along_x, along_y = over_one_orbit(), over_one_orbit(direction=math.pi / 2)
    assert along_y[:, 0] == pytest.approx(-along_x[:, 1], abs=1e-9)
    assert along_y[:, 1] == pytest.approx(along_x[:, 0], abs=1e-9)


def test_without_orbit_and_ramp_it_is_a_straight_cut():
    flat = Helix(1.0, 0.0, 0.0)
    time = np.linspace(0.0, 0.1, 500)
    straight = time_signal(TOOL, EdgeLaw(), CUT, TITANIUM[:6], speed=SPEED, time=time, phase=0.4)
    found = helical_signal(
        TOOL, EdgeLaw(), CUT, flat, TITANIUM * np.repeat([1.0, 0.0], [6, 2]),
        speed=SPEED, orbit_speed=0.0, time=time, phase=0.4,
    )  # fmt: skip
    assert found == pytest.approx(straight, abs=1e-9)


def test_teeth_pass_a_fixed_direction_at_the_speed_of_the_spindle():
    # The feed turns against the tool, so relative to the feed they pass faster: N (n + n_c) per second.
    thrust = over_one_orbit()[:, 2]
    spectrum = np.abs(np.fft.rfft(thrust - thrust.mean()))
    assert np.argmax(spectrum) == pytest.approx(4 * (SPEED + ORBIT) / ORBIT, abs=1)


def test_rotations_keep_length_and_hand():
    basis = np.eye(3)[None]
    for turned in (ramped(basis, 0.3), turn(0.7) @ basis):
        assert np.linalg.det(turned[0]) == pytest.approx(1.0)
        assert turned[0] @ turned[0].T == pytest.approx(np.eye(3))
    # A ramp leads downwards: a force along the inclined feed has a part along −z.
    assert ramped(np.array([[1.0, 0.0, 0.0]]), 0.1)[0, 2] < 0
    assert (turn(0.1) @ [1.0, 0.0, 0.0])[1] > 0


@pytest.mark.parametrize("orbit", [ORBIT, -ORBIT], ids=["left", "right"])
@pytest.mark.parametrize("runout", [0.0, 8e-6])
def test_forces_are_those_of_chips_traced_on_the_orbit(orbit, runout, monkeypatch):
    from virtual_cell import chips, milling, motion  # shares no code with the package

    monkeypatch.setattr(chips, "_SLICE", 1e-3)
    teeth = np.array(TOOL.tooth_angles)
    tool = chips.Tool(TOOL.radius, TOOL.helix, teeth, runout, 0.6)
    law = milling.in_millimetres((10145, 11036.5, 5000), (591.92, 100.03, 214.32), (243.47, 33.072))
    path = motion.Orbit(ORBIT_RADIUS, orbit, 0.3, HELIX.pitch)
    cut = milling.Cut(chips.Engagement(tool, path, SPEED, 0.1, CUT.axial_depth), law)
    time = np.arange(2880) / 2880 * 2 * math.pi / (SPEED + orbit)
    found = helical_signal(
        replace(TOOL, runout_radius=runout, runout_angle=0.6), EdgeLaw(),
        replace(CUT, pitch=HELIX.pitch), HELIX, TITANIUM,
        speed=SPEED, orbit_speed=orbit, time=time, phase=0.4, direction=0.3, true_path=True,
    )  # fmt: skip
    # Over one revolution against the turning feed, up to six tooth passings: what a record tells.
    difference = np.abs(np.fft.rfft(found - milling.forces(cut, time), axis=0))[:25] / len(time)
    scale = math.sqrt(np.mean(np.sum(found**2, axis=1)))
    assert difference.max() < 5e-5 * scale
