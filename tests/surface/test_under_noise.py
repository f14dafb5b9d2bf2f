"""Coverage of the intervals on simulated faces: how often they hold the index of the face without noise."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from metro.surface.under_noise import _of_extreme, _of_mean

ROOT = Path(__file__).resolve().parents[2]
DRAWS = 24
CASES = {
    ("dome", "white, known"): 20_000,
    ("grooves", "white, one scan"): 2_000,
    ("saddle", "correlated, known"): 20_000,
    ("near-flat", "white, known"): 2_000,
}


@cache
def faces(shape: str, noise: str, points: int) -> dict[str, tuple[float, float, float, float]]:
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        import coverage_flatness
    finally:
        sys.path.pop(0)
    return coverage_flatness.coverage(shape, noise, points, DRAWS, seed=5)


@pytest.mark.parametrize(("shape", "noise"), CASES)
def test_the_intervals_hold_the_true_index_nineteen_times_in_twenty(shape: str, noise: str) -> None:
    found = faces(shape, noise, CASES[shape, noise])
    # fewer than this would be a chance of one in two thousand, were the coverage 95 %
    least = binom.ppf(1 / 2000, DRAWS, 0.95) / DRAWS
    assert {name: share for name, (share, *_) in found.items() if share < least} == {}
    pooled = np.mean([share for share, *_ in found.values()])
    assert pooled > 0.9


@pytest.mark.parametrize("name", ["xm", "fltt", "fltq"])
def test_the_intervals_are_short_beside_the_index_of_a_dome(name: str) -> None:
    _, half, true, error = faces("dome", "white, known", 20_000)[name]
    assert half < 0.06 * true
    assert abs(error) < half / 2


def test_squares_lose_what_a_disturbance_adds_to_them() -> None:
    growth = np.array([14.0, 18.0, 15.0, 17.0])
    middle, low, high = _of_mean(5.0, growth)
    assert middle == pytest.approx(3.0)
    assert low < middle < high
    assert _of_mean(3.0, growth)[:2] == (0.0, 0.0)


def test_an_extreme_loses_the_mean_of_what_it_grows_by_with_and_without_ties() -> None:
    plain, tied = np.array([0.5, 1.5, 1.0]), np.array([2.5, 3.5, 3.0])
    middle, low, high = _of_extreme(20.0, plain, tied)
    assert middle == pytest.approx(20.0 - (1.0 + 3.0) / 2)
    assert high - (20.0 - 1.0) == pytest.approx((20.0 - 3.0) - low)
    assert middle - low == pytest.approx(high - middle)
