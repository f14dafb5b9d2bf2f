"""Orders of a cylindrical cutter, height by height: against a table of 28 800 angles; whether smooth."""

import math
from dataclasses import replace

import numpy as np
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.cylinder_orders import cylinder_orders
from metro.cutting.engagement import engagement
from metro.cutting.force import force_basis, placed
from metro.cutting.law import EdgeLaw
from metro.signals.orders import amplitudes, to_orders

HIGHEST, FINE = 48, 28_800
K = np.array([9e8, 3e8, 1e8, 1.2e4, 1e4, 3e3])
LAWS = {"linear": EdgeLaw(), "power": EdgeLaw(size_exponent=0.2)}
UNEVEN = (0.004, 1.539, 3.149, 4.733)
TWO = Cutter(5e-3, 0.52, evenly_pitched(2))
FOUR = Cutter(8e-3, 0.61, UNEVEN, 2.2e-6, 0.19)
CUTTERS = {
    "two teeth": TWO,
    "run out": replace(TWO, runout_radius=1.5e-6, runout_angle=5.7),
    "begins late": replace(TWO, runout_radius=18e-6, runout_angle=2.0),
    "one tooth cuts": replace(TWO, runout_radius=40e-6, runout_angle=1.0),
    "uneven": FOUR,
    "no runout": replace(FOUR, runout_radius=0.0),
    "left-hand": replace(FOUR, helix=-0.61),
    "inserts": Cutter(25e-3, 0.0, evenly_pitched(5), reach=(0.0, 4e-6, -3e-6, 1e-6, 2e-6)),
    "slender": replace(FOUR, radius=3e-3),
}


def cut(cutter, how, share=0.35, curvature=0.0):
    operation, direction = ("slot", "slot") if how == "slot" else ("side", how)
    operation, direction = ("face", "slot") if how == "face" else (operation, direction)
    engaged = engagement(operation, direction, share * 2.0 * cutter.radius, cutter.radius)
    return Cut(3e-5, 4e-3 if cutter.helix else 1e-3, engaged, curvature=curvature)


def by_table(cutter, law, of, true_path, angles=FINE):
    return amplitudes(to_orders(force_basis(cutter, law, of, true_path, angles), HIGHEST)) @ K


def by_heights(cutter, law, of, true_path):
    return cylinder_orders(placed(cutter, of, true_path), law, of, HIGHEST, true_path=true_path) @ K


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("true_path", [True, False])
@pytest.mark.parametrize("how", ["slot", "down", "up", "face"])
@pytest.mark.parametrize("name", CUTTERS)
def test_orders_are_those_of_a_fine_table(name, how, true_path, law):
    cutter, of = CUTTERS[name], cut(CUTTERS[name], how)
    table = by_table(cutter, LAWS[law], of, true_path)
    off = np.linalg.norm(by_heights(cutter, LAWS[law], of, true_path) - table)
    assert off < 1e-4 * np.linalg.norm(table)


def test_on_a_curve_a_tooth_meets_what_older_passes_left():
    of = cut(FOUR, "slot", curvature=60.0)
    table = by_table(FOUR, LAWS["linear"], of, true_path=True)
    found = by_heights(FOUR, LAWS["linear"], of, true_path=True)
    straight = by_heights(FOUR, LAWS["linear"], replace(of, curvature=0.0), true_path=True)
    assert np.linalg.norm(found - table) < 0.02 * np.linalg.norm(straight - table)


def test_how_far_a_tooth_reaches_is_the_same_at_all_heights():
    """The table takes it as a wave along the helix with its crest at half the depth: less at both ends."""
    long = Cutter(8e-3, 0.4, evenly_pitched(3), reach=(0.0, 9e-6, -8e-6))
    of = cut(long, "up")
    slices = [replace(of, axial_depth=of.axial_depth / 40)] * 40
    found = by_heights(long, LAWS["linear"], of, True)
    order = np.arange(HIGHEST + 1)[:, None]
    whole = sum(
        by_heights(long, LAWS["linear"], each, True)
        * np.exp(-1j * order * long.lag_per_depth * of.axial_depth * i / 40)
        for i, each in enumerate(slices)
    )
    assert np.linalg.norm(found - whole) < 1e-6 * np.linalg.norm(whole)


def test_no_cut_has_no_orders():
    of = replace(cut(FOUR, "slot"), axial_depth=0.0)
    assert not cylinder_orders(FOUR, LAWS["linear"], of, HIGHEST, true_path=True).any()


@pytest.mark.parametrize("name", ["run out", "uneven"])
def test_without_a_feed_only_the_tooth_that_reaches_farthest_rubs(name):
    of = replace(cut(CUTTERS[name], "up"), feed_per_tooth=0.0)
    table = by_table(CUTTERS[name], LAWS["linear"], of, False)
    found = by_heights(CUTTERS[name], LAWS["linear"], of, False)
    assert np.linalg.norm(found - table) < 1e-3 * np.linalg.norm(table)


def test_orders_bend_less_than_a_table_as_the_runout_grows():
    """Drawn where no arc is about to close: a step of 2 nm to one side against one to the other.

    Of 10 000 draws one jumps by 4e-4 of the force; where the runout nears the feed between two teeth, so that
    an arc closes, true paths have jumps of up to 1.5e-4 in one draw of 200 (docs/numerics.md).
    """
    rng, bends = np.random.default_rng(5), []
    for name in 150 * ["two teeth", "uneven"]:
        radius, angle = rng.uniform(5e-7, 9e-6), rng.uniform(0.0, 2.0 * math.pi)
        tool = replace(CUTTERS[name], runout_radius=radius, runout_angle=angle)
        of = cut(tool, str(rng.choice(["slot", "down", "up"])))
        tools = [replace(tool, runout_radius=radius + 2e-9 * h) for h in (-1, 0, 1)]
        heights = [by_heights(each, LAWS["linear"], of, True) for each in tools]
        table = [by_table(each, LAWS["linear"], of, True, 360) for each in tools]
        size = np.linalg.norm(heights[1])
        bends.append([np.linalg.norm(a - 2.0 * b + c) / size for a, b, c in (heights, table)])
    of_heights, of_table = np.quantile(bends, 0.99, axis=0)
    assert of_heights < 3e-7
    assert of_table > 5.0 * of_heights


def test_a_table_bends_where_the_orders_do_not():
    """A fit of a runout had stuck at one of the bends, 3.5 standard deviations from its best."""
    of = Cut(2.8e-5, 1.5e-3, engagement("slot", "slot", 0.0, TWO.radius))
    tools = [replace(TWO, runout_radius=(1.0 + 5e-3 * i) * 1e-6, runout_angle=5.75) for i in range(300)]
    table = np.diff([by_table(tool, LAWS["linear"], of, True, 360) for tool in tools], 2, axis=0)
    heights = np.diff([by_heights(tool, LAWS["linear"], of, True) for tool in tools], 2, axis=0)
    assert np.abs(table).max() > 10.0 * np.median(np.abs(table).max(axis=1))
    assert np.abs(heights).max() < 0.05 * np.abs(table).max()
