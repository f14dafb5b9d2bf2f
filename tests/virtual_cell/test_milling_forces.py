"""Forces and chips of the simulator against closed forms and brute force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from cost import cost_ratio

from virtual_cell.chips import Engagement, Tool, chip_thickness
from virtual_cell.milling import Coefficients, Cut, forces, power
from virtual_cell.motion import Orbit, Straight
from virtual_cell.units import DEG, MM, RPM, UM
from virtual_cell.yielding import yielding_force

TITANIUM = Coefficients(10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3, 243.47e6, 33.072e3)
SPINDLE = 2000.0 * RPM
PER_TURN = 720


def mill(teeth=4, runout=0.0, angle=0.5, helix=40.0 * DEG, **changes):
    tool = Tool(6.0 * MM, helix, np.arange(teeth) * 2.0 * np.pi / teeth, runout, angle)
    return replace(tool, **changes)


def slot(tool, feed=0.06 * MM, depth=0.2 * MM, coefficients=TITANIUM, start=0.1, **more):
    speed = feed * tool.teeth * SPINDLE / (2.0 * np.pi)
    return Cut(Engagement(tool, Straight(speed, start, **more), SPINDLE, 0.3, depth), coefficients)


def turns(count, per_turn=PER_TURN):
    return np.arange(count * per_turn) * 2.0 * np.pi / (SPINDLE * per_turn)


def orders(cut, count=4):
    force = forces(cut, turns(count))
    return np.abs(np.fft.rfft(force, axis=0)) / len(force) * 2.0, count


def test_mean_slot_force_is_the_closed_form_up_to_the_trochoid():
    n, a, c, k = 4, 0.2e-3, 0.06e-3, TITANIUM
    expected = [
        -n * a / 4 * k.krc * c - n * a / np.pi * k.kre,
        n * a / 4 * k.ktc * c + n * a / np.pi * k.kte,
        n * a / np.pi * k.kac * c + n * a / 2 * k.kae,
    ]
    assert expected[1] == pytest.approx(272.47, abs=0.01)
    mean = forces(slot(mill()), turns(3)).mean(axis=0)
    np.testing.assert_allclose(mean, expected, rtol=5e-3)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_mean_side_force_is_the_integral_over_the_immersion(direction):
    radial, c, a, k = 3.0e-3, 0.05e-3, 1.0e-3, TITANIUM
    arc = math.acos(1.0 - radial / 6e-3)
    phi = np.linspace(0.0, arc, 20001) if direction == "up" else np.linspace(np.pi - arc, np.pi, 20001)
    h = c * np.sin(phi)
    tangential, radial_force = k.ktc * h + k.kte, k.krc * h + k.kre
    fx = np.mean(-tangential * np.cos(phi) - radial_force * np.sin(phi)) * arc
    fy = np.mean(tangential * np.sin(phi) - radial_force * np.cos(phi)) * arc
    cut = slot(mill(), c, a, side=direction, edge=6e-3 - radial)
    mean = forces(cut, turns(3)).mean(axis=0)
    np.testing.assert_allclose(mean[:2], np.array([fx, fy]) * 4 * a / (2 * np.pi), rtol=0.012)


def test_a_good_tool_cuts_feed_times_sine_to_second_order_in_the_feed():
    cut = slot(mill(helix=1e-9))
    t = turns(1)
    h = chip_thickness(cut.engagement, t)[:, 0, 0]
    phi = np.mod(0.3 + SPINDLE * t, 2.0 * np.pi)
    inside = (phi > 0.05) & (phi < np.pi - 0.05)
    bound = 4.0 * (0.06 * MM) ** 2 / (6.0 * MM)
    assert np.abs(h - 0.06 * MM * np.sin(phi))[inside].max() < bound
    assert h[(phi > np.pi + 0.05) & (phi < 2.0 * np.pi - 0.05)].max() == 0.0


@pytest.mark.parametrize("runout", [3.0, 25.0, 60.0])
def test_chips_under_runout_are_those_of_densely_drawn_trochoids(runout):
    tool, feed = mill(3, runout * UM, 1.1, 1e-9), 0.04 * MM
    cut = slot(tool, feed)
    h = chip_thickness(cut.engagement, turns(1, 24))[:, :, 0]
    radius, angle = tool.points(np.array([1e-9]))
    speed = cut.engagement.motion.speed
    fine = turns(2, 200_000) - turns(2, 200_000)[-1] / 2.0
    for i, now in enumerate(turns(1, 24)):
        for tooth in range(3):
            phi = 0.3 + SPINDLE * now + angle[tooth, 0]
            if np.sin(phi) < 0.1:
                continue
            floor = -np.inf
            for other in range(3):
                then = now + fine[fine < -1e-4]
                turned = 0.3 + SPINDLE * then + angle[other, 0]
                x = speed * (then - now) + radius[other, 0] * np.sin(turned)
                y = radius[other, 0] * np.cos(turned)
                along, across = x * np.sin(phi) + y * np.cos(phi), x * np.cos(phi) - y * np.sin(phi)
                near = (np.abs(across) < 1e-6) & (along > 0.0)
                floor = max(floor, along[near].max(initial=-np.inf))
            assert h[i, tooth] == pytest.approx(max(radius[tooth, 0] - floor, 0.0), abs=0.05 * UM)


def test_tooth_zero_cuts_what_runout_adds_over_the_tooth_before_it():
    """Runout towards tooth 0: it is longest, tooth 1 before it is shorter, so its chip is thicker."""
    cut = slot(mill(4, 5.0 * UM, 0.0, 1e-9))
    h = chip_thickness(cut.engagement, turns(1)).max(axis=0)[:, 0]
    np.testing.assert_allclose(h - 0.06 * MM, np.array([5.0, 5.0, -5.0, -5.0]) * UM, atol=0.7 * UM)


def test_without_runout_only_multiples_of_the_tooth_number_appear():
    spectrum, count = orders(slot(mill()))
    others = [m for m in range(1, 40) if m % 4]
    assert spectrum[np.array(others) * count].max() < 1e-3 * spectrum[4 * count].max()


def test_runout_brings_orders_that_are_no_multiple_and_the_first_does_not_grow_with_feed():
    first = [orders(slot(mill(4, 6.0 * UM), feed))[0][4, 1] for feed in (0.05 * MM, 0.1 * MM)]
    assert first[0] > 5.0
    assert first[1] == pytest.approx(first[0], rel=0.05)


def test_pitch_error_makes_a_first_order_that_grows_with_feed():
    angles = np.arange(4) * 90.0 * DEG + np.array([1.0, -0.5, 0.5, -1.0]) * DEG
    sharp = replace(TITANIUM, kte=0.0, kre=0.0, kae=0.0)
    cuts = [slot(mill(angles=angles), feed, coefficients=sharp) for feed in (0.05 * MM, 0.1 * MM)]
    first = [orders(cut)[0][4, 1] for cut in cuts]
    assert first[1] == pytest.approx(2.0 * first[0], rel=0.02)


def test_spindle_power_is_the_mean_tangential_power():
    cut, t = slot(mill()), turns(3)
    k, c, a = TITANIUM, 0.06e-3, 0.2e-3
    tangential = 4 * a / (2 * np.pi) * (2.0 * k.ktc * c + np.pi * k.kte)  # mean over immersion 0 … π
    assert power(cut, t).mean() == pytest.approx(tangential * 6e-3 * SPINDLE, rel=5e-3)


def left_by_a_disc(orbit, radius, pitch, immersion):
    """Height of the floor before a disc that is fed along +y at (orbit, 0): since it was last there."""
    back = np.linspace(0.0, 2.0 * math.pi, 20_001)[1:]
    place = orbit + radius * (1j * math.sin(immersion) - math.cos(immersion))
    covered = np.abs(orbit * np.exp(-1j * back) - place) < radius
    return pitch * (back[np.argmax(covered)] / (2.0 * math.pi) if covered.any() else 1.0)


def test_helical_axial_force_is_periphery_plus_bottom():
    n, a, e, feed, k = 4, 0.2e-3, 3.525e-3, 0.04e-3, TITANIUM
    rate = feed * n * SPINDLE / (2.0 * np.pi) / e
    orbit = Orbit(e, rate, 0.7, a)
    mean = forces(Cut(Engagement(mill(), orbit, SPINDLE, 0.3, a), k), turns(10))[:, 2].mean()
    axial_feed = a * rate / (SPINDLE * n)
    phi = (np.arange(180) + 0.5) * np.pi / 180.0
    height = np.array([left_by_a_disc(e, 6e-3, a, one) for one in phi])
    along = height * np.pi / len(phi) * n / (2.0 * np.pi)  # per tooth over a revolution
    sine, cosine = np.sin(phi), np.cos(phi)
    periphery = along @ (k.kac * feed * sine + k.kae)
    forward = along @ (-(k.ktc * feed * sine + k.kte) * cosine - (k.krc * feed * sine + k.kre) * sine)
    ramp = math.atan(a / (2.0 * np.pi * e))
    expected = (
        periphery * math.cos(ramp) - forward * math.sin(ramp) + n * 6e-3 * (k.kfac * axial_feed + k.kfae)
    )
    assert mean == pytest.approx(expected, rel=4e-3)


def test_helical_force_turns_with_the_orbit():
    n, e, feed = 4, 3.525e-3, 0.04e-3
    rate = feed * n * SPINDLE / (2.0 * np.pi) / e
    means = []
    for phase in (0.0, math.pi / 2.0):
        cut = Cut(Engagement(mill(), Orbit(e, rate, phase, 0.2e-3), SPINDLE, 0.3, 0.2e-3), TITANIUM)
        means.append(forces(cut, turns(1)).mean(axis=0))
    np.testing.assert_allclose(means[1][:2], [-means[0][1], means[0][0]], rtol=0.02)


def test_orbit_moves_in_the_direction_of_feed_either_way_round():
    for rate in (2.0, -2.0):
        orbit, t = Orbit(3e-3, rate, 0.4, 1e-4), np.array([0.0, 1e-6])
        x, y = orbit.centre(t)
        moved = np.array([x[1] - x[0], y[1] - y[0]]) / 1e-6
        np.testing.assert_allclose(moved, orbit.speed * np.array([math.cos(0.4), math.sin(0.4)]), rtol=1e-5)


def test_there_is_no_force_in_air_and_it_grows_as_the_tool_enters():
    cut = slot(mill(), start=-8.0 * MM)
    speed = cut.engagement.motion.speed
    force = np.abs(forces(cut, turns(40, 90) * 30.0)).sum(axis=1)
    at = cut.engagement.motion.start + speed * turns(40, 90) * 30.0
    assert force[at < -6.01 * MM].max(initial=0.0) == 0.0
    entering = force[(at > -5.5 * MM) & (at < -4.5 * MM)].mean()
    assert 0.0 < entering < 0.8 * force[at > 0.0].mean()


def test_cutting_stops_at_the_exit_face():
    cut = slot(mill(), start=20.1 * MM, length=20.0 * MM)
    assert np.abs(forces(cut, turns(2))).max() == 0.0


def test_wear_raises_the_edge_force_by_what_was_cut():
    fresh = slot(mill(), coefficients=replace(TITANIUM, wear=0.1))
    worn = replace(fresh, metres_before=2.0)
    change = forces(worn, turns(2)).mean(axis=0) - forces(fresh, turns(2)).mean(axis=0)
    edge = 4 * 0.2e-3 * np.array([-TITANIUM.kre / np.pi, TITANIUM.kte / np.pi, TITANIUM.kae / 2.0])
    np.testing.assert_allclose(change, 0.2 * edge, rtol=0.015)


def test_size_effect_bends_force_over_feed_and_is_neutral_at_its_reference():
    k = replace(TITANIUM, size_exponent=0.2, size_reference=0.05 * MM)
    plain, sized = TITANIUM.per_length(np.array([0.05 * MM]), 1.0), k.per_length(np.array([0.05 * MM]), 1.0)
    np.testing.assert_allclose(sized, plain)
    thin, thick = (k.per_length(np.array([h]), 0.0)[0] / h for h in (0.01 * MM, 0.1 * MM))
    assert thin / thick == pytest.approx(10**0.2)


def test_a_stiff_tip_cuts_like_a_rigid_one_and_a_soft_one_yields_at_entry():
    rigid = slot(mill(2), depth=0.1 * MM)
    t = np.arange(3000) / 20000.0
    stiff = replace(rigid, compliance=np.eye(2) / 1e12)
    np.testing.assert_allclose(yielding_force(stiff, t), forces(rigid, t), atol=0.5)
    soft = replace(rigid, compliance=np.eye(2) / 4e6)
    force = forces(soft, t)
    turn = 600
    first, last = force[:turn], force[-turn:]
    reference = forces(rigid, t)[-turn:]
    assert np.abs(last.mean(axis=0) - reference.mean(axis=0)).max() < 0.05 * np.abs(reference).max()
    assert np.abs(first - forces(rigid, t)[:turn]).max() > 5.0


def test_a_chipped_tooth_leaves_work_to_the_next():
    """Tooth 0 follows tooth 1: where tooth 1 is short, below, tooth 0 takes its share."""
    tool = mill(chipped_tooth=1, chipped_by=20.0 * UM, chipped_height=0.1 * MM)
    peak = chip_thickness(slot(tool).engagement, turns(1)).max(axis=0)
    assert peak[0, 0] == pytest.approx(80.0 * UM, abs=UM)
    assert peak[1, 0] == pytest.approx(40.0 * UM, abs=UM)
    assert peak[0, -1] == pytest.approx(60.0 * UM, abs=UM)


def test_forces_cost_no_more_than_a_few_passes_over_teeth_disks_and_samples():
    cut, t = slot(mill(4, 8.0 * UM), depth=0.5 * MM), np.arange(10_000) / 10_000.0
    forces(cut, t[:100])
    angle = np.linspace(0.0, 1e4, t.size * 4 * 20)
    assert cost_ratio(lambda: forces(cut, t), lambda: np.sin(angle)) < 6.0
