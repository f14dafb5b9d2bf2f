"""What shapes a simulated face, against closed forms: statics, entry, tilt, growth, and what is set wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.face import Passes, Surroundings, surface
from virtual_cell.scanner import Scanner, scan
from virtual_cell.tip import Tip, tip_heights

RADIUS, WIDTH, SPEED, LEAD = 0.008, 0.01, 0.04, 0.012
PASSES = Passes((0.06, 0.03), 0, WIDTH, RADIUS, SPEED, LEAD)
ONE = Passes((0.06, 0.016), 0, 0.016, RADIUS, SPEED, LEAD)
PERIOD = (0.06 + 2 * LEAD) / SPEED + (0.06 + 2 * LEAD) / 0.2 + 0.6


def flat(passes):
    s = np.linspace(-LEAD, passes.length + LEAD, 400)
    return [(s, np.zeros(400)) for _ in passes.axes]


def on_axis(passes, number, x=None):
    x = np.linspace(0.015, 0.045, 31) if x is None else x
    return passes.points(x, number)


def soft(stiffness, mass, damping=(0.0, 0.0)):
    return Tip(mass, *damping, lambda at: np.tile(stiffness, (len(at), 1, 1)))


def test_a_heavily_damped_tip_follows_a_slow_force_statically_on_a_stiffness_that_changes_along_the_plate():
    def stiffness(at):
        compliance = np.array([[3.0, 0.0, 1.0], [0.0, 2.0, 0.5], [1.0, 0.5, 4.0]]) * 1e-7
        return np.linalg.inv(compliance * (1.0 + 10.0 * at[:, :1, None]))

    force = np.array([50.0, -30.0, 80.0])
    tip = Tip(np.eye(3), 0.0, 2e-3, stiffness)
    for number, (s, z) in enumerate(tip_heights(PASSES, tip, lambda s: np.tile(force, (len(s), 1)))):
        some = (s > 0.0) & (s < 0.06)
        expected = np.linalg.inv(stiffness(PASSES.points(s[some], number))) @ force
        np.testing.assert_allclose(z[some], expected[:, 2], rtol=2e-3)


def test_a_force_that_steps_in_at_the_edge_rings_as_one_degree_of_freedom_does():
    mass, k, zeta = 20.0, 4e5, 0.05
    w = np.sqrt(k / mass)
    tip = soft(np.eye(3) * k, np.eye(3) * mass, (2 * zeta * w, 0.0))
    s, z = tip_heights(ONE, tip, lambda s: np.outer(s >= 0.0, [0.0, 0.0, 100.0]))[0]
    t = (s - s[s >= 0.0][0]) / SPEED + 0.001  # the force comes up within one step of 2 ms
    wd = w * np.sqrt(1 - zeta**2)
    ring = np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta * w / wd * np.sin(wd * t))
    expected = np.where(t > 0.0, 100.0 / k * (1.0 - ring), 0.0)
    assert z.max() > 1.8 * 100.0 / k
    np.testing.assert_allclose(z, expected, atol=0.06 * 100.0 / k)


def test_the_tip_goes_on_ringing_between_passes():
    mass, k = 20.0, 4e5
    decay = 0.2
    tip = soft(np.eye(3) * k, np.eye(3) * mass, (2 * decay, 0.0))
    first, second = tip_heights(PASSES, tip, lambda s: np.outer(s >= 0.0, [0.0, 0.0, 100.0]))[:2]
    before = second[0] < -0.001
    assert np.ptp(second[1][before]) > 0.2 * 100.0 / k
    assert np.ptp(first[1][before]) == 0.0


def test_gains_scale_the_force_pass_by_pass():
    tip = soft(np.eye(3) * 1e6, np.eye(3), (0.0, 2e-3))
    gains = np.array([1.0, 1.5, 0.25])
    heights = tip_heights(PASSES, tip, lambda s: np.outer(np.ones_like(s), [0.0, 0.0, 100.0]), gains)
    np.testing.assert_allclose([z[-1] for _, z in heights], 1e-4 * gains, rtol=1e-3)


@pytest.mark.parametrize("along", [0, 1])
def test_a_tilt_across_the_feed_leaves_a_plane_under_each_pass_and_steps_between_them(along):
    """About x dz = θ dy, about y dz = −θ dx, from the axis; where passes overlap the lower one stays."""
    tilt, passes = 2e-3, Passes((0.03, 0.03), along, WIDTH, RADIUS, SPEED, LEAD)
    across = np.linspace(0.00051, 0.02949, 117)
    points = np.column_stack([np.full_like(across, 0.015), across][:: 1 - 2 * along])
    axes = np.array([[0.028, 0.018, 0.008], [0.002, 0.012, 0.022]])[along]
    away = across[:, None] - axes
    cuts = tilt * away if along == 0 else -tilt * away
    expected = np.where(np.abs(away) < RADIUS, cuts, np.inf).min(axis=1)
    around = Surroundings((tilt, 0.0) if along == 0 else (0.0, tilt))
    np.testing.assert_allclose(surface(passes, flat(passes), around, points), expected, atol=1e-12)


@pytest.mark.parametrize("along", [0, 1])
def test_a_tilt_means_the_same_to_faces_of_both_directions(along):
    """The cutter is a disc whose plane is turned: at its axis its lowest rim point has cut."""
    about_x, about_y = 0.4e-3, -0.9e-3
    passes = Passes((0.06, 0.06), along, WIDTH, RADIUS, SPEED, LEAD)
    z = surface(passes, flat(passes), Surroundings((about_x, about_y)), on_axis(passes, 2))
    leaning = about_y if along == 0 else about_x  # at the axis only the rim in front and behind went by
    np.testing.assert_allclose(z, -RADIUS * abs(leaning), atol=1e-12)


def test_growth_is_a_staircase_in_the_number_of_the_pass_on_a_ramp_along_it():
    rate, x = 2e-6, np.linspace(0.015, 0.045, 31)
    around = Surroundings(growth=rate)
    for number in range(3):
        z = surface(PASSES, flat(PASSES), around, on_axis(PASSES, number, x))
        behind = number * PERIOD + (x + RADIUS + LEAD) / SPEED  # the rim's last passage is the lowest
        np.testing.assert_allclose(z, -rate * behind, atol=1e-12)


def test_growth_without_coolant_begins_when_that_fails_and_ends_at_its_amount():
    x = np.array([0.03])
    amount, tau = 30e-6, 5.0
    t = PERIOD + (0.03 + RADIUS + LEAD) / SPEED
    for begins in (0.0, 0.4 * t, 2.0 * t):
        z = surface(PASSES, flat(PASSES), Surroundings(settling=(amount, tau, begins)), on_axis(PASSES, 1, x))
        assert z[0] == pytest.approx(-amount * (1.0 - np.exp(-max(t - begins, 0.0) / tau)), rel=1e-9)


def test_a_vibration_is_the_lower_of_the_two_passages_of_the_rim():
    f, a, phase = 0.9, 10e-6, 0.7
    x = np.linspace(0.015, 0.045, 61)
    around = Surroundings(vibration=(f, a), phase=phase)
    z = surface(PASSES, flat(PASSES), around, on_axis(PASSES, 2, x))
    t = 2 * PERIOD + (x + np.array([[-RADIUS], [RADIUS]]) + LEAD) / SPEED
    np.testing.assert_allclose(z, (a * np.sin(2 * np.pi * f * t + phase)).min(axis=0), atol=1e-12)


def test_a_droop_at_entry_fades_from_where_the_axis_comes_over_the_edge():
    amount, length = -20e-6, 0.015
    x = np.linspace(0.001, 0.05, 40)
    z = surface(PASSES, flat(PASSES), Surroundings(entry=(amount, length)), on_axis(PASSES, 0, x))
    front = np.where(x >= RADIUS, amount * np.exp(-(x - RADIUS) / length), 0.0)
    behind = amount * np.exp(-(x + RADIUS) / length)
    np.testing.assert_allclose(z, np.minimum(front, behind), atol=1e-12)


def test_a_pass_that_is_set_lower_takes_its_neighbours_share_of_the_overlap():
    levels = np.array([0.0, -15e-6, 0.0])
    y = np.linspace(0.00051, 0.02949, 117)
    z = surface(
        PASSES, flat(PASSES), Surroundings(levels=levels), np.column_stack([np.full_like(y, 0.03), y])
    )
    np.testing.assert_allclose(z, np.where(np.abs(y - 0.018) < RADIUS, -15e-6, 0.0), atol=1e-12)


def test_a_spot_a_sagging_rail_and_a_bow_are_in_the_plate_whatever_the_passes():
    around = Surroundings(bow=(3e-6, -2e-6, 5e-6), spot=(0.03, 0.01, 0.008, 40e-6), sag=12e-6)
    points = np.array([[0.03, 0.01], [0.03, 0.014], [0.03, 0.029], [0.059, 0.001]])
    z = surface(PASSES, flat(PASSES), around, points)
    u, v = points[:, 0] / 0.03 - 1.0, points[:, 1] / 0.015 - 1.0
    smooth = 3e-6 * u**2 - 2e-6 * u * v + 5e-6 * v**2 + 12e-6 * v**3
    np.testing.assert_allclose(z - smooth, [40e-6, 20e-6, 0.0, 0.0], atol=1e-12)


def test_a_scanner_that_distorts_bends_a_plane_by_a_cubic():
    still = Scanner(0.001, 0.0, np.eye(4), 0.0, 0.0, distortion=(0.0, 30e-6, 0.0, -10e-6))
    cloud = scan(still, (0.06, 0.03), lambda at: np.zeros(len(at)), np.random.default_rng(0))
    u, v = cloud[:, 0] / 30.0 - 1.0, cloud[:, 1] / 15.0 - 1.0
    np.testing.assert_allclose(cloud[:, 2], 0.03 * u * u * v - 0.01 * v**3, atol=6e-4)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_the_share_of_correlated_noise_is_what_neighbours_have_in_common(share):
    noisy = replace(Scanner(0.0005, 20e-6, np.eye(4), 0.0, 0.0), correlated=share)
    cloud = scan(noisy, (0.06, 0.03), lambda at: np.zeros(len(at)), np.random.default_rng(3))
    z = cloud[:, 2].reshape(120, 60)
    z = z - z.mean()
    assert z.std() == pytest.approx(0.02, rel=0.06)
    common = np.mean(z[1:] * z[:-1]) / z.var()
    expected = share * np.exp(-(0.5**2) / (4.0 * 0.5))  # a Gaussian kernel of 1/√2 mm, convolved with itself
    assert common == pytest.approx(expected, abs=0.06)
