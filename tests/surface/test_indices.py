"""Flatness indices by their definitions, and what happens to X_g at zeros."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.surface.indices import iso_indices, log_mean_floor, lowered, raw_indices, symmetric

deviations = st.lists(st.floats(-1e3, 1e3).map(lambda d: round(d, 3)), min_size=2, max_size=60).map(np.array)


@settings(max_examples=200, deadline=None)
@given(deviations)
def test_xg_is_at_most_xa_and_xa_at_most_the_larger_extreme(d: np.ndarray) -> None:
    centred = d - d.mean()
    found = raw_indices(centred, 1e-9)
    assert found["xg"] <= found["xa"] * (1 + 1e-12) + 1e-9
    assert found["xa"] <= found["xm"] * (1 + 1e-12) + 1e-12  # |d| ≤ max − min, since zero lies between


def test_indices_of_three_deviations_are_those_worked_by_hand() -> None:
    found = raw_indices(np.array([-4.0, 1.0, 2.0]), 1e-6)
    assert (found["xm"], found["xa"], found["xg"]) == pytest.approx((6.0, 7.0 / 3.0, 2.0))


def test_a_geometric_mean_of_many_small_deviations_does_not_underflow() -> None:
    assert raw_indices(np.full(100_000, 1e-5), 1e-12)["xg"] == pytest.approx(1e-5)


def test_the_floor_makes_the_geometric_mean_of_rounded_data_that_of_exact_data() -> None:
    exact = np.random.default_rng(1).normal(0.0, 3.0, 400_000)
    rounded = np.round(exact)
    assert raw_indices(rounded, 1.0)["xg"] == pytest.approx(raw_indices(exact, 1e-9)["xg"], rel=0.03)
    dropped = np.exp(np.log(np.abs(rounded[rounded != 0])).mean())
    assert dropped > 1.05 * raw_indices(exact, 1e-9)["xg"]


def test_the_floor_is_the_log_mean_of_a_deviation_uniform_within_the_step() -> None:
    inside = np.random.default_rng(2).uniform(0.0, 0.5, 1_000_000)
    assert log_mean_floor(1.0) == pytest.approx(np.exp(np.log(inside).mean()), rel=5e-3)


def test_iso_peak_and_valley_add_up_to_the_total() -> None:
    found = iso_indices(np.array([-3.0, 0.0, 1.0, 2.0]))
    assert (found["fltt"], found["fltp"], found["fltv"]) == (5.0, 2.0, 3.0)
    assert found["fltq"] == pytest.approx(np.sqrt(14 / 4))


def test_a_correction_of_noise_never_makes_an_index_larger():
    assert symmetric(2.0, -0.5, 0.1).corrected == 2.0
    found = lowered(2.0, 2.4, 2.2, 2.6)
    assert (found.corrected, found.low, found.high) == (2.0, 2.0, 2.6)
