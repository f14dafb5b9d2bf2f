"""Cutting in the harder world: without its faults it is the idealised cell's, and volumes are conserved."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.chips import Engagement, Tool
from virtual_cell.milling import Coefficients, Cut, forces
from virtual_cell.motion import Straight
from virtual_cell.world.force.cutter import RealTool
from virtual_cell.world.force.cutting import Pass, TrueEngagement, edge_force
from virtual_cell.world.force.metal import Metal
from virtual_cell.world.force.spindle import Spindle, turning
from virtual_cell.world.force.travel import Circling, travelled
from virtual_cell.world.force.yielding import Holder, march, propagator, swinging_force

ANGLES = np.arange(3) * (2.0 * math.pi / 3.0)
TOOL = RealTool(6e-3, math.radians(35.0), ANGLES)
METAL = Metal(np.array([850e6, 330e6, 190e6]), np.array([15e3, 18e3, 5e3]), (90e6, 4e3))
OMEGA, FEED, DEPTH = 500.0, 0.02, 1.5e-3


def passed(programmed=None, *, tool=TOOL, metal=METAL, spindle=None, until=0.2):
    programmed = programmed or Straight(FEED, 0.03)
    turned = turning(spindle or Spindle(), OMEGA, until, (0.0, 9.0), rng=np.random.default_rng(0))
    motion = travelled(programmed, until, ramp_s=1e-9)
    engagement = TrueEngagement(tool, motion, OMEGA, 0.0, DEPTH, turning=turned, bounds=tool.bounds(DEPTH))
    fresh = np.ones(3), np.ones(3), np.ones(2)
    return Pass(
        engagement, metal, *fresh, wear=np.zeros(3), changes=(), depth=lambda t, x: np.full_like(t + x, DEPTH)
    )


def times(until=0.2, rate=20000.0):
    return np.arange(round(until * rate)) / rate


@pytest.mark.parametrize(("side", "edge"), [("slot", 0.0), ("down", 2e-3), ("up", 2e-3)])
def test_without_faults_the_force_is_that_of_the_idealised_cell(side, edge):
    programmed = Straight(FEED, -6.5e-3, side=side, edge=edge)
    one, t = passed(programmed, until=0.7), times(0.7)
    force = edge_force(one, t)
    tool = Tool(TOOL.radius, TOOL.helix, ANGLES)
    ideal = Engagement(tool, programmed, OMEGA, float(one.engagement.angle(t)[0]), DEPTH)
    law = Coefficients(850e6, 330e6, 190e6, 15e3, 18e3, 5e3)
    expected = forces(Cut(ideal, law), t)
    scale = np.abs(expected).max()
    turns = 2.0 * math.pi / OMEGA * 20000.0
    assert np.abs(force - expected)[: round(0.02 * 20000)].max() < 0.01 * scale
    late = slice(-round(8 * turns), None)
    np.testing.assert_allclose(force[late].mean(axis=0), expected[late].mean(axis=0), atol=1e-3 * scale)
    assert np.sqrt(((force - expected) ** 2).mean()) < 0.01 * scale


def test_a_spindle_that_is_slower_cuts_thicker_chips():
    """The shear force goes with feed over speed."""
    sharp = replace(METAL, edge=np.zeros(3))
    t = times()
    even, slow = (
        edge_force(passed(metal=sharp, spindle=spindle), t).mean(axis=0)
        for spindle in (Spindle(), Spindle(off=-0.05))
    )
    np.testing.assert_allclose((slow / even)[1:], 1.0 / 0.95, rtol=2e-3)


def test_a_ball_is_pressed_upwards_by_what_presses_a_flat_end_inwards():
    """Means of a slot in closed form, of chips that are thin against every radius of the ball.

    Their area is that of a flat end's, their normal leans by the ball's slope.
    """
    slow = 0.1 * FEED
    ball, chip = replace(TOOL, corner=6e-3), slow * 2.0 * math.pi / OMEGA / 3.0
    turn = 2.0 * math.pi / OMEGA
    t = np.arange(4000) * (turn / 4000)
    law = Metal(np.array([850e6, 330e6, 0.0]), np.zeros(3), (0.0, 0.0))
    force = edge_force(passed(Straight(slow, 0.03), tool=ball, metal=law), t).mean(axis=0)
    z = (np.arange(4000) + 0.5) * (DEPTH / 4000)
    upright, leaning = (
        part.mean() * DEPTH for part in (np.sqrt(1.0 - (1.0 - z / 6e-3) ** 2), 1.0 - z / 6e-3)
    )
    expected = [
        -3 * chip * 330e6 * upright / 4.0,
        3 * chip * 850e6 * DEPTH / 4.0,
        3 * chip * 330e6 * leaning / math.pi,
    ]
    np.testing.assert_allclose(force, expected, rtol=0.03)


def test_a_helical_path_removes_the_volume_of_its_hole():
    """Per orbit: the hole's cross-section times the pitch, of which the bottom takes a disc of the tool."""
    radius, orbit, pitch = 6e-3, 3.6e-3, 1e-3
    motion = Circling(orbit, 9.0, 0.3, pitch)
    phi = (np.arange(20000) + 0.5) * (2.0 * math.pi / 20000)
    ahead = np.sin(phi) > 0.0  # psi = 0: fed along x
    height = motion.ceiling(np.zeros_like(phi), np.sin(phi), np.cos(phi), np.full_like(phi, radius))
    swept = radius * (height * np.sin(phi))[ahead].sum() * (2.0 * math.pi / 20000) * 2.0 * math.pi * orbit
    expected = math.pi * pitch * ((radius + orbit) ** 2 - radius**2)
    assert swept == pytest.approx(expected, rel=0.02)


def test_a_holder_under_a_force_that_depends_on_its_place_rests_and_swings_in_closed_form():
    """Force f + s·x on springs K: it rests at (K − s)⁻¹ f, and each mode swings at its damped frequency."""
    holder, dt = Holder((3e6, 8e6), (900.0, 1300.0), (0.05, 0.08), 0.4), 1.0 / 20000.0
    rows, steps = holder.directions(0.0), [propagator(holder, mode, dt) for mode in (0, 1)]
    slope = np.array([[-4e5, 2e5], [1e5, -6e5]])
    force, nothing = np.array([100.0, -60.0]), np.zeros((2, 4000))
    push, bend = np.tile(force[:, None], 4000), np.tile(slope[:, :, None], 4000)
    moved, _ = march(push, bend, nothing, [0.0] * 4, rows=rows, steps=steps)
    stiffness = np.linalg.inv(holder.compliance)
    np.testing.assert_allclose(moved[:, -1], np.linalg.solve(stiffness - slope, force), rtol=1e-6)
    free, _ = march(nothing, 0.0 * bend, nothing, [1e-6, 0.0, 0.0, 0.0], rows=rows, steps=steps)
    t = np.arange(4000) * dt
    omega = 2.0 * math.pi * 900.0
    damped = omega * math.sqrt(1.0 - 0.05**2)
    swing = np.exp(-0.05 * omega * t) * (np.cos(damped * t) + 0.05 * omega / damped * np.sin(damped * t))
    np.testing.assert_allclose(rows[0] @ free, 1e-6 * swing, atol=1e-12)


def test_a_stiff_holder_changes_nothing():
    one, t = passed(until=0.1), times(0.1)
    stiff = Holder((1e12, 1e12), (5000.0, 6000.0), (0.2, 0.2), 0.1)
    rigid = edge_force(one, t)
    assert np.abs(swinging_force(one, t, stiff, 0.0) - rigid).max() < 1e-3 * np.abs(rigid).max()


def test_a_soft_holder_evens_out_an_eccentric_tool():
    """A short tooth leaves more to the next one; a tool that gives way shares it out."""
    eccentric = replace(TOOL, runout=15e-6, runout_angle=0.4)
    one, t = passed(tool=eccentric), times()
    soft = Holder((2e6, 2e6), (5000.0, 5500.0), (0.5, 0.5), 0.0)
    turn = round(2.0 * math.pi / OMEGA * 20000.0)
    late = slice(-8 * turn, None)

    def once_per_turn(force):
        angle = one.engagement.angle(t[late])
        return abs(np.mean(force[late, 1] * np.exp(1j * angle)))

    rigid, given = edge_force(one, t), swinging_force(one, t, soft, 0.0)
    assert 0.3 < once_per_turn(given) / once_per_turn(rigid) < 0.8
    np.testing.assert_allclose(given[late].mean(axis=0), rigid[late].mean(axis=0), rtol=0.03)
