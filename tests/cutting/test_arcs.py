"""Where one pass bounds the chip, against the least of the passes on a fine grid of immersions."""

import math

import numpy as np
import pytest
from chip_grids import bounds_of, chips_left

from metro.cutting.chip import Cut
from metro.cutting.corners import raw_edges
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.edges import HIGH, LOW, edges, pieces
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.passes import passes

SLOT = Engagement(0.0, math.pi)
ANGLE = 2 * math.pi * np.arange(24) / 24
ANGLE_FINE = 2 * math.pi * np.arange(120) / 120
FINE = np.linspace(-0.25, math.pi + 0.25, 20001)


def found(angles, runout, true_path, engaged=SLOT, feed=0.03e-3):
    tool = Cutter(6e-3, math.radians(40), angles, runout, 0.7)
    before = passes(tool, Cut(feed, 3e-3, engaged), true_path, ANGLE)
    raw = raw_edges(engaged, tool.radius, true_path)
    return before, {row: bounds_of(before, raw, *row)[0] for row in np.ndindex(before.rows.shape[:2])}


@pytest.mark.parametrize("true_path", [False, True])
@pytest.mark.parametrize("runout", [0.0, 3e-6, 12e-6])
@pytest.mark.parametrize("angles", [evenly_pitched(2), evenly_pitched(5), (0.0, 1.4, 3.3, 4.9)])
def test_bounds_are_the_ends_and_kinks_of_the_least_chip(angles, runout, true_path):
    before, arcs = found(angles, runout, true_path)
    step = FINE[1] - FINE[0]
    for row, bounds in arcs.items():
        chips = chips_left(before.scale, before.rows[row], FINE)
        cutting = FINE[chips.min(axis=0) > 0.0]
        low, high = bounds[0], bounds[-1]
        if len(cutting) == 0:
            assert high < low + step
            continue
        assert (low, high) == pytest.approx((cutting[0], cutting[-1]), abs=2 * step)
        assert np.all(np.diff(bounds) >= 0.0)
        inside = (low < FINE) & (high > FINE)
        kinks = FINE[1:][(np.diff(chips.argmin(axis=0)) != 0) & inside[1:] & inside[:-1]]
        for kink in kinks:
            assert np.abs(bounds - kink).min() < 2 * step


def test_true_paths_cross_outside_the_half_circle_as_well():
    # Kinks of the least chip before φ = 0 or after π, where the chip of a turn is still positive.
    angle = 2 * math.pi * np.arange(720) / 720
    tool, cut = Cutter(6e-3, 0.7, evenly_pitched(5), 20e-6, 0.7), Cut(0.2e-3, 3e-3, SLOT)
    before, outside = passes(tool, cut, True, angle), 0
    raw = raw_edges(SLOT, tool.radius, True)
    for phi in (np.linspace(-0.2, -1e-3, 400), np.linspace(math.pi + 1e-3, math.pi + 0.2, 400)):
        for row in range(len(angle)):
            chips = chips_left(before.scale, before.rows[row, 0], phi)
            kinks = phi[:-1][(np.diff(chips.argmin(axis=0)) != 0) & (chips.min(axis=0)[1:] > 1e-9)]
            for kink in kinks:
                assert np.abs(bounds_of(before, raw, row, 0)[0] - kink).min() < 1e-3
            outside += len(kinks)
    assert outside > 10


def test_on_true_paths_a_tooth_starts_half_the_feed_angle_before_the_circle():
    # h ≈ f p sin φ + (f p)²/2R cos² φ: zero half of what the centre moved over a pitch, seen from the radius.
    _, arcs = found(evenly_pitched(4), 0.0, True, feed=0.01e-3)
    early = 0.5 * 0.01e-3 / 6e-3
    assert arcs[0, 0][0] == pytest.approx(-early, rel=0.01)
    assert arcs[0, 0][-1] == pytest.approx(math.pi + early, rel=0.01)


def test_on_true_paths_a_tooth_stops_where_the_first_of_several_close_passes_leaves_nothing():
    # At 63° pass 2 leaves nothing 1e-4 rad before pass 3 does: the chip is 0 there and grows inwards.
    tool = Cutter(3.85e-3, 0.37, evenly_pitched(6), 0.93e-6, 0.42)
    before = passes(tool, Cut(0.0376e-3, 0.5e-3, SLOT), True, ANGLE_FINE)
    raw = raw_edges(SLOT, tool.radius, True)
    for row in np.ndindex(before.rows.shape[:2]):
        bounds, _ = bounds_of(before, raw, *row)
        for end, inward in ((bounds[0], 1e-5), (bounds[-1], -1e-5)):
            near = np.array([end, end + inward])
            at, inside = chips_left(before.scale, before.rows[row], near).min(axis=0)
            assert abs(at) < 1e-5 * inside


def test_teeth_that_others_leave_nothing_cut_nowhere_on_true_paths_as_well():
    # Runout of 3.5 feeds: whole angles of the tool at which no tooth cuts beyond φ = 0.814.
    entry = Engagement(0.814, math.pi)
    tool = Cutter(9.2e-3, 0.0, evenly_pitched(5), 45.5e-6, 0.38)
    before = passes(tool, Cut(0.0128e-3, 39e-3, entry), True, ANGLE_FINE)
    raw = raw_edges(Engagement(0.814, math.pi, entry_face=True), tool.radius, True)
    fine, some = np.linspace(entry.entry, math.pi, 2001), []
    for row in np.ndindex(before.rows.shape[:2]):
        bounds, _ = bounds_of(before, raw, *row)
        cuts = bool((chips_left(before.scale, before.rows[row], fine).min(axis=0) > 0.0).any())
        assert bounds[-1] - bounds[0] <= (math.pi if cuts else 2e-3)
        some.append(cuts)
    assert 0.1 < np.mean(some) < 0.9


@pytest.mark.parametrize("true_path", [False, True])
@pytest.mark.parametrize("angles", [evenly_pitched(4), (0.0, 1.4, 3.3, 4.9)])
def test_pieces_are_the_parts_of_edges_that_cut(angles, true_path):
    # Against a fine grid of places along the edges: which of them cut, and after which pass.
    tool, cut = Cutter(6e-3, 0.6, angles, 12e-6, 0.7), Cut(0.03e-3, 3e-3, SLOT)
    before = passes(tool, cut, true_path, ANGLE_FINE)
    along = edges(tool, cut, ANGLE_FINE, step=ANGLE_FINE[1])
    cuts = pieces(before, raw_edges(SLOT, tool.radius, true_path), along)
    share = (np.arange(4000) + 0.5) / 4000
    for angle in range(0, len(ANGLE_FINE), 7):
        lengths = np.zeros(len(angles))
        for tooth in range(len(angles)):
            rows = before.rows[angle % len(before.rows), tooth % before.rows.shape[1]]
            chips = chips_left(before.scale, rows, along.top[angle, tooth] - along.span * share)
            bounding = chips.argmin(axis=0)[chips.min(axis=0) > 0.0]
            lengths += np.bincount(bounding, minlength=len(angles)) * along.span / len(share)
        at = cuts.angle == angle
        found = np.bincount(cuts.bounding[at], cuts.bounds[at, HIGH] - cuts.bounds[at, LOW], len(angles))
        assert found == pytest.approx(lengths, abs=len(angles) * 2 * along.span / len(share))


def test_a_wall_cuts_the_arc_short():
    engaged = engagement("side", "down", 2e-3, 6e-3)
    _, arcs = found(evenly_pitched(4), 3e-6, False, engaged)
    assert min(bounds[0] for bounds in arcs.values()) == engaged.entry


def test_one_tooth_meets_its_own_path_alone():
    before, arcs = found((0.0,), 12e-6, False)
    assert before.rows.shape[2] == 1
    for bounds in arcs.values():
        assert bounds == pytest.approx([0.0, math.pi])
