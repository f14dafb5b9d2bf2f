"""The whole chain from raw blows to modes: 5 hits on each of 2 points, 8 responses, noise on both sides."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from metro.observables.stability.modal_test import observe_modes
from virtual_cell.recipes.trimule import MODES
from virtual_cell.roving import blows, receptance, some_shapes

RATE = 2048.0
X = MODES["x"]
REFERENCES = (0, 3)
NO_FRF = pd.DataFrame(columns=["test", "position", "reference", "response", "replicate", "frequency_hz"])


def hit_table(seed):
    """Rows of the canonical table of one modal test of a structure of some shapes, and these."""
    parts, rng = [], np.random.default_rng(seed)
    shapes = some_shapes(8, 4, rng)
    for reference, replicate, force, motion in blows(X, shapes, REFERENCES, rng):
        place = {"test": "t", "position": "1", "reference": f"{reference + 1}x", "replicate": replicate}
        for point, response in enumerate(motion):
            columns = {
                "response": f"{point + 1}x",
                "response_unit": "m/s2",
                "t_s": np.arange(len(force)) / RATE,
            }
            parts.append(pd.DataFrame({**place, **columns, "force_n": force, "response_si": response}))
    return pd.concat(parts, ignore_index=True), shapes


def frf_error(used, shapes):
    """Error of all measured receptances from below the first mode to beyond the last, over their size."""
    change = size = 0.0
    for (reference, response), rows in used.groupby(["reference", "response"]):
        band = rows[rows["frequency_hz"].between(15.0, 100.0)]
        exact = receptance(X, shapes, int(reference[:-1]) - 1, band["frequency_hz"].to_numpy())
        exact = exact[:, int(response[:-1]) - 1]
        found = band["real_m_n"].to_numpy() + 1j * band["imag_m_n"].to_numpy()
        change += np.sum(np.abs(found - exact) ** 2)
        size += np.sum(np.abs(exact) ** 2)
    return np.sqrt(change / size)


def judged(seeds):
    """FRF errors, relative damping errors (s, 4), number of modes, errors over their σ (s, 12)."""
    errors, damping, count, ratios = [], [], [], []
    for seed in seeds:
        hits, shapes = hit_table(seed)
        test = observe_modes({"hit": hits, "frf": NO_FRF}.__getitem__, {})
        modes = test.modes
        errors.append(frf_error(test.used, shapes))
        count.append(len(modes))
        if len(modes) != len(X.damping):
            continue
        truth = {"frequency": X.omega / (2 * np.pi), "damping": X.damping, "stiffness": X.stiffness}
        value = modes[["frequency_hz", "damping", "stiffness_n_m"]].to_numpy()
        sd = modes[["frequency_sd_hz", "damping_sd", "stiffness_sd"]].to_numpy()
        damping.append(value[:, 1] / X.damping - 1)
        ratios.append(((value - np.stack(list(truth.values()), axis=1)) / sd).ravel())
    return np.array(errors), np.array(damping), np.array(count), np.array(ratios)


def rms(values):
    return np.sqrt(np.mean(np.square(values), axis=0))


def test_two_tests_of_raw_hits_give_the_modes_that_were_hit():
    errors, damping, count, ratios = judged(range(2))
    assert np.all(count == 4)
    assert errors.max() < 0.006
    assert np.all(rms(damping) < [0.01, 0.005, 0.002, 0.002])
    assert np.abs(ratios).max() < stats.norm.isf(1e-4)


@pytest.mark.slow
def test_twenty_tests_of_raw_hits_reach_the_accuracy_that_the_noise_allows():
    errors, damping, count, ratios = judged(range(20))
    assert np.sum(count == 4) >= 18
    assert rms(errors) <= 0.006
    assert np.all(rms(damping) <= [0.01, 0.005, 0.002, 0.002])
    covered = np.mean(np.abs(ratios) < 1.96)
    assert 0.90 <= covered <= 0.99
    print(
        f"\nFRF error {100 * rms(errors):.2f} %, damping {100 * rms(damping)} %, "
        f"4 modes in {np.sum(count == 4)} of 20, intervals cover {100 * covered:.1f} %"
    )
