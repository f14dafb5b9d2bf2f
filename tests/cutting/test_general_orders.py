"""Orders of a general cutter by nodes that move with the arc: against a fine table; that they are smooth."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.cutting import general_orders as module
from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import engagement
from metro.cutting.force import force_basis, placed
from metro.cutting.general_orders import general_orders
from metro.cutting.law import EdgeLaw
from metro.signals.orders import amplitudes, to_orders

LAW, HIGHEST, FINE = EdgeLaw(), 48, 5760
K = np.array([9e8, 3e8, 1e8, 1.2e4, 1e4, 3e3])
UNEVEN = (0.004, 1.539, 3.149, 4.733)
ROUNDED = Cutter(8e-3, 0.61, UNEVEN, 2.2e-6, 0.19, corner=4e-4)
CUTTERS = {
    "rounded, run out": ROUNDED,
    "rounded, even": replace(ROUNDED, tooth_angles=evenly_pitched(4), runout_radius=0.0),
    "ball": Cutter(5e-3, 0.5, evenly_pitched(2), 3e-6, 1.0, corner=5e-3),
    "inserts": Cutter(25e-3, 0.0, evenly_pitched(5), reach=(0.0, 4e-6, -3e-6, 1e-6, 2e-6), taper=0.3),
    "rounded, straight flutes": replace(ROUNDED, helix=0.0),
}


def cut(cutter, how, share=0.35):
    operation, direction = ("slot", "slot") if how == "slot" else ("side", how)
    radius = cutter.radius
    return Cut(8e-5, 1.8e-3, engagement(operation, direction, share * 2.0 * radius, radius))


def by_table(cutter, of, true_path, angles=FINE):
    return amplitudes(to_orders(force_basis(cutter, LAW, of, true_path, angles), HIGHEST)) @ K


def by_arcs(cutter, of, true_path):
    return general_orders(placed(cutter, of, true_path), LAW, of, HIGHEST, true_path=true_path) @ K


@pytest.mark.parametrize("true_path", [True, False])
@pytest.mark.parametrize("how", ["slot", "down", "up"])
@pytest.mark.parametrize("name", CUTTERS)
def test_orders_are_those_of_a_fine_table(name, how, true_path, monkeypatch):
    cutter = CUTTERS[name]
    of = cut(cutter, how)
    # Straight flutes leave the cut all at once, which a table of so many angles only knows to 3e-4.
    table = by_table(cutter, of, true_path, FINE if cutter.helix else 4 * FINE)
    arcs = by_arcs(cutter, of, true_path)
    size = np.sqrt(np.sum(np.abs(table) ** 2))
    assert np.sqrt(np.sum(np.abs(arcs - table) ** 2)) < 3e-3 * size
    monkeypatch.setattr(module, "NODES", 16.0)
    finer = by_arcs(cutter, of, true_path)
    assert np.sqrt(np.sum(np.abs(finer - table) ** 2)) < 2.5e-4 * size


@pytest.mark.parametrize("share", [0.6, 0.95])
def test_a_raw_edge_on_the_side_of_the_axis_where_it_is_reached_from_inside(share):
    for how in ("down", "up"):
        of = cut(ROUNDED, how, share)
        table, arcs = by_table(ROUNDED, of, true_path=True), by_arcs(ROUNDED, of, true_path=True)
        assert np.abs(arcs - table).max() < 2e-3 * np.abs(table).max()


def test_no_cut_has_no_orders():
    of = replace(cut(ROUNDED, "slot"), axial_depth=0.0)
    assert not general_orders(ROUNDED, LAW, of, HIGHEST, true_path=True).any()


moved = {
    "corner": lambda c, h: replace(c, corner=c.corner + 4e-7 * h),
    "pitch": lambda c, h: replace(
        c, tooth_angles=(c.tooth_angles[0], c.tooth_angles[1] - 1e-5 * h, *UNEVEN[2:])
    ),
    "runout": lambda c, h: replace(c, runout_radius=c.runout_radius + 2e-8 * h),
}


@given(
    corner=st.floats(2e-4, 1e-3),
    turn=st.floats(0.0, 0.1),
    how=st.sampled_from(["slot", "down", "up"]),
    what=st.sampled_from(sorted(moved)),
)
@settings(max_examples=25, deadline=None)
def test_orders_change_as_much_to_one_side_as_to_the_other(corner, turn, how, what):
    """A table of 360 angles jumps by up to a thousandth of the force where a tooth enters past a sample."""
    cutter = replace(ROUNDED, corner=corner, tooth_angles=tuple(angle + turn for angle in UNEVEN))
    of, move = cut(cutter, how), moved[what]
    below, here, above = (by_arcs(move(cutter, h), of, true_path=True) for h in (-1, 0, 1))
    change = np.linalg.norm(above - below) / 2.0
    assert np.linalg.norm(above - 2.0 * here + below) < 0.05 * change


@pytest.mark.parametrize("how", ["slot", "up"])
def test_where_a_chip_begins_moves_with_the_runout(how):
    """With nodes that do not follow it, one of these changes was 40 % (slot) or 27 % larger to one side."""
    for more in 3e-7 * np.arange(6):
        cutter = replace(
            ROUNDED, tooth_angles=tuple(angle + 0.07 for angle in UNEVEN), runout_radius=2.2e-6 + more
        )
        of = cut(cutter, how)
        below, here, above = (by_arcs(moved["runout"](cutter, h), of, true_path=True) for h in (-1, 0, 1))
        assert np.linalg.norm(above - 2.0 * here + below) < 0.025 * np.linalg.norm(above - below)


def test_a_table_jumps_where_the_nodes_of_an_arc_do_not():
    """The case by which it was found: 0.4 N of 182 N in one sample, by 0.4 µm of the corner's radius."""
    cutter = Cutter(
        8e-3, math.radians(35.0), (0.003963628, 1.538732249, 3.149161356, 4.732920728),
        2.189835e-06, 0.193409064, corner=0.00040345401746,
    )  # fmt: skip
    of = Cut(8.7e-5, 1.8e-3, replace(engagement("side", "down", 5.6e-3, 8e-3), entry=1.8754889808102941))
    less = replace(cutter, corner=cutter.corner - 4e-7)
    jump = np.linalg.norm(by_table(cutter, of, True, 360) - by_table(less, of, True, 360))
    step = np.linalg.norm(by_arcs(cutter, of, True) - by_arcs(less, of, True))
    true = np.linalg.norm(by_table(cutter, of, True) - by_table(less, of, True))
    assert jump > 2.0 * true
    assert step == pytest.approx(true, rel=0.1)


def test_orders_do_not_jump_where_the_longest_arc_comes_to_have_a_node_more():
    """The case by which it was found: the jump was as large as five steps, and a descent ended there."""
    of = Cut(1.04e-4, 1.8e-3, engagement("slot", "slot", 12e-3, 6e-3))
    waves = []
    for share in np.linspace(0.0, 1.0, 21):
        throw = (9.475e-7 + 1.4e-8 * share) * np.array([-1.0, 1.0, -1.0, 1.0])
        four = Cutter(
            6e-3, math.radians(40.0), evenly_pitched(4), 8.34e-7 + 5e-8 * share, 5.4227 + 0.0524 * share,
            reach=tuple(throw.tolist()), corner=3.82e-4 + 3e-6 * share,
        )  # fmt: skip
        waves.append(general_orders(placed(four, of, True), LAW, of, 24, true_path=True) @ K)
    steps = np.linalg.norm(np.diff(waves, axis=0).reshape(20, -1), axis=1)
    bends = np.linalg.norm(np.diff(waves, 2, axis=0).reshape(19, -1), axis=1)
    assert bends.max() < 0.1 * steps.mean()
