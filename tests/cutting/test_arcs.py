"""Where one pass bounds the chip, against the least of the passes on a fine grid of immersions."""

import math

import numpy as np
import pytest

from metro.cutting.arcs import arcs
from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.edges import pieces
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.nearby import edges
from metro.cutting.passes import passes

SLOT = Engagement(0.0, math.pi)
ANGLE = 2 * math.pi * np.arange(24) / 24
ANGLE_FINE = 2 * math.pi * np.arange(120) / 120
FINE = np.linspace(-0.25, math.pi + 0.25, 20001)


def found(angles, runout, true_path, engaged=SLOT, feed=0.03e-3):
    tool = Cutter(6e-3, math.radians(40), angles, runout, 0.7)
    before = passes(tool, Cut(feed, 3e-3, engaged), true_path, ANGLE)
    return before, arcs(before, engaged)


@pytest.mark.parametrize("true_path", [False, True])
@pytest.mark.parametrize("runout", [0.0, 3e-6, 12e-6])
@pytest.mark.parametrize("angles", [evenly_pitched(2), evenly_pitched(5), (0.0, 1.4, 3.3, 4.9)])
def test_bounds_are_the_ends_and_kinks_of_the_least_chip(angles, runout, true_path):
    before, bounds = found(angles, runout, true_path)
    step = FINE[1] - FINE[0]
    for row in np.ndindex(bounds.shape[1:]):
        here = before[:, *row][:, None]
        chips = here.chip(np.sin(FINE), np.cos(FINE))
        cutting = FINE[chips.min(axis=0) > 0.0]
        low, high = bounds[0, *row], bounds[-1, *row]
        if len(cutting) == 0:
            assert high < low + step
            continue
        assert (low, high) == pytest.approx((cutting[0], cutting[-1]), abs=2 * step)
        inside = (low < FINE) & (high > FINE)
        kinks = FINE[1:][(np.diff(chips.argmin(axis=0)) != 0) & inside[1:] & inside[:-1]]
        for kink in kinks:
            assert np.abs(bounds[:, *row] - kink).min() < 2 * step


def test_true_paths_cross_outside_the_half_circle_as_well():
    # Kinks of the least chip before φ = 0 or after π, where the chip of a turn is still positive.
    angle = 2 * math.pi * np.arange(720) / 720
    tool, cut = Cutter(6e-3, 0.7, evenly_pitched(5), 20e-6, 0.7), Cut(0.2e-3, 3e-3, SLOT)
    before = passes(tool, cut, True, angle)
    bounds, outside = arcs(before, SLOT), 0
    for phi in (np.linspace(-0.2, -1e-3, 400), np.linspace(math.pi + 1e-3, math.pi + 0.2, 400)):
        chips = before[:, :, 0, None].chip(np.sin(phi), np.cos(phi))
        kinks = np.argwhere((np.diff(chips.argmin(axis=0)) != 0) & (chips.min(axis=0)[:, 1:] > 1e-9))
        for row, place in kinks:
            assert np.abs(bounds[:, row, 0] - phi[place]).min() < 1e-3
        outside += len(kinks)
    assert outside > 10


def test_on_true_paths_a_tooth_starts_half_the_feed_angle_before_the_circle():
    # h ≈ f p sin φ + (f p)²/2R cos² φ: zero half of what the centre moved over a pitch, seen from the radius.
    _, bounds = found(evenly_pitched(4), 0.0, True, feed=0.01e-3)
    early = 0.5 * 0.01e-3 / 6e-3
    assert bounds[0] == pytest.approx(-early, rel=0.01)
    assert bounds[-1] == pytest.approx(math.pi + early, rel=0.01)


def test_on_true_paths_a_tooth_stops_where_the_first_of_several_close_passes_leaves_nothing():
    # At 63° pass 2 leaves nothing 1e-4 rad before pass 3 does: the chip is 0 there and grows inwards.
    tool = Cutter(3.85e-3, 0.37, evenly_pitched(6), 0.93e-6, 0.42)
    before = passes(tool, Cut(0.0376e-3, 0.5e-3, SLOT), True, ANGLE_FINE)
    low, high = arcs(before, SLOT)[[0, -1]]
    for end, inward in ((low, 1e-5), (high, -1e-5)):
        at = before.chip(np.sin(end), np.cos(end)).min(axis=0)
        inside = before.chip(np.sin(end + inward), np.cos(end + inward)).min(axis=0)
        assert np.abs(at).max() < 1e-5 * inside.min()


def test_teeth_that_others_leave_nothing_cut_nowhere_on_true_paths_as_well():
    # Runout of 3.5 feeds: whole angles of the tool at which no tooth cuts beyond φ = 0.814.
    entry = Engagement(0.814, math.pi)
    tool = Cutter(9.2e-3, 0.0, evenly_pitched(5), 45.5e-6, 0.38)
    before = passes(tool, Cut(0.0128e-3, 39e-3, entry), True, ANGLE_FINE)
    bounds = arcs(before, entry)
    fine = np.linspace(entry.entry, math.pi, 2001)[:, None, None, None]
    cuts = (before.chip(np.sin(fine), np.cos(fine)).min(axis=1) > 0.0).any(axis=0)
    assert 0.1 < cuts.mean() < 0.9
    assert np.all(bounds[-1] - bounds[0] <= np.where(cuts, math.pi, 2e-3))


@pytest.mark.parametrize("true_path", [False, True])
def test_pieces_of_edges_need_the_bounds_within_their_reach_alone(true_path):
    tool, cut = Cutter(6e-3, 0.6, (0.0, 1.4, 3.3, 4.9), 12e-6, 0.7), Cut(0.03e-3, 3e-3, SLOT)
    before = passes(tool, cut, true_path, ANGLE_FINE)
    along = edges(tool, cut, ANGLE_FINE, step=ANGLE_FINE[1])
    near, every = arcs(before, SLOT, along), arcs(before, SLOT)
    assert len(near) < len(every)
    found, expected = (
        np.stack([cuts.angle, cuts.low, cuts.high])[:, np.lexsort((cuts.low, cuts.angle))]
        for cuts in (pieces(before, bounds, along) for bounds in (near, every))
    )
    assert found == pytest.approx(expected, abs=1e-12)


def test_a_wall_cuts_the_arc_short():
    engaged = engagement("side", "down", 2e-3, 6e-3)
    _, bounds = found(evenly_pitched(4), 3e-6, True, engaged)
    assert bounds[0].min() == engaged.entry
    assert bounds[-1].max() > math.pi


def test_one_tooth_meets_its_own_path_alone():
    before, bounds = found((0.0,), 12e-6, False)
    assert len(before.sine) == 1
    assert bounds == pytest.approx(np.broadcast_to([[[0.0]], [[math.pi]]], bounds.shape))
