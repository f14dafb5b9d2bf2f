"""Cuts marched in time: growth against the multipliers of the lobes, contact lost, runout, entry, wear."""

import numpy as np
import pytest

from metro.dynamics.lobes import spectral_radius, stability_boundary
from metro.dynamics.system import Cut, Structure
from virtual_cell.milling import Coefficients
from virtual_cell.modes import Modes
from virtual_cell.recipes.trimule import MODES, TITANIUM
from virtual_cell.regeneration import Trials, march

X, Z = MODES["x"], MODES["z"]
SHEAR = Coefficients(TITANIUM.ktc, TITANIUM.krc, TITANIUM.kac, 0.0, 0.0, 0.0)
STRUCTURE = Structure(
    np.repeat([0, 1], 4),
    *(np.concatenate([getattr(m, n) for m in (X, Z)]) for n in ("omega", "damping", "stiffness")),
)
SLOT = Cut(4, 0.0, np.pi, SHEAR.ktc, SHEAR.krc)
RIGID = Modes(np.array([500.0]), np.array([0.05]), np.array([1e15]))


def growth(history, per_turn, after):
    """Rate of the change from turn to turn, per turn, of each test."""
    change = np.abs(history.tip[:, per_turn:] - history.tip[:, :-per_turn]).max(axis=2)
    largest = np.log(change.reshape(len(change), -1, per_turn).max(axis=2))
    return [np.polyfit(np.arange(after, largest.shape[1]), row[after:], 1)[0] for row in largest]


def test_below_the_boundary_it_dies_out_as_fast_as_the_multipliers_say():
    rpm = np.array([1000.0, 1250.0, 1500.0, 2000.0, 2500.0])
    depth = 0.9 * stability_boundary(STRUCTURE, SLOT, rpm).depth
    history = march(Trials((X, Z), SHEAR, 4, 1e-3, rpm, depth), 50, 240)
    expected = 4 * np.log(spectral_radius(STRUCTURE, SLOT, rpm, depth))
    np.testing.assert_allclose(growth(history, 240, 15), expected, rtol=0.08)


def test_above_it_grows_until_teeth_leave_the_cut():
    rpm = np.array([1250.0, 1250.0])
    depth = stability_boundary(STRUCTURE, SLOT, rpm).depth * [0.8, 1.3]
    history = march(Trials((X, Z), SHEAR, 4, 2e-5, rpm, depth, entry=10), 120, 120)
    change = np.abs(history.tip[:, 120:] - history.tip[:, :-120]).max(axis=2)[:, -1200:].max(axis=1)
    assert change[0] < 1e-7
    assert 1e-5 < change[1] < 1e-4  # a few feeds per tooth: the amplitude of linear theory has no bound
    assert (history.force[1, -1200:, 2] == 0.0).any()  # axial force of every tooth in the cut is positive


def test_a_rigid_slot_has_the_closed_form_mean_force():
    k = Coefficients(1e10, 1.1e10, 5e9, 6e5, 1e5, 2e5)
    depth, feed = 2e-4, 6e-5
    history = march(Trials((RIGID, RIGID), k, 4, feed, np.array([2000.0]), np.array([depth])), 6, 240)
    mean = history.force[0, 480:].mean(axis=0)
    x = -depth * feed * k.krc - 4 * depth / np.pi * k.kre
    y = depth * feed * k.ktc + 4 * depth / np.pi * k.kte
    z = 4 * depth / np.pi * k.kac * feed + 2 * depth * k.kae
    np.testing.assert_allclose(mean, [x, y, z], rtol=1e-3)


def test_with_runout_a_tooth_clears_what_all_earlier_ones_left():
    k = Coefficients(0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    feed, runout, towards = 6e-5, 5e-6, 0.7
    one = Trials((RIGID, RIGID), k, 4, feed, np.array([2000.0]), np.array([1.0]), runout, towards)
    force = march(one, 4, 240).force[0, -240:, 2]
    angle = 2 * np.pi * (np.arange(240) + 0.5) / 240
    reach = runout * np.cos(towards - np.arange(4) * np.pi / 2)
    expected = np.zeros(240)
    for tooth in range(4):
        phi = angle + tooth * np.pi / 2
        left = [m * feed * np.sin(phi) + reach[tooth] - reach[(tooth + m) % 4] for m in (1, 2, 3, 4)]
        chip = np.min(left, axis=0)
        expected += np.where(np.sin(phi) > 1e-9, np.maximum(chip, 0.0), 0.0)
    np.testing.assert_allclose(force, expected, atol=1e-9)


def test_acceleration_is_the_second_derivative_of_the_tip():
    rpm = np.array([1500.0])
    history = march(Trials((X, Z), SHEAR, 4, 2e-5, rpm, np.array([1e-5])), 12, 240)
    dt = history.dt[0]
    tip, told = history.tip[0, 1000:, 0], history.acceleration[0, 1001:-1, 0]
    second = (tip[2:] - 2 * tip[1:-1] + tip[:-2]) / dt**2
    assert np.abs(second - told).max() < 0.02 * np.abs(told).max()


def test_the_depth_rises_over_the_entry():
    k = Coefficients(0.0, 0.0, 1.0, 0.0, 0.0, 1.0)
    one = Trials((RIGID, RIGID), k, 4, 1e-4, np.array([1000.0]), np.array([1.0]), entry=10)
    level = march(one, 20, 120).force[0, :, 2].reshape(20, 120).mean(axis=1)
    np.testing.assert_allclose(level[5] / level[-1], 0.55, rtol=0.01)
    np.testing.assert_allclose(level[10:], level[-1], rtol=1e-9)


def test_wear_raises_the_edge_forces_with_the_length_cut():
    k = Coefficients(0.0, 0.0, 0.0, 0.0, 0.0, 1.0, wear=50.0)
    one = Trials((RIGID, RIGID), k, 4, 1e-4, np.array([1000.0]), np.array([1.0]))
    level = march(one, 20, 120).force[0, :, 2].reshape(20, 120).mean(axis=1)
    assert level[-1] - level[1] == pytest.approx(
        level[1] * 50.0 * 18 * 4e-4 / (1 + 50.0 * 1.5 * 4e-4), rel=0.01
    )


def test_a_stronger_force_is_stronger_by_its_factor():
    k = Coefficients(1e9, 4e8, 2e8, 0.0, 0.0, 0.0)
    trials = Trials(
        (RIGID, RIGID), k, 3, 1e-4, np.full(2, 1000.0), np.full(2, 1e-3), strength=np.array([1.0, 1.7])
    )
    force = march(trials, 4, 120).force
    np.testing.assert_allclose(force[1], 1.7 * force[0], rtol=1e-6)


def test_teeth_of_uneven_pitch_cut_chips_in_proportion_to_the_gap_before_them():
    k = Coefficients(0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    feed, shifted = 6e-5, np.radians([0.0, 18.0, 0.0])
    one = Trials((RIGID, RIGID), k, 3, feed, np.array([2000.0]), np.array([1.0]), uneven=tuple(shifted))
    force = march(one, 4, 120).force[0, -120:, 2]
    angle = 2 * np.pi * (np.arange(120) + 0.5) / 120
    stands = np.arange(3) * 2 * np.pi / 3 + shifted  # tooth j + 1 cuts before tooth j
    gap = np.mod(np.roll(stands, -1) - stands, 2 * np.pi) / (2 * np.pi / 3)
    chips = gap[:, None] * feed * np.maximum(np.sin(angle + stands[:, None]), 0.0)
    np.testing.assert_allclose(force, chips.sum(axis=0), atol=1e-9)
