"""The stability boundary against published benchmark figures, brute force and limiting cases."""

import numpy as np
import pytest
from machines import BENCH, CUTS, OMEGA, PRINTED, TWO, ZETA, modes

from metro.dynamics.lobes import spectral_radius, stability_boundary
from metro.dynamics.system import Cut, Structure, immersion

SPEEDS = np.linspace(5000, 10000, 26)

TRIMULE = modes(
    (0, 21.3, 0.061, 7.3e6), (0, 34.7, 0.071, 4.1e6), (0, 56.6, 0.036, 4.2e6), (0, 65.5, 0.063, 2.2e6),
    (1, 31.4, 0.067, 3.2e8), (1, 35.1, 0.048, 7.1e7), (1, 54.7, 0.050, 4.7e7), (1, 67.3, 0.038, 1.5e7),
)  # fmt: skip

NEAR_HALF = modes(
    (0, 21.379, 0.0615, 7.155e6), (0, 34.774, 0.0718, 4.015e6), (0, 56.636, 0.036, 4.128e6),
    (0, 65.628, 0.0629, 2.237e6), (1, 31.48, 0.0558, 3.626e8), (1, 35.087, 0.0479, 6.89e7),
    (1, 54.799, 0.05, 4.716e7), (1, 67.306, 0.038, 1.4616e7),
)  # fmt: skip


def bench_cut(share, direction="down"):
    return Cut(2, *immersion(direction, share, 1.0), 6e8, 2e8)


@pytest.mark.parametrize(
    ("share", "rpm", "depth_mm", "radius"),
    [
        (1.0, 5000, 0.2, 0.8197427843),
        (1.0, 5000, 0.5, 1.0739755867),
        (1.0, 5000, 1.0, 1.4064735254),
        (0.5, 5000, 0.2, 0.6937247740),
        (0.05, 5000, 0.5, 0.6888658998),
        (0.05, 10000, 2.0, 0.5270870355),
    ],
)
def test_spectral_radius_matches_the_reference_to_nine_digits(share, rpm, depth_mm, radius):
    assert spectral_radius(BENCH, bench_cut(share), [rpm], [depth_mm * 1e-3])[0] == pytest.approx(
        radius, rel=1e-9
    )


@pytest.mark.parametrize(("share", "lowest_mm"), [(1.0, 0.3174), (0.5, 0.6112), (0.05, 1.6327)])
def test_lowest_boundary_of_the_benchmark(share, lowest_mm):
    boundary = stability_boundary(BENCH, bench_cut(share), SPEEDS)
    assert boundary.depth.min() * 1e3 == pytest.approx(lowest_mm, abs=5e-5)


def test_up_and_down_milling_differ_in_the_benchmark():
    up = stability_boundary(BENCH, bench_cut(0.05, "up"), SPEEDS).depth
    down = stability_boundary(BENCH, bench_cut(0.05, "down"), SPEEDS).depth
    assert np.abs(np.log(up / down)).max() > 0.5


@pytest.mark.parametrize("share", [1.0, 0.5, 0.05])
@pytest.mark.parametrize("rpm", [3000.0, 8000.0])
def test_free_vibration_decays_by_the_mode_alone_at_zero_depth(share, rpm):
    period = 60 / (2 * rpm)
    expected = np.exp(-ZETA * OMEGA * period)
    assert spectral_radius(BENCH, bench_cut(share), [rpm], [0.0])[0] == pytest.approx(expected, rel=1e-12)


def test_up_milling_leaves_where_the_radial_depth_says():
    # at a quarter of the diameter the tool's edge is at R - a_e = R cos(exit)
    assert immersion("up", 3.0, 12.0) == pytest.approx((0.0, np.pi / 3))
    assert immersion("down", 3.0, 12.0) == pytest.approx((2 * np.pi / 3, np.pi))
    assert immersion("up", 12.0, 12.0) == pytest.approx(immersion("slot", 12.0, 12.0))


@pytest.mark.parametrize("depth", [0.0, 13.0])
def test_a_radial_depth_outside_the_tool_is_refused(depth):
    with pytest.raises(ValueError, match="expected more than 0 and at most the diameter"):
        immersion("up", depth, 12.0)


@pytest.mark.parametrize("name", CUTS)
def test_the_boundary_parts_stable_from_unstable(name):
    rpm = np.linspace(400, 2500, 15)
    boundary = stability_boundary(TWO, CUTS[name], rpm)
    assert np.all(spectral_radius(TWO, CUTS[name], rpm, boundary.depth * (1 - 2e-4)) < 1)
    assert np.all(spectral_radius(TWO, CUTS[name], rpm, boundary.depth * (1 + 2e-4)) > 1)
    assert np.all(boundary.error < 1e-3 * boundary.depth)


@pytest.mark.parametrize("name", ["one tooth of four at a time", "two teeth of four, always"])
def test_no_depth_below_the_boundary_is_unstable(name):
    rpm = np.linspace(400, 2500, 15)
    boundary = stability_boundary(TWO, CUTS[name], rpm)
    for share in np.linspace(0.05, 0.99, 24):
        assert np.all(spectral_radius(TWO, CUTS[name], rpm, share * boundary.depth) < 1)


def test_deep_peaks_between_slot_lobes_are_found():
    speeds = np.linspace(5400, 5500, 5)
    boundary = stability_boundary(BENCH, bench_cut(1.0), speeds)
    for share in np.linspace(0.1, 0.99, 20):
        assert np.all(spectral_radius(BENCH, bench_cut(1.0), speeds, share * boundary.depth) < 1)
    assert np.all(spectral_radius(BENCH, bench_cut(1.0), speeds, 1.002 * boundary.depth) > 1)


@pytest.mark.parametrize("share", [1.0, 0.5, 0.05])
def test_the_error_estimate_is_no_less_than_the_error(share):
    rpm = np.linspace(5000, 10000, 21)
    cut = bench_cut(share)
    boundary = stability_boundary(BENCH, cut, rpm)
    growth = np.log(spectral_radius(BENCH, cut, rpm, boundary.depth * 1.001)) / 0.001
    error = np.abs(np.log(spectral_radius(BENCH, cut, rpm, boundary.depth)) / growth)
    assert np.all(error <= boundary.error / boundary.depth + 1e-8)
    assert np.all(error < 1e-3)
    assert np.all(boundary.error < 1e-3 * boundary.depth)


def test_grazing_lobes_of_many_modes_are_not_missed():
    # at 1700 … 1730 rpm two crossings leave and come back within 30 % of depth of a third one
    cut = Cut(4, 0.0, np.pi, 10145e6, 11036.5e6)
    rpm = np.linspace(1690, 1730, 9)
    boundary = stability_boundary(TRIMULE, cut, rpm)
    for share in np.linspace(0.1, 0.995, 40):
        assert np.all(spectral_radius(TRIMULE, cut, rpm, share * boundary.depth) < 1)


def test_a_pair_of_multipliers_that_crosses_close_to_minus_one_is_found():
    # chatter at nearly half the tooth frequency, and no flip: the angle is within a milliradian of pi
    cut, rpm = Cut(4, 0.0, np.pi, 10e9, 9e9), np.linspace(2241, 2243, 21)
    boundary = stability_boundary(NEAR_HALF, cut, rpm)
    half = np.abs(boundary.chatter_hz / (4 * rpm / 60) - 0.5)
    assert half.min() < 1e-4
    assert np.all(np.abs(np.diff(np.log(boundary.depth))) < 0.01)


def test_islands_that_touch_the_unit_circle_are_found():
    # at this speed a pair leaves the circle by 2e-4 and comes back, below the next crossing
    cut, rpm = Cut(4, 0.0, np.pi, 10145e6, 11036.5e6), np.linspace(1740, 1760, 41)
    boundary = stability_boundary(PRINTED, cut, rpm)
    for share in np.linspace(0.7, 0.999, 40):
        assert np.all(spectral_radius(PRINTED, cut, rpm, share * boundary.depth) < 1)
    assert np.all(spectral_radius(PRINTED, cut, rpm, 1.002 * boundary.depth) > 1)


def test_flip_lobes_chatter_at_an_odd_multiple_of_half_the_tooth_frequency():
    boundary = stability_boundary(BENCH, bench_cut(0.05), np.linspace(5000, 30000, 40))
    flip = boundary.kind == "flip"
    assert 0 < flip.sum() < 40
    ratio = boundary.chatter_hz[flip] / (2 * boundary.rpm[flip] / 60)
    np.testing.assert_allclose(ratio % 1, 0.5, atol=1e-9)


def test_chatter_is_near_the_mode():
    boundary = stability_boundary(BENCH, bench_cut(0.5), SPEEDS)
    assert np.all(np.abs(boundary.chatter_hz / 922.0 - 1) < 0.2)


def test_turning_limit_has_the_closed_form():
    # a tooth that always cuts, in y alone, is nearly turning: many teeth average the directional factors, and
    # the absolute minimum of the lobes is 2 k zeta (1 + zeta) / (mean factor)
    teeth, k, zeta = 40, 5e6, 0.03
    cut = Cut(teeth, 0.0, np.pi, 1e9, 6e8)
    factor = teeth / (2 * np.pi) * 6e8 * np.pi / 2  # mean of -(ktc sin cos - krc cos²) over the slot
    boundary = stability_boundary(modes((1, 50.0, zeta, k)), cut, np.linspace(38, 48, 120))
    assert boundary.depth.min() == pytest.approx(2 * k * zeta * (1 + zeta) / factor, rel=2e-3)


def test_a_rigid_structure_has_no_boundary():
    rigid = Structure(np.zeros(0, dtype=int), np.zeros(0), np.zeros(0), np.zeros(0))
    boundary = stability_boundary(rigid, bench_cut(0.5), SPEEDS)
    assert np.all(np.isinf(boundary.depth))
    assert set(boundary.kind) == {"none"}


def test_stiffness_and_cutting_coefficients_scale_the_depth_exactly():
    cut = CUTS["one tooth of four at a time"]
    stiffer = Structure(TWO.axis, TWO.omega, TWO.zeta, 3 * TWO.stiffness)
    softer_work = Cut(cut.teeth, cut.entry, cut.exit, cut.ktc / 3, cut.krc / 3)
    rpm = np.linspace(500, 2000, 7)
    base = stability_boundary(TWO, cut, rpm).depth
    np.testing.assert_allclose(stability_boundary(stiffer, cut, rpm).depth, 3 * base, rtol=1e-6)
    np.testing.assert_allclose(stability_boundary(TWO, softer_work, rpm).depth, 3 * base, rtol=1e-6)


def test_the_lowest_of_modes_solved_alone_is_no_lower_bound():
    cut, rpm = CUTS["two teeth of four, always"], np.linspace(500, 2000, 16)
    alone = np.min([stability_boundary(TWO.mode(i), cut, rpm).depth for i in range(4)], axis=0)
    together = stability_boundary(TWO, cut, rpm).depth
    assert np.any(together < 0.98 * alone)
