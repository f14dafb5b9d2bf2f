"""Modal constants and their errors: windows, unresolved modes, repeats that share their noise."""

import numpy as np
import pytest

from metro.dynamics.frf import estimate_frf
from metro.dynamics.hits import Hit
from metro.dynamics.modal import identify_modes
from metro.dynamics.modes import modal_constants
from metro.dynamics.polefit import PoleFit, Scatter
from metro.dynamics.refine import Data, refine

# [T] table 6, position 1: damped frequency, damping, stiffness; x, then z
DAMPED = np.array([21.3257, 34.6937, 56.6075, 65.5141, 31.4277, 35.0952, 54.7344, 67.2582])
ZETA = np.array([6.08951, 7.07726, 3.5692, 6.33944, 6.71896, 4.76042, 4.99933, 3.79608]) / 100
STIFFNESS = np.array([7.25548, 4.05902, 4.18385, 2.21663, 315.41, 70.6418, 47.1786, 14.6188]) * 1e6
NATURAL = DAMPED / np.sqrt(1 - ZETA**2)
FREQUENCY = np.arange(10.0, 110.0, 0.5)


def receptance(s, modes=slice(4)):
    """Receptance at Laplace variable s (n,)."""
    w, zeta, k = 2 * np.pi * NATURAL[modes], ZETA[modes], STIFFNESS[modes]
    return (w**2 / k / (s[:, None] ** 2 + 2 * zeta * w * s[:, None] + w**2)).sum(axis=1)


def noisy(exact, level, seed):
    rng = np.random.default_rng(seed)
    sd = level * np.sqrt(np.mean(np.abs(exact) ** 2))
    noise = rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape)
    return exact + sd * noise / np.sqrt(2), np.full(exact.shape, sd**2)


def windowed_hit(tau, seed):
    """A blow recorded through an exponential window that starts with the record."""
    rate, n = 2048.0, 8192
    t = np.arange(n) / rate
    force = np.where((t > 0.02) & (t < 0.026), 400 * np.sin(np.pi * (t - 0.02) / 0.006) ** 2, 0.0)
    spectrum = np.fft.rfft(force, 2 * n)
    s = 2j * np.pi * np.fft.rfftfreq(2 * n, 1 / rate)
    response = np.fft.irfft(spectrum * receptance(s) * s**2)[:n]
    rng, window = np.random.default_rng(seed), np.exp(-t / tau)
    noise = rng.normal(size=(2, n))
    return Hit(force * window + 0.02 * noise[0], response * window + 1e-4 * response.std() * noise[1], rate)


@pytest.mark.parametrize("tau", [0.1, 0.4])
def test_the_damping_of_an_exponential_window_is_taken_off(tau):
    frf = estimate_frf([windowed_hit(tau, seed) for seed in range(3)], "m/s2", 1 / tau)
    band = np.flatnonzero((frf.frequency > 10) & (frf.frequency < 110))[:: int(frf.redundancy)]
    arguments = frf.frequency[band], frf.h1[band, None], frf.variance[band, None], 0
    found = identify_modes(*arguments, decay=1 / tau).modes
    np.testing.assert_allclose([mode.damping for mode in found], ZETA[:4], rtol=0.005)
    np.testing.assert_allclose([mode.frequency for mode in found], NATURAL[:4], rtol=0.001)
    np.testing.assert_allclose([mode.stiffness for mode in found], STIFFNESS[:4], rtol=0.01)
    np.testing.assert_allclose(
        [m.mass for m in found], [m.stiffness / (2 * np.pi * m.frequency) ** 2 for m in found]
    )
    # without it: greater by 1 / (tau omega), a fifth and more
    kept = identify_modes(*arguments).modes
    more = np.array([mode.damping for mode in kept]) - ZETA[:4]
    np.testing.assert_allclose(more, 1 / (2 * np.pi * NATURAL[:4] * tau), rtol=0.05)


def test_a_window_shorter_than_the_decay_of_a_mode_is_refused():
    s = 2j * np.pi * FREQUENCY
    with pytest.raises(ValueError, match="the exponential window decays faster"):
        identify_modes(FREQUENCY, receptance(s)[:, None], driving=0, decay=20.0)


def test_errors_of_mass_and_damper_are_those_of_repeated_tests():
    exact = receptance(2j * np.pi * FREQUENCY)
    values, sds = [], []
    for seed in range(60):
        frf, variance = noisy(exact, 0.01, seed)
        modes = identify_modes(FREQUENCY, frf[:, None], variance[:, None], 0).modes
        assert len(modes) == 4
        values.append([(m.frequency, m.damping, m.stiffness, m.mass, m.viscous) for m in modes])
        sds.append([(m.frequency_sd, m.damping_sd, m.stiffness_sd, m.mass_sd, m.viscous_sd) for m in modes])
    spread = np.std(values, axis=0) / np.mean(sds, axis=0)
    assert np.all((spread > 0.7) & (spread < 1.35))  # 60 values tell a deviation to 9 %
    omega = 2 * np.pi * NATURAL[:4]
    true = np.stack([STIFFNESS[:4] / omega**2, 2 * ZETA[:4] * STIFFNESS[:4] / omega], axis=1)
    np.testing.assert_allclose(np.mean(values, axis=0)[:, 3:], true, rtol=0.03)


def eight_coupled_modes(step, seed):
    """Three receptances of x and z motion mixed, with 1 % of noise."""
    s = 2j * np.pi * np.arange(10.0, 110.0, step)
    x, z = receptance(s), receptance(s, slice(4, 8))
    columns = [noisy(column, 0.01, 10 * seed + i) for i, column in enumerate((x, 0.5 * x + 0.5 * z, z))]
    frf, variance = (np.stack(each, axis=1) for each in zip(*columns, strict=True))
    return identify_modes(s.imag / (2 * np.pi), frf, variance)


@pytest.mark.parametrize("seed", range(3))
def test_the_weakest_of_eight_coupled_modes_is_named_as_not_resolved(seed):
    """At 1 % of noise the damping of the mode at 31.43 Hz cannot be told to better than 10 to 20 %."""
    model = eight_coupled_modes(1.0, seed)
    assert len(model.modes) == 7
    assert model.doubtful.frequency == pytest.approx(NATURAL[4], abs=4 * model.doubtful.frequency_sd)
    assert 0.08 < model.doubtful.damping_sd / model.doubtful.damping < 0.25
    finer = eight_coupled_modes(0.25, seed)
    assert len(finer.modes) == 8
    assert finer.doubtful is None


def test_a_mode_that_hardly_moves_where_it_was_hit_is_kept_and_marked():
    f, zeta = np.array([40.0, 70.0]), np.array([0.03, 0.02])
    modal = 1e-6 / (1 - (FREQUENCY[:, None] / f) ** 2 + 2j * zeta * FREQUENCY[:, None] / f)
    exact = modal @ np.array([[1.0, 1.0], [0.001, 0.06]])
    columns = [noisy(column, 0.01, i) for i, column in enumerate(exact.T)]
    frf, variance = (np.stack(each, axis=1) for each in zip(*columns, strict=True))
    first, second = identify_modes(FREQUENCY, frf, variance, 0).modes
    assert first.resolved
    assert second.damping == pytest.approx(0.02, rel=0.1)
    assert second.damping_sd < second.damping / 6
    assert second.stiffness_sd > second.stiffness / 6 or np.isnan(second.stiffness)
    assert not second.resolved


def test_chi_square_tells_a_right_model_from_one_that_lacks_a_close_mode():
    f, zeta = np.array([50.0, 53.0]), np.array([0.02, 0.02])
    ratio = FREQUENCY[:, None] / f
    exact = (1e-6 / (1 - ratio**2 + 2j * zeta * ratio)).sum(axis=1)
    frf, variance = noisy(exact, 0.01, 0)
    right = identify_modes(FREQUENCY, frf[:, None], variance[:, None], 0)
    assert 0.8 < right.fit.chi2_per_datum < 1.2
    data = Data(2 * np.pi * FREQUENCY, frf[:, None], np.sqrt(2 / variance)[:, None])
    lacking = refine(data, 2 * np.pi * np.array([51.0]), np.array([0.03]), real=True)
    assert lacking.chi2_per_datum > 50
    assert lacking.bic() > right.fit.bic()


def test_noise_that_all_lines_of_a_hit_share_is_in_the_stated_error():
    """Each hit has its own gain, as from a hammer held askew: the lines do not average it out."""
    exact = receptance(2j * np.pi * FREQUENCY)
    ratios, alone = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        gains = 1 + 0.02 * rng.normal(size=6)
        hits = np.array([noisy(gain * exact, 0.005, rng.integers(2**31))[0] for gain in gains])
        mean = hits.mean(axis=0)
        deviation = (hits - mean) / np.sqrt(6 * 5)
        variance = np.full((len(exact), 1), np.mean(np.sum(np.abs(deviation) ** 2, axis=0)))
        scatter = Scatter(deviation[:, :, None], np.zeros(6, dtype=int))
        for kept, known in ((ratios, scatter), (alone, None)):
            modes = identify_modes(FREQUENCY, mean[:, None], variance, 0, scatter=known).modes
            kept.append([(m.stiffness - k) / m.stiffness_sd for m, k in zip(modes, STIFFNESS, strict=False)])
    assert 0.88 < np.mean(np.abs(ratios) < 1.96) <= 1.0
    assert np.mean(np.abs(alone)[:, 3] < 1.96) < 0.7


@pytest.mark.parametrize("decay", [0.0, 3.0])
def test_errors_of_the_constants_follow_from_those_of_pole_and_residue(decay):
    """A fit that is uncertain along one direction of its unknowns alone: a small step along that."""
    m, step = 2, 1e-6
    omega, zeta, residue = np.array([200.0, 350.0]), np.array([0.05, 0.03]), np.array([-3e-6, -8e-6])
    for direction in np.random.default_rng(0).normal(size=(4, 3 * m)) * np.repeat([1, 1, 1e-6], m):

        def fitted(along, direction=direction):
            change = along * direction
            return PoleFit(
                omega=omega * np.exp(change[:m]),
                zeta=zeta * np.exp(change[m : 2 * m]),
                residues=1j * (residue + change[2 * m :])[:, None],
                residual_terms=np.zeros((3, 1)),
                joint=np.outer(direction, direction)[None],
                shifts=np.zeros((1, 0, 3 * m)),
                mean=np.zeros(0, dtype=int),
                chi2=1.0,
                count=(100, 10),
                real=True,
            )

        here, there, back = (
            modal_constants(fitted(along), 1, 0, np.ones(1, dtype=complex), decay)
            for along in (0, step, -step)
        )
        for name in ("frequency", "damping", "stiffness", "mass", "viscous"):
            slope = (getattr(there, name) - getattr(back, name)) / (2 * step)
            assert getattr(here, f"{name}_sd") == pytest.approx(abs(slope), rel=1e-5)
