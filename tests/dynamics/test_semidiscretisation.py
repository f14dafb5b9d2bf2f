"""Semi-discretisation: its order and constant, helix, pitch and runout against cases with a known answer."""

from dataclasses import replace

import numpy as np
import pytest
from machines import BENCH, CUTS, OMEGA, PRINTED, TWO, ZETA

from metro.dynamics import lobes, semidiscretisation, teeth
from metro.dynamics.system import Cut, Structure, immersion

LAG = np.tan(np.radians(40)) / 6e-3


def radius(structure, cut, rpm, depth, steps):
    engagement = cut if isinstance(cut, teeth.Engagement) else teeth.equal_teeth(cut)
    return semidiscretisation.spectral_radius(structure, engagement, [rpm], [depth], steps)[0]


def test_it_has_the_error_constant_of_its_first_order_form():
    # with the weights of the delayed displacement exchanged it is still of second order, but three times as
    # far off
    cut = Cut(2, *immersion("down", 0.5, 1.0), 6e8, 2e8)
    exact = lobes.spectral_radius(BENCH, cut, [5000], [1e-3])[0]
    error = radius(BENCH, cut, 5000.0, 1e-3, 80) - exact
    assert abs(error) < 0.05 * (OMEGA * 60 / (2 * 5000) / 80) ** 2


@pytest.mark.parametrize("rpm", [3000.0, 8000.0])
def test_free_vibration_decays_by_the_mode_alone_at_zero_depth(rpm):
    cut = Cut(2, 0.0, 1.0, 6e8, 2e8)
    assert radius(BENCH, cut, rpm, 0.0, 40) == pytest.approx(np.exp(-ZETA * OMEGA * 30 / rpm))


@pytest.mark.parametrize("name", CUTS)
def test_it_agrees_with_collocation_for_several_modes_in_two_directions(name):
    cut, rpm, depth = CUTS[name], 700.0, 0.15e-3
    exact = lobes.spectral_radius(TWO, cut, [rpm], [depth])[0]
    coarse, fine = (radius(TWO, cut, rpm, depth, steps) for steps in (60, 120))
    assert abs(fine - exact) < 0.4 * abs(coarse - exact) + 1e-7  # second order
    assert fine + (fine - coarse) / 3 == pytest.approx(exact, rel=2e-5)


def test_both_methods_agree_to_a_thousandth_of_depth_on_the_published_machine():
    cut, rpm = Cut(4, 0.0, np.pi, 10145e6, 11036.5e6), np.linspace(500, 2500, 41)
    default = lobes.stability_boundary(PRINTED, cut, rpm).depth
    coarse, fine = (
        semidiscretisation.boundary_near(PRINTED, teeth.equal_teeth(cut), rpm, default, steps)
        for steps in (40, 80)
    )
    np.testing.assert_allclose(fine + (fine - coarse) / 3, default, rtol=1e-4)


def extrapolated(structure, cut, rpm, around, steps):
    engagement = teeth.equal_teeth(cut)
    coarse, fine = (
        semidiscretisation.boundary_near(structure, engagement, rpm, around, n) for n in (steps, 2 * steps)
    )
    return fine + (fine - coarse) / 3


@pytest.mark.parametrize("name", CUTS)
def test_both_methods_agree_with_process_damping(name):
    cut, rpm = replace(CUTS[name], damping=1e8), np.array([700.0, 1500.0])
    default = lobes.stability_boundary(TWO, cut, rpm).depth
    plain = lobes.stability_boundary(TWO, CUTS[name], rpm).depth
    assert np.all(np.abs(np.log(default / plain)) > 0.05)
    np.testing.assert_allclose(extrapolated(TWO, cut, rpm, default, 50), default, rtol=1e-4)


def test_a_boundary_that_process_damping_lifts_far_is_not_missed():
    # at this speed it acts more than the chip does: most eigenvalues of the cut stand for no depth at all
    cut, rpm = replace(CUTS["one tooth of four at a time"], damping=3e8), np.array([500.0])
    default = lobes.stability_boundary(TWO, cut, rpm).depth
    plain = lobes.stability_boundary(TWO, replace(cut, damping=0.0), rpm).depth
    assert 4.0 * plain[0] < default[0] < 5.0 * plain[0]
    np.testing.assert_allclose(extrapolated(TWO, cut, rpm, default, 80), default, rtol=1e-4)


def test_damping_of_a_helix_that_spans_a_pitch_is_its_mean_over_the_arc():
    cut = replace(CUTS["one tooth of four at a time"], damping=2e8)
    height = np.array([cut.pitch / LAG])
    found = teeth.mean_damping_factors(teeth.equal_teeth(cut, LAG), height, 30)
    phi = cut.entry + (cut.exit - cut.entry) * (np.arange(2000) + 0.5) / 2000
    normal = np.stack([np.sin(phi), np.cos(phi)], axis=1)
    share = (cut.exit - cut.entry) / cut.pitch
    expected = -2e8 * share * normal.T @ normal / len(phi)
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), rtol=1e-6)


def test_a_helix_that_spans_a_pitch_leaves_nothing_of_the_period():
    # height of one axial pitch: the factors of a cut do not change with time any more
    cut = CUTS["one tooth of four at a time"]
    height = cut.pitch / LAG
    means, _ = teeth.mean_directional_factors(teeth.equal_teeth(cut, LAG), np.array([height]), 30)
    np.testing.assert_allclose(means, np.broadcast_to(means[:, :1], means.shape), rtol=1e-9)


def test_helix_does_nothing_where_the_factors_do_not_change_with_time():
    cut = CUTS["two teeth of four, always"]
    plain, helical = (radius(TWO, teeth.equal_teeth(cut, lag), 700.0, 1e-4, 60) for lag in (0.0, LAG))
    assert helical == pytest.approx(plain, rel=1e-9)


def test_equal_teeth_give_the_same_over_a_whole_turn():
    cut = CUTS["one or two teeth of three"]
    whole = teeth.unequal_teeth(cut, np.full(3, 2 * np.pi / 3))
    a_pitch = radius(TWO, cut, 700.0, 1.5e-4, 60)
    assert radius(TWO, whole, 700.0, 1.5e-4, 180) == pytest.approx(a_pitch**3, rel=1e-8)


def test_a_tooth_that_is_out_of_cut_halves_the_number_of_teeth():
    one, two = Cut(1, 0.0, 1.5, 1e9, 4e8), Cut(2, 0.0, 1.5, 1e9, 4e8)
    apart = teeth.eccentric_teeth(two, np.full(2, np.pi), np.array([0.2e-3, 0.0]), 0.05e-3)
    expected = radius(TWO, one, 900.0, 2e-4, 160)
    assert radius(TWO, apart, 900.0, 2e-4, 160) == pytest.approx(expected, rel=1e-9)


def test_fractional_delays_converge_like_whole_ones():
    cut = CUTS["two teeth of four, always"]
    uneven = teeth.unequal_teeth(cut, np.radians([84.0, 97.0, 86.0, 93.0]))
    values = [radius(TWO, uneven, 700.0, 1.2e-4, steps) for steps in (90, 180, 360)]
    assert abs(values[2] - values[1]) < 0.45 * abs(values[1] - values[0])


def test_delays_between_two_steps_lead_to_the_exact_radius():
    # a third of a turn is 33 1/3 and 66 2/3 steps
    cut = CUTS["one or two teeth of three"]
    whole = teeth.unequal_teeth(cut, np.full(3, 2 * np.pi / 3))
    coarse, fine = (radius(TWO, whole, 700.0, 1.5e-4, steps) for steps in (100, 200))
    exact = lobes.spectral_radius(TWO, cut, [700.0], [1.5e-4])[0] ** 3
    assert fine + (fine - coarse) / 3 == pytest.approx(exact, rel=2e-3)
    assert fine == pytest.approx(exact, rel=1e-2)


def test_uneven_pitch_steadies_the_worst_speed_of_a_light_mode():
    # two delays cannot both meet the phase that excites a lightly damped mode (Slavicek 1965)
    light = Structure(np.array([0]), np.array([2 * np.pi * 60.0]), np.array([0.02]), np.array([3e6]))
    cut, rpm = Cut(4, 0.0, np.pi, 1e9, 4e8), np.linspace(500, 620, 15)
    depth = lobes.stability_boundary(light, cut, rpm).depth
    worst, deeper = rpm[depth.argmin()], 1.1 * depth.min()
    uneven = teeth.unequal_teeth(cut, np.radians([75.0, 105.0, 75.0, 105.0]))
    assert radius(light, cut, worst, deeper, 120) > 1
    assert radius(light, uneven, worst, deeper, 360) < 1


def test_modal_matrices_give_the_receptance():
    free, force_in, out = semidiscretisation.state_space(TWO)
    omega = np.array([100.0, 260.0, 400.0])
    told = [out @ np.linalg.solve(1j * w * np.eye(len(free)) - free, force_in) for w in omega]
    np.testing.assert_allclose(told, TWO.receptance(omega), rtol=1e-9, atol=1e-20)


def test_a_depth_at_which_the_radius_is_unknown_leaves_the_lowest_boundary_open(monkeypatch):
    """What lies below the crossing that is found may be another one, which was not seen."""
    engagement = teeth.equal_teeth(Cut(2, *immersion("down", 0.5, 1.0), 6e8, 2e8))
    rpm, around = np.array([5000.0, 6000.0]), np.array([1e-3, 1e-3])

    def unknown_of_the_second(_structure, _engagement, _rpm, depth, _steps):
        return np.where([False, True] & (depth < 0.5e-3), np.nan, depth / around)

    monkeypatch.setattr(semidiscretisation, "spectral_radius", unknown_of_the_second)
    found = semidiscretisation.lowest_boundary(BENCH, engagement, rpm, around, 40)
    assert found[0] == pytest.approx(1e-3, rel=1e-6)
    assert np.isnan(found[1])
