"""Automatic modal identification against exact synthetic sets, published modes and noise."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.dynamics.modal import identify_modes, roughness
from metro.dynamics.plscf import normal_equations, poles
from metro.dynamics.refine import Data, _fits, losses, refine
from metro.dynamics.shapes import residues

REAL = Path(os.environ.get("METRO_REAL_DATA", "../shared/real"))
needs_real = pytest.mark.skipif(not REAL.exists(), reason="METRO_REAL_DATA is not there")

ALTINTAS = {
    "x": "262.16/.048 503.60/.096 667.92/.057 886.78/.074 2201.5/.015 2799.4/.027 3837.7/.007 4923.6/.019 "
    "6038.7/.025",
    "y": "285.53/.021 587.8/.089 749.6/.027 804.9/.075 1573.7/.027 2038.1/.016 2303.3/.220 2681.0/.019 "
    "2870.5/.014 3838.8/.006 4928.9/.017 6073.4/.016",
}
# [T] table 6, x: the printed frequencies are the damped ones
DAMPED = np.array([21.3257, 34.6937, 56.6075, 65.5141])
ZETA = np.array([0.0608951, 0.0707726, 0.035692, 0.0633944])
STIFFNESS = np.array([7.25548e6, 4.05902e6, 4.18385e6, 2.21663e6])
MASS = np.array([402.61, 84.9923, 33.0305, 13.0291])
UNDAMPED = DAMPED / np.sqrt(1 - ZETA**2)


def receptance(frequency, f=UNDAMPED, zeta=ZETA, k=STIFFNESS):
    ratio = frequency[:, None] / f
    return (1 / (k * (1 - ratio**2 + 2j * zeta * ratio))).sum(axis=1)


def noise(rng, shape):
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)


@needs_real
@pytest.mark.parametrize("direction", ["x", "y"])
@pytest.mark.parametrize("start", [20, 30, 40])
def test_every_mode_of_the_noise_free_tool_is_recovered(direction, start):
    table = pd.read_parquet(REAL / "reference" / "modal" / f"altintas-{direction}.parquet")
    table = table[table["frequency_hz"] >= start]
    frf = (table["real"] + 1j * table["imag"]).to_numpy()[:, None]
    model = identify_modes(table["frequency_hz"].to_numpy(), frf, driving=0)
    expected = np.array([[float(v) for v in pair.split("/")] for pair in ALTINTAS[direction].split()])
    np.testing.assert_allclose([mode.frequency for mode in model.modes], expected[:, 0], rtol=1e-6)
    np.testing.assert_allclose([mode.damping for mode in model.modes], expected[:, 1], rtol=1e-5)


@pytest.mark.parametrize("level", [0.002, 0.01])
def test_published_modes_are_found_in_noise_within_their_stated_errors(level):
    frequency = np.arange(5.0, 120.0, 0.5)
    exact = receptance(frequency)
    errors = []
    for seed in range(6):
        sd = level * np.sqrt(np.mean(np.abs(exact) ** 2))
        frf = exact + sd * noise(np.random.default_rng(seed), exact.shape)
        model = identify_modes(frequency, frf[:, None], np.full((len(frequency), 1), sd**2), driving=0)
        assert len(model.modes) == 4
        for mode, f, zeta, k, m in zip(model.modes, UNDAMPED, ZETA, STIFFNESS, MASS, strict=True):
            errors.append((mode.frequency - f) / mode.frequency_sd)
            errors.append((mode.damping - zeta) / mode.damping_sd)
            errors.append((mode.stiffness - k) / mode.stiffness_sd)
            assert mode.mass == pytest.approx(m, rel=5 * mode.stiffness_sd / mode.stiffness)
    errors = np.abs(errors)
    assert errors.max() < 4.5
    assert np.mean(errors < 2) > 0.85
    assert np.mean(errors) > 0.3  # the errors stated are not idle


def test_the_damped_frequency_is_not_reported_as_the_natural_one():
    frequency = np.arange(5.0, 120.0, 0.25)
    model = identify_modes(frequency, receptance(frequency)[:, None], driving=0)
    natural = np.sqrt(STIFFNESS / MASS) / (2 * np.pi)
    np.testing.assert_allclose([mode.frequency for mode in model.modes], natural, rtol=3e-6)


def test_a_close_pair_is_kept_apart():
    f, zeta, k = np.array([100.0, 104.0]), np.array([0.02, 0.03]), np.array([1e7, 8e6])
    frequency = np.arange(60.0, 160.0, 0.25)
    exact = receptance(frequency, f, zeta, k)
    sd = 0.002 * np.abs(exact).max()
    frf = exact + sd * noise(np.random.default_rng(0), exact.shape)
    model = identify_modes(frequency, frf[:, None], np.full((len(frequency), 1), sd**2), driving=0)
    np.testing.assert_allclose([mode.frequency for mode in model.modes], f, rtol=3e-3)
    np.testing.assert_allclose([mode.damping for mode in model.modes], zeta, rtol=0.06)


def test_shapes_come_with_their_signs_and_sizes():
    frequency = np.arange(5.0, 120.0, 0.5)
    shapes = np.array([[1.0, 1.0, 1.0, 1.0], [0.5, -0.8, 0.3, -0.2]])
    ratio = frequency[:, None] / UNDAMPED
    modal = 1 / (STIFFNESS * (1 - ratio**2 + 2j * ZETA * ratio))
    frf = modal @ shapes.T
    frf = frf + 2e-3 * np.abs(frf).mean() * noise(np.random.default_rng(1), frf.shape)
    model = identify_modes(frequency, frf, driving=0)
    found = np.array([mode.shape[1].real for mode in model.modes])
    np.testing.assert_allclose(found, shapes[1], atol=0.03)


def test_modes_outside_the_band_go_into_the_residual_terms():
    frequency = np.arange(45.0, 120.0, 0.25)
    exact = receptance(frequency)
    sd = 0.002 * np.sqrt(np.mean(np.abs(exact) ** 2))
    frf = exact + sd * noise(np.random.default_rng(2), exact.shape)
    model = identify_modes(frequency, frf[:, None], np.full((len(frequency), 1), sd**2), driving=0)
    np.testing.assert_allclose([mode.frequency for mode in model.modes], UNDAMPED[2:], rtol=2e-3)


def test_without_a_driving_point_there_is_no_stiffness():
    frequency = np.arange(5.0, 120.0, 0.5)
    model = identify_modes(frequency, receptance(frequency)[:, None])
    assert all(np.isnan(mode.stiffness) for mode in model.modes)


def test_conjugated_data_are_detected():
    frequency = np.arange(5.0, 120.0, 0.5)
    with pytest.raises(ValueError, match="imaginary part is positive"):
        identify_modes(frequency, receptance(frequency).conj()[:, None], driving=0)


def test_values_that_are_not_finite_are_refused():
    frequency = np.arange(5.0, 120.0, 0.5)
    frf = receptance(frequency)[:, None]
    frf[3] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        identify_modes(frequency, frf)


def test_roughness_is_the_variance_of_white_noise():
    values = noise(np.random.default_rng(3), (4000, 1)) * 0.3
    assert roughness(values).mean() == pytest.approx(0.09, rel=0.05)


def test_the_matrix_fraction_of_two_inputs_has_the_poles_of_the_system():
    frequency = np.arange(1.0, 120.0, 0.5)
    rng = np.random.default_rng(4)
    left, right = rng.normal(size=(3, 4)), rng.normal(size=(2, 4))
    ratio = frequency[:, None] / UNDAMPED
    modal = 1 / (1 - ratio**2 + 2j * ZETA * ratio)
    frf = np.einsum("nr,or,ir->noi", modal, left, right)
    found = poles(normal_equations(frequency, frf, np.ones((len(frequency), 3)), 8), 8)
    expected = 2 * np.pi * UNDAMPED * (-ZETA + 1j * np.sqrt(1 - ZETA**2))
    for pole in expected:
        assert np.min(np.abs(found - pole)) < 2e-3 * abs(pole)


def test_poles_do_not_alias_where_the_band_begins_far_above_zero():
    frequency = np.arange(50.0, 80.0, 0.1)
    f, zeta, k = UNDAMPED[2:], ZETA[2:], STIFFNESS[2:]
    frf = receptance(frequency, f, zeta, k)[:, None, None]
    found = poles(normal_equations(frequency, frf, np.ones((len(frequency), 1)), 6), 6)
    for pole in 2 * np.pi * f * (-zeta + 1j * np.sqrt(1 - zeta**2)):
        assert np.min(np.abs(found - pole)) < 1e-2 * abs(pole)


@needs_real
def test_five_receptances_of_a_real_tool_are_reconstructed():
    folder = REAL / "batches" / "tool-impact" / "impacts"
    tables = [pd.read_csv(folder / f"frf-p{i}.csv") for i in range(1, 6)]
    frequency = tables[0]["frequency_hz"].to_numpy()
    frf = np.stack([(t["real"] + 1j * t["imag"]).to_numpy() for t in tables], axis=1)
    band = (frequency >= 600) & (frequency <= 3200)
    model = identify_modes(frequency[band], frf[band], driving=0)
    assert model.error.max() < 0.03
    assert 9 <= len(model.modes) <= 18


@pytest.mark.parametrize("real", [True, False])
def test_the_loss_of_a_mode_is_what_a_linear_fit_without_it_leaves_more(real):
    frequency = np.arange(10.0, 110.0, 1.0)
    rng = np.random.default_rng(6)
    exact = np.stack([receptance(frequency), 0.3 * receptance(frequency, UNDAMPED[::-1])], axis=1)
    frf = exact + 0.05 * np.abs(exact).mean() * noise(rng, exact.shape)
    data = Data(2 * np.pi * frequency, frf, rng.uniform(1e8, 2e8, frf.shape))
    fit = refine(data, 2 * np.pi * UNDAMPED, ZETA, real=real)
    s = 1j * data.omega[:, None]
    for mode, loss in enumerate(losses(data, fit)):
        poles_left = np.delete(fit.poles, mode)
        plus, minus = 1 / (s - poles_left), 1 / (s - poles_left.conj())
        shapes = [1j * (plus - minus), *([] if real else [plus + minus])]
        columns = [*shapes, np.ones_like(s), 1 / s**2, 1 / s**3]
        basis = np.concatenate(columns, axis=1)
        chi2 = 0.0
        for weight, values in zip(data.weight.T, frf.T, strict=True):
            both = np.concatenate([basis * weight[:, None], (values * weight)[:, None]], axis=1)
            both = np.concatenate([both.real, both.imag]) / np.linalg.norm(both, axis=0)
            scale = np.linalg.norm(values * weight)
            chi2 += scale**2 * np.sum(
                (both[:, -1] - both[:, :-1] @ np.linalg.lstsq(both[:, :-1], both[:, -1])[0]) ** 2
            )
        assert loss == pytest.approx(chi2 - fit.chi2, rel=1e-6)


def test_a_mode_that_the_lines_determine_in_one_direction_alone_has_the_loss_of_that_direction(monkeypatch):
    """As of two modes that coincide: the covariance of the unknowns is v vᵀ, and t v is t deviations away."""
    frequency, mode = np.arange(10.0, 110.0, 1.0), np.array([50.0])
    frf = receptance(frequency, mode, np.array([0.05]), np.array([1e6]))[:, None]
    data = Data(2 * np.pi * frequency, frf, np.full(frf.shape, 1e8))
    fit = refine(data, 2 * np.pi * mode, np.array([0.05]), real=False)
    (whole,) = _fits(data, np.log(np.concatenate([fit.omega, fit.zeta])), False)
    spread, unknowns, direction = whole.spread.copy(), whole.unknowns.copy(), np.array([2.0, 1.0])
    spread[:2, :2], unknowns[:2, 0] = np.outer(direction, direction), 3.0 * direction
    single = replace(whole, spread=spread, unknowns=unknowns)
    monkeypatch.setattr("metro.dynamics.refine._fits", lambda *_: [single])
    assert losses(data, fit) / whole.of.scale[0] ** 2 == pytest.approx([9.0])


def test_a_damped_mode_far_below_the_band_is_an_inertance_and_what_damping_adds():
    """1/(m s² + c s + k) at s = iω: −1/(m ω²) − i c/(m² ω³) but for the square of its frequency over ω."""
    frequency, below, ratio, mass = np.arange(20.0, 120.0, 0.25), 1.0, 0.6, 50.0
    stiffness = np.array([mass * (2 * np.pi * below) ** 2])
    frf = receptance(frequency) + receptance(frequency, np.array([below]), np.array([ratio]), stiffness)
    data = Data(2 * np.pi * frequency, frf[:, None], np.full((len(frequency), 1), 1e9))
    found = refine(data, 2 * np.pi * UNDAMPED, ZETA, real=True)
    viscous = 2.0 * ratio * np.sqrt(stiffness[0] * mass)
    inertance, damped = found.residual_terms[1:, 0]
    assert inertance == pytest.approx(-1.0 / mass, rel=0.02)
    assert damped == pytest.approx(-viscous / mass**2, rel=0.05)
    assert found.zeta == pytest.approx(ZETA, rel=1e-3)
    assert found.evaluate(data.omega)[:, 0] == pytest.approx(frf, rel=1e-3)
    shapes = residues(data.omega, data.frf, np.ones(len(frequency)), found.poles)
    assert shapes == pytest.approx(found.residues, rel=5e-3)


def test_a_mode_in_a_gap_of_the_lines_is_not_claimed_and_its_neighbours_are():
    """The hammer's spectrum has a hole there: what the modes beside it leave over puts a pole into it."""
    omega, zeta, stiffness = 2 * np.pi * np.array([60.0, 100.0, 140.0]), 0.01, 1e7
    frequency = np.arange(20.0, 200.0, 0.5)
    ratio = 2 * np.pi * frequency[:, None] / omega
    frf = (1.0 / (stiffness * (1.0 - ratio**2 + 2j * zeta * ratio))).sum(axis=1)[:, None]
    kept = np.abs(frequency - 100.0) > 6.0
    whole = [mode.frequency for mode in identify_modes(frequency, frf, None, 0).modes]
    found = [mode.frequency for mode in identify_modes(frequency[kept], frf[kept], None, 0).modes]
    assert whole == pytest.approx([60.0, 100.0, 140.0], rel=1e-3)
    assert found == pytest.approx([60.0, 140.0], rel=1e-2)
