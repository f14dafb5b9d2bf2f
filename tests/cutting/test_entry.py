"""The cutter going into a block and out of it: geometry by points of the rim, means by volume, limits."""

import math

import numpy as np
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.entry import entering, entry_basis, exit_basis, leaving
from metro.cutting.force import ANGLES, force_basis
from metro.cutting.law import EdgeLaw

RADIUS = 6e-3
WHOLE = {
    "slot": Engagement(0.0, math.pi),
    "up": engagement("side", "up", 2e-3, RADIUS),
    "down": engagement("side", "down", 9e-3, RADIUS),
    "face": engagement("face", "slot", 8e-3, RADIUS),
}
TOOL = Cutter(RADIUS, math.radians(40), evenly_pitched(4))
LAW = EdgeLaw()


def share_inside(parts, phi):
    return np.any([(part.entry < phi) & (phi < part.exit) for part in parts], axis=0) if parts else phi < 0


@pytest.mark.parametrize("operation", WHOLE)
@pytest.mark.parametrize("travel", [-7e-3, -5e-3, -3e-3, -0.5e-3, 1e-3])
def test_the_parts_are_where_the_rim_is_in_the_block(operation, travel):
    whole, phi = WHOLE[operation], (np.arange(4000) + 0.5) * math.pi / 4000
    cutting = (whole.entry < phi) & (phi < whole.exit)
    beyond = travel + RADIUS * np.sin(phi) > 0
    assert np.array_equal(share_inside(entering(whole, RADIUS, travel), phi), cutting & beyond)
    assert np.array_equal(share_inside(leaving(whole, RADIUS, travel), phi), cutting & ~beyond)


def test_at_half_a_radius_two_thirds_of_a_slot_are_cut():
    (part,) = entering(WHOLE["slot"], RADIUS, -RADIUS / 2)
    assert (part.entry, part.exit) == pytest.approx((math.pi / 6, 5 * math.pi / 6))


@pytest.mark.parametrize("operation", WHOLE)
def test_outside_there_is_no_force_and_inside_that_of_the_whole_cut(operation):
    cut = Cut(0.05e-3, 3e-3, WHOLE[operation])
    whole = force_basis(TOOL, LAW, cut)
    assert not entry_basis(TOOL, LAW, cut, -RADIUS).any()
    assert np.array_equal(entry_basis(TOOL, LAW, cut, 0.0), whole)
    assert np.array_equal(exit_basis(TOOL, LAW, cut, -RADIUS), whole)
    assert not exit_basis(TOOL, LAW, cut, 0.0).any()


@pytest.mark.parametrize("operation", WHOLE)
@pytest.mark.parametrize("true_path", [False, True])
def test_what_enters_first_is_what_is_missing_at_the_exit(operation, true_path):
    cut, travel = Cut(0.05e-3, 3e-3, WHOLE[operation]), -3.3e-3
    both = entry_basis(TOOL, LAW, cut, travel, true_path) + exit_basis(TOOL, LAW, cut, travel, true_path)
    whole = force_basis(TOOL, LAW, cut, true_path)
    assert both == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())


@pytest.mark.parametrize("operation", WHOLE)
def test_power_at_entry_is_that_of_the_volume_cut(operation):
    # Without helix and with one tooth the tangential force is known at every angle; of K_tc = 1 its work over
    # a turn is the volume of chip: the width of the arc across the feed × feed × depth.
    one, cut, travel = Cutter(RADIUS, 0.0, (0.0,)), Cut(0.1e-3, 2e-3, WHOLE[operation]), -3.7e-3
    force = entry_basis(one, LAW, cut, travel)[:, :, 0]
    phi = 2 * math.pi * np.arange(ANGLES) / ANGLES
    tangential = -force[:, 0] * np.cos(phi) + force[:, 1] * np.sin(phi)
    front = [math.pi - math.asin(3.7 / 6), math.asin(3.7 / 6)]
    whole = RADIUS * math.cos(cut.engagement.exit), RADIUS * math.cos(cut.engagement.entry)
    across = [np.clip(RADIUS * math.cos(end), *whole) for end in front]
    volume = (across[1] - across[0]) * 0.1e-3 * 2e-3
    assert tangential.mean() * 2 * math.pi * RADIUS == pytest.approx(volume, rel=1e-4)
