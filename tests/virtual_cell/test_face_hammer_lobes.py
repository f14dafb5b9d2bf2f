"""Faces, hammer records and chatter labels against statics, transfer functions and known limits."""

from __future__ import annotations

import numpy as np
import pytest

from virtual_cell.face import Passes, Surroundings, surface
from virtual_cell.hammer import acceleration, hit, receptance
from virtual_cell.lobes import stable
from virtual_cell.milling import Coefficients
from virtual_cell.modes import Modes
from virtual_cell.scanner import Scanner, scan
from virtual_cell.tip import Tip, tip_heights
from virtual_cell.units import MM, UM

PASSES = Passes((0.06, 0.03), 0, 0.01, 0.008, 0.04, 0.012)
RNG = np.random.default_rng


def inner_grid():
    x, y = np.meshgrid(np.linspace(0.02, 0.04, 9), np.linspace(0.001, 0.029, 15), indexing="ij")
    return np.column_stack([x.ravel(), y.ravel()])


def level(height):
    s = np.linspace(-0.012, 0.072, 50)
    return [(s, np.full(50, h)) for h in height]


def test_a_steady_force_lifts_the_tip_by_the_static_compliance():
    stiffness = np.diag([3e6, 7e6, 9e6]) + 1e5
    tip = Tip(np.diag([20.0, 20.0, 20.0]), 5.0, 2e-3, lambda points: np.tile(stiffness, (len(points), 1, 1)))
    heights = tip_heights(PASSES, tip, lambda s: np.tile([40.0, -20.0, 90.0], (len(s), 1)))
    expected = np.linalg.solve(stiffness, [40.0, -20.0, 90.0])[2]
    assert heights[0][1][-1] == pytest.approx(expected, rel=1e-3)


def test_the_tip_rings_at_its_natural_frequency_after_a_step():
    tip = Tip(np.eye(3) * 10.0, 1.0, 0.0, lambda points: np.tile(np.eye(3) * 1e5, (len(points), 1, 1)))
    s, z = tip_heights(PASSES, tip, lambda s: np.tile([0.0, 0.0, 10.0], (len(s), 1)))[0]
    spectrum = np.abs(np.fft.rfft(z - z.mean(), 16 * len(z)))
    frequency = np.argmax(spectrum) / (16 * len(z) * (s[1] - s[0]) / PASSES.speed)
    assert frequency == pytest.approx(np.sqrt(1e4) / (2 * np.pi), rel=0.03)


def test_the_lowest_pass_over_a_point_decides():
    points = inner_grid()
    z = surface(PASSES, level([10e-6, 4e-6, 7e-6]), Surroundings(), points)
    under = {n: np.abs(points[:, 1] - axis) < 0.008 for n, axis in enumerate(PASSES.axes)}
    expected = np.min([np.where(under[n], h, np.inf) for n, h in enumerate([10e-6, 4e-6, 7e-6])], axis=0)
    np.testing.assert_allclose(z, expected, atol=1e-12)


def test_a_tilt_along_the_feed_leaves_dished_passes():
    """The dish of a cutter of radius R tilted by θ: the low side of the rim cuts, −θ √(R² − y²)."""
    tilt, points = 1e-3, inner_grid()
    z = surface(
        Passes((0.06, 0.016), 0, 0.016, 0.008, 0.04, 0.012), level([0.0]), Surroundings((0.0, tilt)), points
    )
    across = points[:, 1] - (0.016 - 0.016 + 0.008)
    inside = np.abs(across) < 0.008
    np.testing.assert_allclose(z[inside], -tilt * np.sqrt(0.008**2 - across[inside] ** 2), atol=1e-9)


def test_a_growing_tool_cuts_lower_pass_by_pass():
    points = inner_grid()
    z = surface(PASSES, level([0.0] * 3), Surroundings(growth=1e-6), points)
    first, last = points[:, 1] > 0.024, points[:, 1] < 0.005
    assert z[first].mean() - z[last].mean() == pytest.approx(2 * PASSES.period * 1e-6, rel=0.2)


def test_a_bow_is_a_parabola_over_the_block():
    points = np.array([[0.0, 0.015], [0.03, 0.015], [0.06, 0.015]])
    z = surface(PASSES, level([0.0] * 3), Surroundings(bow=(20e-6, 0.0, 0.0)), points)
    np.testing.assert_allclose(z, [20e-6, 0.0, 20e-6], atol=1e-12)


def test_every_point_of_the_plate_is_cut_and_passes_run_in_climb_milling():
    for along in (0, 1):
        passes = Passes((0.06, 0.03), along, 0.01, 0.008, 0.04, 0.012)
        edge = np.sort(passes.axes)
        assert edge[0] <= 0.008
        assert edge[-1] >= passes.size[1 - along] - 0.008
        assert np.diff(edge).max() < 2 * 0.008
        falling = passes.axes[1] < passes.axes[0]
        assert falling == (along == 0)


def test_a_scan_has_its_noise_and_goes_back_through_to_work():
    to_work = np.array(
        [[0.0, -1.0, 0.0, 40.0], [1.0, 0.0, 0.0, -5.0], [0.0, 0.0, 1.0, 9.0], [0.0, 0.0, 0.0, 1.0]]
    )
    scanner = Scanner(0.5 * MM, 19.0 * UM, to_work, 0.0, 0.0)
    cloud = scan(scanner, (0.06, 0.03), lambda points: 1e-3 * points[:, 0], RNG(0))
    work = cloud @ to_work[:3, :3].T + to_work[:3, 3]
    assert work[:, 0].min() > -0.01
    assert work[:, 0].max() < 60.01
    rest = work[:, 2] - 1e-3 * work[:, 0]
    assert rest.std() == pytest.approx(0.019, rel=0.05)


MODES = Modes(
    np.array([34.6937, 65.5141]), np.array([0.0707726, 0.0633944]), np.array([4.05902e6, 2.21663e6])
)


def test_undamped_frequency_and_stiffness_give_the_published_masses():
    np.testing.assert_allclose(MODES.stiffness / MODES.omega**2, [84.9923, 13.0291], rtol=1e-5)


def test_a_short_pulse_rings_with_the_receptance():
    dt = 1.0 / 32768.0
    force = np.zeros(2**17)
    force[100:150] = 1000.0
    frequency = np.fft.rfftfreq(len(force), dt)
    band = (frequency > 15.0) & (frequency < 100.0)
    response, pulse = (np.fft.rfft(channel)[band] for channel in (acceleration(MODES, force, dt), force))
    expected = -((2 * np.pi * frequency[band]) ** 2) * receptance(MODES, frequency[band])
    np.testing.assert_allclose(response / pulse, expected, rtol=0.01, atol=1e-3)


def test_hits_differ_and_start_before_the_pulse():
    one, two = hit(MODES, 2048.0, 1.0, RNG(1)), hit(MODES, 2048.0, 1.0, RNG(2))
    assert one["force_n"].max() > 200.0
    assert np.abs(one["force_n"][:90]).max() < 0.03 * one["force_n"].max()
    assert one["force_n"].max() != two["force_n"].max()


def test_chatter_labels_bracket_the_published_one_mode_benchmark():
    """Full immersion, two teeth, 5000 rpm: spectral radius 0.820 at 0.2 mm, 1.074 at 0.5 mm."""
    soft = Modes(np.array([922.0]), np.array([0.011]), np.array([0.03993 * (2 * np.pi * 922.0) ** 2]))
    stiff = Modes(np.array([922.0]), np.array([0.011]), np.array([1e14]))
    k = Coefficients(6e8, 2e8, 0.0, 0.0, 0.0, 0.0)
    depth = np.array([0.2, 0.5, 1.0]) * MM
    good = stable((soft, stiff), k, teeth=2, feed=0.05 * MM, rpm=np.full(3, 5000.0), depth=depth, turns=150)
    assert good.tolist() == [True, False, False]
