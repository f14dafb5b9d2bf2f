"""Errors along a path: windows by hand, the bound between the means, and the printed table 6 of [F]."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.surface.along_path import WINDOW, errors_along, passes_of, running_mean
from metro.surface.pairing import indices_of

PUBLISHED = Path(__file__).parents[2] / "data/raw/irb6640-published/published.csv"


def test_a_running_mean_is_that_of_the_points_that_are_there():
    values = np.array([1.0, 2.0, 6.0, 3.0, 8.0, 4.0])
    by_hand = [np.mean(values[max(0, i - 2) : i + 3]) for i in range(6)]
    assert running_mean(values, 5) == pytest.approx(by_hand)
    assert running_mean(values, 1) == pytest.approx(values)


def test_of_the_printed_points_the_geometric_error_is_never_above_the_arithmetic_one():
    table = pd.read_csv(PUBLISHED, dtype={"table": str}).query("table == '6'")
    for column in ("measured", "predicted"):
        deviations = table[column].to_numpy()
        found = errors_along(deviations, 1e-3)
        assert found["absolute"] == pytest.approx(np.abs(deviations))
        assert (found["geometric"] <= found["arithmetic"] + 1e-15).all()
        # where the window is the whole path, both are X_a and X_g of these points
        whole = errors_along(deviations, 1e-3, window=2 * len(deviations) + 1)
        _, xa, xg = indices_of(deviations, 1e-3)
        assert whole["arithmetic"] == pytest.approx(xa)
        assert whole["geometric"] == pytest.approx(xg)
    assert WINDOW == 5
    assert errors_along(np.array([0.4, 0.1, 0.1, 0.1, 0.1]), 0.0)["geometric"][2] == pytest.approx(
        (0.4 * 0.1**4) ** 0.2
    )


def test_a_deviation_of_zero_does_not_make_the_geometric_error_zero():
    found = errors_along(np.array([0.01, 0.0, 0.01]), 1e-3)
    assert 0.0 < found["geometric"][1] < found["arithmetic"][1]


def test_passes_are_told_by_the_way_between_them():
    along = np.arange(0.0, 40.0, 2.0)
    place = np.concatenate([np.column_stack([along, np.full(20, y)]) for y in (0.0, 10.0, 20.0)])
    assert [len(rows) for rows in passes_of(place)] == [20, 20, 20]
    assert [rows.tolist() for rows in passes_of(place[:1])] == [[0]]
