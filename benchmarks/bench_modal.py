"""Modal identification from raw hits beside public packages, and the cost of a large stabilisation diagram.

Twenty simulated tests (5 hits on each of 2 points, 8 responses, 2048 Hz, 4 s; noise 0.2 % of the peak on the
force, 2 % rms on the responses) of the four x modes of the published machine, in which the whole chain runs
without hints; pyFRF and sdypy-EMA get the same records and the true frequencies. They are skipped where
they are not installed: ``pip install --no-deps --target DIR pyFRF sdypy-EMA pyuff sdypy-sep005 tqdm
lvm-read`` and ``PYTHONPATH=DIR``. Run: ``pytest benchmarks/bench_modal.py -o python_files='bench_*.py' -s``.
"""

import numpy as np
import pandas as pd
import pytest

from metro.dynamics.hits import Hit, gate
from metro.dynamics.modal import identify_modes
from metro.dynamics.plscf import normal_equations, poles
from metro.observables.stability.modal_test import observe_modes
from virtual_cell.recipes.trimule import MODES
from virtual_cell.roving import blows, receptance, some_shapes

X = MODES["x"]
FREQUENCY = X.omega / (2 * np.pi)
REFERENCES = (0, 3)
RATE, SEEDS, BAND = 2048.0, 20, (15.0, 100.0)
# the setting of several tried that is best for sdypy-EMA
_UPPER = 150.0
NO_FRF = pd.DataFrame(columns=["test", "position", "reference", "response", "replicate", "frequency_hz"])


def records(seed):
    """Blows on a structure of some shapes, and these."""
    rng = np.random.default_rng(seed)
    shapes = some_shapes(8, 4, rng)
    return list(blows(X, shapes, REFERENCES, rng, rate=RATE)), shapes


def rms(values):
    return 100 * np.sqrt(np.mean(np.square(values), axis=0))


def exact(frequency, shapes):
    """Receptances (n, 16) by reference, then response."""
    return np.concatenate([receptance(X, shapes, reference, frequency) for reference in REFERENCES], axis=1)


def hit_table(seed):
    parts = []
    test, shapes = records(seed)
    for reference, replicate, force, motion in test:
        for point, response in enumerate(motion):
            columns = {
                "test": "t",
                "position": "1",
                "reference": f"{reference + 1}x",
                "response": f"{point + 1}x",
                "replicate": replicate,
                "response_unit": "m/s2",
                "t_s": np.arange(len(force)) / RATE,
            }
            parts.append(pd.DataFrame({**columns, "force_n": force, "response_si": response}))
    return pd.concat(parts, ignore_index=True), shapes


def own(hits, shapes):
    """Modes, and the error of the receptances in the band, of the whole chain."""
    test = observe_modes({"hit": hits, "frf": NO_FRF}.__getitem__, {})
    used = test.used[test.used["frequency_hz"].between(*BAND)]
    error = size = 0.0
    for (reference, response), rows in used.groupby(["reference", "response"]):
        column = REFERENCES.index(int(reference[:-1]) - 1) * 8 + int(response[:-1]) - 1
        true = exact(rows["frequency_hz"].to_numpy(), shapes)[:, column]
        found = rows["real_m_n"].to_numpy() + 1j * rows["imag_m_n"].to_numpy()
        error += np.sum(np.abs(found - true) ** 2)
        size += np.sum(np.abs(true) ** 2)
    return test.modes, np.sqrt(error / size)


def test_raw_hits(benchmark):
    tests = [hit_table(seed) for seed in range(SEEDS)]
    found = benchmark.pedantic(lambda: [own(*each) for each in tests], rounds=1)
    errors, damping, stiffness, ratios = [], [], [], []
    for modes, error in found:
        errors.append(error)
        if len(modes) == 4:
            damping.append(modes["damping"] / X.damping - 1)
            stiffness.append(modes["stiffness_n_m"] / X.stiffness - 1)
            ratios.append((modes["frequency_hz"] - FREQUENCY) / modes["frequency_sd_hz"])
            ratios.append((modes["damping"] - X.damping) / modes["damping_sd"])
            ratios.append((modes["stiffness_n_m"] - X.stiffness) / modes["stiffness_sd"])
    covered = np.mean(np.abs(ratios) < 1.96)
    print(f"\nmetro, no hints: FRF {rms(errors):.2f} %, damping {rms(damping).round(2)} % of it, ", end="")
    print(f"stiffness {rms(stiffness).round(2)} %, four modes in {len(damping)} of {SEEDS}, ", end="")
    print(f"95 % intervals cover {100 * covered:.1f} %")
    assert rms(errors) <= 0.6
    assert np.all(rms(damping) <= [1.0, 0.5, 0.2, 0.2])
    assert len(damping) >= 0.9 * SEEDS
    assert 0.90 <= covered <= 0.99


@pytest.mark.parametrize("gated", [False, True], ids=["raw", "gated"])
def test_public_packages_on_the_same_hits(benchmark, gated):
    pyfrf = pytest.importorskip("pyFRF", reason="pyFRF is not installed (development only)")
    ema = pytest.importorskip("sdypy.EMA", reason="sdypy-EMA is not installed (development only)")
    sets = [records(seed) for seed in range(SEEDS)]
    found = benchmark.pedantic(lambda: [public(pyfrf, ema, *each, gated) for each in sets], rounds=1)
    errors, damping, stiffness = (np.array(column) for column in zip(*found, strict=True))
    print(f"\npyFRF H1 {'of gated records ' if gated else ''}+ sdypy-EMA, frequencies given: ", end="")
    print(
        f"FRF {rms(errors):.2f} %, damping {rms(damping).round(2)} %, stiffness {rms(stiffness).round(2)} %"
    )


def public(pyfrf, ema, test, shapes, gated):
    """Errors of receptances, damping, stiffness by pyFRF and sdypy-EMA, which gets the true frequencies."""
    responses = []
    for reference in REFERENCES:
        hits = [(force, motion) for at, _, force, motion in test if at == reference]
        for point in range(8):
            pairs = [(force, motion[point]) for force, motion in hits]
            if gated:
                pairs = [gate(Hit(*pair, RATE))[:2] for pair in pairs]
            force, motion = (np.array(channel) for channel in zip(*pairs, strict=True))
            frf = pyfrf.FRF(int(RATE), force, motion, exc_type="f", resp_type="a", window="none")
            responses.append(np.squeeze(frf.get_FRF(frf_estimator="H1", frf_form="receptance")))
    frequency = frf.get_f_axis()
    measured = np.nan_to_num(np.array(responses))
    inside = (frequency >= BAND[0]) & (frequency <= BAND[1])
    true = exact(frequency[inside], shapes).T
    error = np.linalg.norm(measured[:, inside] - true) / np.linalg.norm(true)
    model = ema.Model(
        measured, frequency, lower=BAND[0], upper=_UPPER, pol_order_high=30, frf_form="receptance"
    )
    model.get_poles(method="lscf", show_progress=False)
    model.select_closest_poles(list(FREQUENCY), f_window=4)
    _, constants = model.get_constants()
    pole = np.array([model.all_poles[order][place] for order, place in model.pole_ind])
    stiffness = np.abs(pole) ** 2 / (2j * pole.imag * constants[0, :4]).real
    return error, np.asarray(model.nat_xi) / X.damping - 1, stiffness / X.stiffness - 1


def large_set(modes=20):
    """3 × 60 receptances (n, 60, 3) on 2001 lines with 1 % of noise, its variance, and their poles."""
    rng = np.random.default_rng(0)
    frequency = np.linspace(0.5, 1000.5, 2001)
    omega = 2 * np.pi * np.sort(rng.uniform(60.0, 950.0, modes))
    zeta = rng.uniform(0.01, 0.04, modes)
    ratio = 2 * np.pi * frequency[:, None] / omega
    frf = np.einsum(
        "nm,om,im->noi",
        1 / (1 - ratio**2 + 2j * zeta * ratio),
        rng.normal(size=(60, modes)),
        rng.normal(size=(3, modes)),
    )
    variance = 1e-4 * np.mean(np.abs(frf) ** 2)
    noise = rng.normal(size=(2, *frf.shape)) * np.sqrt(variance / 2)
    return frequency, frf + noise[0] + 1j * noise[1], variance, omega * (-zeta + 1j * np.sqrt(1 - zeta**2))


def test_poles_of_all_orders_of_180_responses(benchmark):
    frequency, frf, _, true = large_set()

    def diagram():
        equations = normal_equations(frequency, frf, np.ones((len(frequency), 60)), 60)
        return [poles(equations, order) for order in range(2, 61, 2)]

    found = benchmark(diagram)[-1]
    assert max(np.min(np.abs(found - pole)) / abs(pole) for pole in true) < 0.005
    assert benchmark.stats["min"] < 3.0


def test_identification_of_180_responses(benchmark):
    frequency, frf, variance, true = large_set()
    flat = frf.reshape(len(frequency), -1)
    model = benchmark.pedantic(
        identify_modes, (frequency, flat, np.full(flat.shape, variance)), {"inputs": 3}, rounds=1
    )
    assert len(model.modes) == len(true)
    assert max(np.min(np.abs(model.fit.poles - pole)) / abs(pole) for pole in true) < 2e-4


def test_poles_of_all_orders_by_a_public_package(benchmark):
    ema = pytest.importorskip("sdypy.EMA", reason="sdypy-EMA is not installed (development only)")
    frequency, frf, *_ = large_set()
    model = ema.Model(
        frf.reshape(len(frequency), -1).T, frequency, lower=1.0, upper=1000.0, pol_order_high=60
    )
    benchmark.pedantic(lambda: model.get_poles(method="lscf", show_progress=False), rounds=1)
