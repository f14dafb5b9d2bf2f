"""What the KR160 paper prints of forces (table 7) and deformations (table 8), as numbers and errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.observables.published.observable import errors

FILE = Path(__file__).parents[2] / "data" / "raw" / "kr160-published" / "published.csv"
FORCES = {
    "test 1": [(45.96, 56.21), (-96.10, -84.73), (-18.21, -33.89)],
    "test 2": [(78.125, 102.71), (-176.50, -157.15), (-34.71, -54.66)],
    "test 3": [(150.75, 127.13), (-266.83, -223.07), (-51.65, -89.23)],
}
WALLS = {"test 4": (0.203, 0.182), "test 5": (0.206, 0.192), "test 6": (0.175, 0.194)}
PRINTED = {
    "7": [22.3, 11.83, 86.11, 31.47, 10.96, 57.5, 15.67, 16.40, 72.76],
    "8": [10.35, 6.80, 10.86],
}


@pytest.fixture(scope="module")
def table():
    return errors(pd.read_csv(FILE, dtype={"table": str, "row": str}))


def test_forces_and_deformations_are_those_of_the_print(table):
    force = table[table["table"] == "7"]
    for test, pairs in FORCES.items():
        rows = force[force["row"] == test]
        assert list(rows["axis"]) == ["x", "y", "z"]
        assert list(zip(rows["measured"], rows["predicted"], strict=True)) == pairs
    wall = table[table["table"] == "8"].set_index("row")
    found = zip(wall["measured"], wall["predicted"], strict=True)
    assert dict(zip(wall.index, found, strict=True)) == WALLS


@pytest.mark.parametrize("name", ["7", "8"])
def test_the_printed_errors_follow_from_the_printed_pairs(table, name):
    """Over the measured value, without a sign; to the rounding of the print."""
    rows = table[table["table"] == name]
    assert list(rows["printed_error_percent"]) == PRINTED[name]
    assert rows["of_measured_percent"].abs().to_numpy() == pytest.approx(PRINTED[name], abs=0.03)
    assert (rows["flag"] == "").all()


def test_the_estimate_of_the_print_is_off_by_twenty_newtons_always_the_same_way_in_z(table):
    """The yardstick of this package's own sensorless force: 10 to 44 N, 22.9 N on average."""
    force = table[table["table"] == "7"]
    off = (force["predicted"] - force["measured"]).to_numpy().reshape(3, 3)
    assert np.abs(off).min() == pytest.approx(10.25)
    assert np.abs(off).max() == pytest.approx(43.76)
    assert np.abs(off).mean() == pytest.approx(22.905)
    assert (off[:, 1] > 0).all()
    assert (off[:, 2] < 0).all()
    assert sorted(np.sign(off[:, 0])) == [-1, 1, 1]


def test_the_errata_of_the_equations_are_stated(table):
    told = " ".join(table["note"][table["note"].str.contains("erratum: ")])
    assert "eq. 2 " in told
    assert "eq. 13 " in told
