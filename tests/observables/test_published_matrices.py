"""Printed matrices of a tip against the damping coefficients printed with them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.observables.published.matrices import matrices

TABLE = Path(__file__).parents[2] / "data/raw/irb6640-published/published.csv"


@pytest.fixture
def published() -> pd.DataFrame:
    return pd.read_csv(TABLE, dtype={"table": str, "row": str})


def test_the_printed_a1_is_an_erratum_of_both_wrists(published: pd.DataFrame) -> None:
    found = matrices(published).set_index("row")
    assert found.loc["P25 A", ["a0", "a1"]].tolist() == pytest.approx([0.9228, 0.00209], abs=5e-5)
    assert found.loc["P25 B", ["a0", "a1"]].tolist() == pytest.approx([0.9188, 0.00210], abs=5e-5)
    assert (found["missed_percent"] < 0.2).all()
    assert (found["printed_missed_percent"] > 10).all()
    for flag in found["flag"]:
        assert "a1 0.0024 miss" in flag
        assert "0.0021" in flag or "0.00209" in flag


def test_coefficients_that_fit_or_that_are_not_printed_are_no_erratum(published: pd.DataFrame) -> None:
    right = published.copy()
    right.loc[right["quantity"] == "a1", "measured"] = 0.0021
    assert (matrices(right)["flag"] == "").all()
    unsaid = matrices(published[~published["quantity"].isin(["a0", "a1"])])
    assert (unsaid["flag"] == "").all()
    assert np.isnan(unsaid["a1_printed"]).all()


def test_a_printed_matrix_that_no_structure_has_is_flagged(published: pd.DataFrame) -> None:
    wrong = published.copy()
    wrong.loc[(wrong["quantity"] == "mass matrix") & (wrong["axis"] == "zz"), "measured"] = 200.0
    assert matrices(wrong)["flag"].str.contains("mass matrix is not positive definite").all()


def test_a_batch_that_prints_no_matrices_has_none(published: pd.DataFrame) -> None:
    assert matrices(published[published["table"] != "3.1"]).empty
