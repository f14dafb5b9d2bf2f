"""Linear fit of alike responses: what it shares is what each would get alone."""

import numpy as np
import pytest

from metro.dynamics.linear_fit import alike
from metro.dynamics.polefit import Scatter
from metro.dynamics.refine import Data, _quadratic, refine

OMEGA = np.linspace(60.0, 400.0, 90)
POLES = np.array([120.0, 150.0, 290.0]) * (np.array([-0.03, -0.02, -0.05]) + 1j)


def some_data(weight):
    """Responses (90, 5) of three modes, with noise, under weights (90, 5)."""
    rng = np.random.default_rng(3)
    s = 1j * OMEGA[:, None]
    shapes = rng.normal(size=(3, 5))
    frf = (1j / (s - POLES)) @ shapes + (-1j / (s - POLES.conj())) @ shapes
    noise = rng.normal(size=(2, 90, 5)) * 1e-3 * np.abs(frf).max()
    return Data(OMEGA, frf + noise[0] + 1j * noise[1], weight)


def weights(courses):
    """Weights (90, 5): every response another scale, and one of ``courses`` courses over the lines."""
    course = 1.0 + np.outer(OMEGA / OMEGA[0], np.arange(courses))
    return 1e3 * course[:, np.arange(5) % courses] * np.array([1.0, 3.0, 0.2, 7.0, 0.5])


@pytest.mark.parametrize("courses", [1, 2, 5])
def test_responses_are_alike_whose_weights_differ_by_a_factor(courses):
    groups = alike(weights(courses))
    assert len(groups) == courses
    assert sorted(np.concatenate([group.columns for group in groups])) == list(range(5))
    rebuilt = np.zeros((90, 5))
    for group in groups:
        rebuilt[:, group.columns] = group.weight[:, None] * group.scale
    assert np.allclose(rebuilt, weights(courses), rtol=1e-12)


@pytest.mark.parametrize("real", [True, False])
def test_shared_or_not_the_fit_is_the_same(real):
    weight = weights(1)
    apart = weight * (1.0 + 1e-7 * np.cos(np.outer(OMEGA, np.arange(5))))  # enough to be five courses
    assert len(alike(apart)) == 5
    start = np.abs(POLES) * 1.01, np.full(3, 0.03)
    one, five = (refine(some_data(each), *start, real=real) for each in (weight, apart))
    assert one.chi2 == pytest.approx(five.chi2, rel=1e-5)
    assert np.allclose(one.residues, five.residues, rtol=1e-5, atol=1e-5 * np.abs(one.residues).max())
    size = np.sqrt(np.einsum("cii->ci", one.joint))
    scaled = (one.joint - five.joint) / (size[:, :, None] * size[:, None, :])
    assert np.abs(scaled).max() < 1e-4


@pytest.mark.parametrize("real", [True, False])
def test_the_gradient_is_the_derivative_of_the_sum_of_squares(real):
    data = some_data(weights(2))
    theta = np.log(np.concatenate([np.abs(POLES) * 1.01, [0.03, 0.025, 0.04]]))
    _, gradient, normal = _quadratic(data, theta, real)
    step = 1e-6
    for i in range(6):
        moved = [_quadratic(data, theta + sign * step * np.eye(6)[i], real)[0] for sign in (1, -1)]
        assert (moved[0] - moved[1]) / (4 * step) == pytest.approx(gradient[i], rel=1e-4)
    assert np.linalg.eigvalsh(normal).min() > 0.0


def test_errors_do_not_depend_on_the_unit_of_the_weights():
    rng = np.random.default_rng(5)
    deviation = 1e-3 * (rng.normal(size=(4, 90, 5)) + 1j * rng.normal(size=(4, 90, 5)))
    scatter = Scatter(deviation, np.zeros(4, dtype=int))
    base = some_data(weights(2))
    fits = [
        refine(
            Data(OMEGA, base.frf, unit * base.weight, 1, scatter), np.abs(POLES), np.full(3, 0.03), real=True
        )
        for unit in (1.0, 30.0)
    ]
    for part in ("joint", "shifts"):
        one, other = (getattr(fit, part) for fit in fits)
        assert np.all(np.abs(one - other) <= 1e-4 * np.abs(one).max(axis=(0, 1)))
    assert fits[1].chi2 == pytest.approx(900.0 * fits[0].chi2, rel=1e-6)
