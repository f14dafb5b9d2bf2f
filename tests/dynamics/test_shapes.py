"""Residues, assurance criterion and collinearity against their definitions."""

import numpy as np
import pytest

from metro.dynamics.shapes import mac, mpc, residues


def test_residues_of_exact_responses_are_exact():
    omega = 2 * np.pi * np.linspace(5, 100, 300)
    poles = 2 * np.pi * np.array([20 * (-0.05 + 1j), 60 * (-0.02 + 1j)])
    rng = np.random.default_rng(0)
    true = rng.normal(size=(2, 3)) + 1j * rng.normal(size=(2, 3))
    s = 1j * omega[:, None]
    frf = 1 / (s - poles) @ true + 1 / (s - poles.conj()) @ true.conj() + 3e-3 - 40 / omega[:, None] ** 2
    np.testing.assert_allclose(residues(omega, frf, 1 / omega, poles), true, rtol=1e-9)


def test_mac_is_one_for_proportional_shapes_and_zero_for_orthogonal_ones():
    a = np.array([[1.0, 2.0, 2.0j], [2.0, -1.0, 0.0]])
    np.testing.assert_allclose(mac(a, np.array([a[0] * (0.3 - 2j), a[1]])), np.eye(2), atol=1e-15)


def test_mac_ignores_scale_and_phase():
    rng = np.random.default_rng(1)
    a, b = (rng.normal(size=(1, 5)) + 1j * rng.normal(size=(1, 5)) for _ in range(2))
    assert mac(a, b)[0, 0] == pytest.approx(mac(7j * a, (1 - 3j) * b)[0, 0])
    assert 0 <= mac(a, b)[0, 0] < 1


@pytest.mark.parametrize("phase", [0.0, 0.7, 2.0])
def test_a_shape_on_a_line_through_zero_is_collinear(phase):
    assert mpc(np.array([1.0, -0.4, 2.0]) * np.exp(1j * phase)) == pytest.approx(1.0)


def test_a_travelling_wave_is_not_collinear():
    assert mpc(np.exp(2j * np.pi * np.arange(8) / 8)) == pytest.approx(0.0, abs=1e-15)
