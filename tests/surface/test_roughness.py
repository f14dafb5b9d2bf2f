"""Ra and Rz of traces whose roughness is known in closed form."""

import numpy as np
import pytest

from metro.surface.roughness import roughness

X = np.arange(0.0, 12e-3, 5e-6)


def test_a_sine_has_two_over_pi_of_its_amplitude_and_twice_its_amplitude():
    found = roughness(X, 3e-6 * np.sin(2 * np.pi * X / 0.1e-3))
    assert found.ra == pytest.approx(3e-6 * 2 / np.pi, rel=0.01)
    assert found.rz == pytest.approx(6e-6, rel=0.01)


def test_form_and_waviness_do_not_count():
    rough = 1e-6 * np.sin(2 * np.pi * X / 0.1e-3)
    wavy = rough + 50e-6 * np.sin(2 * np.pi * X / 8e-3) + 2e-3 * X
    assert roughness(X, wavy).ra == pytest.approx(roughness(X, rough).ra, rel=0.05)


def test_at_the_cut_off_half_is_left():
    found = roughness(X, 1e-6 * np.sin(2 * np.pi * X / 0.8e-3))
    assert found.ra == pytest.approx(1e-6 / np.pi, rel=0.03)


def test_white_heights_have_the_mean_deviation_of_a_normal():
    rng = np.random.default_rng(0)
    assert roughness(X, 1e-6 * rng.standard_normal(len(X))).ra == pytest.approx(0.798e-6, rel=0.05)


@pytest.mark.parametrize(("x", "said"), [(X[:200], "a trace of"), (np.arange(0.0, 50e-3, 0.2e-3), "apart")])
def test_short_and_coarse_traces_are_refused(x, said):
    with pytest.raises(ValueError, match=said):
        roughness(x, np.zeros(len(x)))
