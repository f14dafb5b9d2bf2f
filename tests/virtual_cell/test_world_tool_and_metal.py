"""The tool and the metal of the harder world: what is drawn, and what it comes to in the contract's terms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.chips import Tool
from virtual_cell.units import DEG, MM, UM
from virtual_cell.world.force.cutter import (
    RealTool,
    Wear,
    drawn_tool,
    drawn_wear,
    effective_runout,
    set_off,
    uneven_pitch,
    wear_per_metre,
)
from virtual_cell.world.force.metal import Metal, drawn_metal, factors, length_for, size_exponent

ANGLES = np.arange(3) * (2.0 * math.pi / 3.0)
Z = np.linspace(0.05, 2.0, 9) * MM


def good(seed=0, teeth=3):
    return drawn_tool(12.0 * MM, teeth, 35.0 * DEG, np.random.default_rng(seed))


def test_a_tool_without_faults_is_the_idealised_one():
    ideal = Tool(6.0 * MM, 35.0 * DEG, ANGLES, runout=8.0 * UM, runout_angle=0.7)
    real = RealTool(6.0 * MM, 35.0 * DEG, ANGLES, runout=8.0 * UM, runout_angle=0.7)
    for one, other in zip(real.points(Z), ideal.points(Z), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-15)


def test_three_unequal_teeth_cut_as_an_eccentric_tool_of_equal_ones():
    unequal = RealTool(6.0 * MM, 0.0, ANGLES, radial=np.array([3.0, -1.0, -2.0]) * UM)
    runout = effective_runout(unequal, 0.0)
    alike = Tool(6.0 * MM, 0.0, ANGLES, runout=abs(runout), runout_angle=float(np.angle(runout)))
    np.testing.assert_allclose(unequal.points(Z)[0], alike.points(Z)[0], atol=1e-9)


@pytest.mark.parametrize("teeth", [2, 3, 4])
def test_a_tool_is_set_off_by_what_is_asked_for_in_part_by_a_bend(teeth):
    tool = set_off(good(teeth=teeth), 12.0 * UM, 1.1, np.random.default_rng(3))
    runout = effective_runout(tool, 0.0)
    assert abs(runout) == pytest.approx(12.0 * UM, rel=1e-6)
    assert np.angle(runout) == pytest.approx(1.1, abs=1e-6)
    straight = replace(tool, bend=0.0)
    assert abs(effective_runout(straight, 0.0)) != pytest.approx(12.0 * UM, rel=0.05)


def test_a_corner_is_round():
    tool = RealTool(6.0 * MM, 35.0 * DEG, ANGLES, corner=0.8 * MM)
    z = np.linspace(0.0, 0.8, 50) * MM
    from_centre = np.hypot(0.8 * MM - tool.drop(z), 0.8 * MM - z)
    np.testing.assert_allclose(from_centre, 0.8 * MM, atol=1e-12)
    slope = np.gradient(tool.drop(z), z)[5:-5]  # of the envelope against the axis
    np.testing.assert_allclose(tool.steepness(z)[5:-5], 1.0 / np.hypot(1.0, slope), atol=0.01)
    assert tool.bounds(1.5 * MM)[[0, -1]] == pytest.approx([0.0, 1.5 * MM])
    assert (np.diff(tool.bounds(0.5 * MM)) > 0.0).all()


def test_drawn_tools_are_as_unequal_as_good_tools_are():
    tools = [good(seed) for seed in range(200)]
    offset = [abs(tool.axis(np.zeros(1))[0]) / UM for tool in tools]
    assert 0.99 <= min(offset) < 1.1
    assert 1.85 < max(offset) <= 2.01
    between = [np.ptp(tool.radial) / UM for tool in tools]
    assert min(between) > 0.7
    assert max(between) < 5.01
    spacing = [np.abs(uneven_pitch(replace(tool, twist=0.0), 0.0)).max() / DEG for tool in tools]
    assert min(spacing) > 0.019
    assert max(spacing) < 0.201
    assert all(0.1 * MM <= tool.corner <= 0.4 * MM for tool in tools)


def test_wear_is_worn_in_first_and_is_put_into_an_even_growth():
    edge = np.array([15e3, 18e3, 5e3])
    even = Wear(0.1, 0.0, 1.0, (1.0, 1.0, 1.0))
    slope, apart = wear_per_metre(even, 3.0, edge)
    assert slope == pytest.approx(0.1)
    assert apart == pytest.approx(0.0, abs=1e-9)
    real = drawn_wear(0.1, 3.0, edge, np.random.default_rng(1))
    slope, apart = wear_per_metre(real, 3.0, edge)
    assert slope == pytest.approx(0.1)
    assert 0.02 < apart < 0.6
    rate = np.diff(real.growth(np.array([0.0, 0.05, 2.9, 2.95]))[:, 1])
    assert rate[0] > rate[2]


def test_chips_that_are_thick_against_the_gradient_cost_their_area_alone():
    metal = Metal(np.ones(3), np.ones(3), (0.0, 0.0), length=1e-9)
    h = np.array([-1e-6, 2e-5, 8e-5])
    np.testing.assert_allclose(metal.cutting(h), [0.0, 2e-5, 8e-5], rtol=1e-4)
    np.testing.assert_allclose(metal.rubbing(h), [0.0, 1.0, 1.0], atol=1e-4)


def test_ploughing_is_largest_at_the_least_chip_and_none_in_air():
    metal = Metal(np.ones(3), np.ones(3), (0.0, 0.0), plough=0.3, least_chip=2e-6, contact=1e-8)
    h = np.linspace(0.0, 2e-5, 400)
    force = metal.rubbing(h)
    assert h[np.argmax(force)] == pytest.approx(2e-6, abs=1e-7)
    assert force.max() == pytest.approx(1.3, abs=1e-3)
    assert force[0] == 0.0


def test_the_strain_gradient_falls_with_half_a_power_for_thin_chips_and_with_none_for_thick():
    metal = Metal(np.ones(3), np.ones(3), (0.0, 0.0), length=1e-5)
    for h, power in ((1e-9, 0.5), (1e-2, 1.0)):
        low, high = metal.cutting(np.array([h, 1.01 * h]))
        assert math.log(high / low) / math.log(1.01) == pytest.approx(power, abs=1e-2)


@pytest.mark.parametrize("asked", [0.06, 0.15, 0.3])
def test_the_exponent_that_is_stated_is_near_that_asked_for(asked):
    metal = Metal(np.ones(3), np.ones(3), (0.0, 0.0), reference=6e-5)
    found, unsure = size_exponent(replace(metal, length=length_for(asked, metal)), 1e-4)
    assert found == pytest.approx(asked, abs=0.2 * asked + 0.01)
    assert unsure > 0.0


def test_runs_scatter_together_and_each_alone_and_drift_along_the_session():
    metal = replace(drawn_metal(np.random.default_rng(0)), common=0.01, own=0.005, drift=0.03, bar=0.0)
    early = np.array([factors(metal, 0.0, np.random.default_rng(s))[0] for s in range(600)])
    late = np.array([factors(metal, 1.0, np.random.default_rng(s))[0] for s in range(600)])
    assert early.std(axis=0) == pytest.approx(math.hypot(0.01, 0.005), rel=0.1)
    assert (early[:, 0] - early[:, 1]).std() == pytest.approx(0.005 * math.sqrt(2.0), rel=0.1)
    np.testing.assert_allclose(late / early, 1.03, rtol=1e-9)
