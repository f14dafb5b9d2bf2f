"""Proportional damping from the ratios of modes, and from the matrices that were printed."""

import numpy as np
import pytest
from scipy.linalg import eigh

from metro.surface.tip_damping import (
    Rayleigh,
    SharedRatio,
    damping_rows,
    fit_rayleigh,
    rayleigh_of_matrices,
)
from metro.surface.tip_response import TipModes, respond

# Iglesias et al. 2025, section 3.1, point 25, wrists A and B
PRINTED_A0, PRINTED_A1 = 0.9196, 0.0024
MASS = {
    "A": np.array([[654.58, 0, 382.51], [0, 903.38, 0], [382.51, 0, 269.57]]),
    "B": np.array([[651.36, 5.2, 378.43], [5.2, 918.41, 3.83], [378.43, 3.83, 269.11]]),
}
STIFFNESS = {"A": np.diag([3.32e5, 7.15e5, 8.77e5]), "B": np.diag([3.58e5, 7.46e5, 8.828e5])}
DAMPING = {
    "A": np.array([[1297.27, 0, 351.91], [0, 2328.15, 0], [351.91, 0, 2079.23]]),
    "B": np.array([[1353.1, 4.65, 348.92], [4.65, 2408.33, 3.54], [348.92, 3.54, 2104.17]]),
}


@pytest.mark.parametrize(("wrist", "a0", "a1"), [("A", 0.9228, 0.00209), ("B", 0.9188, 0.00210)])
def test_the_printed_a1_does_not_give_the_printed_damping_but_least_squares_does(wrist, a0, a1) -> None:
    found, missed = rayleigh_of_matrices(MASS[wrist], STIFFNESS[wrist], DAMPING[wrist])
    assert found == pytest.approx([a0, a1], abs=5e-5)
    assert found[1] == pytest.approx(a1, abs=5e-6)
    assert missed < 2e-3
    by_print = PRINTED_A0 * MASS[wrist] + PRINTED_A1 * STIFFNESS[wrist]
    assert np.linalg.norm(by_print - DAMPING[wrist]) > 0.1 * np.linalg.norm(DAMPING[wrist])


def test_ratios_of_modes_of_a_damped_structure_give_its_a0_and_a1_back() -> None:
    square, shape = eigh(STIFFNESS["A"], MASS["A"])
    damping = 0.9 * MASS["A"] + 0.002 * STIFFNESS["A"]
    ratio = np.diag(shape.T @ damping @ shape) / (2 * np.sqrt(square))
    found = fit_rayleigh(np.sqrt(square), ratio, np.full(3, 1e-3))
    assert found.values == pytest.approx([0.9, 0.002])
    np.testing.assert_allclose(found.ratio(np.sqrt(square)), ratio)


def test_the_covariance_is_the_scatter_of_repeated_identifications() -> None:
    rng = np.random.default_rng(1)
    omega, sd = 2 * np.pi * np.array([3.4, 4.5, 23.0]), np.array([2e-3, 3e-3, 8e-3])
    truth = 0.92 / (2 * omega) + 0.0021 * omega / 2
    found = [fit_rayleigh(omega, truth + sd * rng.standard_normal(3), sd) for _ in range(4000)]
    plain = [f.covariance / max(1.0, f.misfit) ** 2 for f in found]
    np.testing.assert_allclose(np.cov(np.array([f.values for f in found]).T), plain[0], rtol=0.1)
    values = np.array([f.values for f in found])
    off = (values - [0.92, 0.0021]) / np.sqrt([np.diag(f.covariance) for f in found])
    assert (np.abs(off) < 1.96).mean() == pytest.approx(0.97, abs=0.02)  # of 0.95, and where misfits widen


def test_modes_that_share_no_a0_and_a1_widen_the_error() -> None:
    omega, sd = 2 * np.pi * np.array([3.4, 8.0, 23.0]), np.full(3, 1e-3)
    smooth = 0.92 / (2 * omega) + 0.0021 * omega / 2
    bent = smooth + np.array([0.0, 0.02, 0.0])
    assert fit_rayleigh(omega, smooth, sd).misfit < 1e-9
    wide = fit_rayleigh(omega, bent, sd)
    assert wide.misfit > 5
    assert np.sqrt(wide.covariance[1, 1]) > 5 * np.sqrt(fit_rayleigh(omega, smooth, sd).covariance[1, 1])


def test_of_one_mode_any_share_of_the_damping_may_go_with_the_mass() -> None:
    omega, other, rng = 20.0, 12.0, np.random.default_rng(7)
    found = fit_rayleigh(np.array([omega, omega]), np.array([0.03, 0.04]), np.full(2, 1e-4))
    assert found.ratio(np.array([omega])) == pytest.approx(0.035, rel=1e-4)
    share = rng.random(200_000)
    drawn = 0.035 * (share * omega / other + (1.0 - share) * other / omega)
    assert found.ratio(np.array([other])) == pytest.approx(drawn.mean(), rel=2e-3)
    row = damping_rows(np.array([other]))[0]
    assert row @ found.covariance @ row == pytest.approx(drawn.var(), rel=0.02)


def test_modes_close_to_each_other_leave_none_without_damping_at_a_lower_frequency() -> None:
    omega, ratio = 2.0 * np.pi * np.array([4.63, 4.63, 5.22]), np.array([0.067, 0.066, 0.092])
    found = fit_rayleigh(omega, ratio, np.full(3, 6e-4))
    assert (found.values >= 0.0).all()
    assert found.ratio(0.7 * omega[:1]) > 0.05


def test_the_doubts_of_a_shared_ratio_are_the_moments_of_a_normal_logarithm() -> None:
    known = SharedRatio(0.05, 0.7)
    assert known.ratio(np.ones((2, 3))) == pytest.approx(np.full((2, 3), 0.05))
    moved = np.array([weight * np.log(other.value / 0.05) for weight, other in known.doubts()])
    assert np.sum(moved**2) == pytest.approx(0.7**2)
    fourth = [(weight * np.log(other.value / 0.05) ** 2) ** 2 for weight, other in known.doubts()]
    assert np.sum(fourth) == pytest.approx(3 * 0.7**4)


def test_the_doubts_of_measured_coefficients_make_up_their_covariance() -> None:
    known = Rayleigh(np.array([0.9, 0.002]), np.array([[0.04, -3e-5], [-3e-5, 1e-7]]), 1.0)
    moved = np.array([weight * (other.values - known.values) for weight, other in known.doubts()])
    assert moved.T @ moved == pytest.approx(known.covariance)


def test_no_damping_within_the_errors_of_a_hammer_test_lets_the_tip_ring_up() -> None:
    """At a frequency beside the measured ones a0 and a1 may make a damping below zero."""
    known = Rayleigh(np.array([0.9, 0.002]), np.array([[9.0, -0.01], [-0.01, 2e-5]]), 1.0)
    frequency = np.array([[40.0, 70.0, 300.0]])
    modes = TipModes(frequency, np.eye(3)[None], np.eye(3)[None])
    force = np.ones((1, 4001, 3))
    force[:, :1] = 0.0
    below_zero = [0.5 * other.values @ [1 / w, w] for _, other in known.doubts() for w in frequency[0]]
    assert min(below_zero) < -0.1
    for _, other in known.doubts():
        ratio = other.ratio(frequency)
        assert (ratio >= 0.0).all()
        moved = respond(modes, ratio, force, 5e-3)
        assert np.abs(moved).max() <= 2.01 * (1.0 / frequency**2).max()  # of a step without damping
