"""Load tests in the report: every point, with a dash where nothing was loaded."""

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.report.results import Results
from metro.report.sections.loads import load_points

BATCH = Batch("b", {}, {}, pd.DataFrame(), {})


def point(pose, name, kx, ky, kz):
    row = {"pose": pose, "point": name, "tests": 6, "force_n": 200.0, "scatter_um": 1.25}
    for axis, k in zip("xyz", (kx, ky, kz), strict=True):
        row |= {f"k{axis}_n_um": k, f"k{axis}_low_n_um": 0.98 * k, f"k{axis}_high_n_um": 1.02 * k}
    return row


def results(*points):
    tables = {"load_points": pd.DataFrame(list(points))} if points else {}
    return Results(BATCH, tables, {}, {}, {})


def test_every_point_has_a_row_and_a_dash_where_nothing_was_loaded():
    _, table = load_points(results(point("A", "P1", 2.0, np.nan, 1.0), point("", "", 2.0, 0.5, 3.0)))
    assert [row[0] for row in table.rows] == ["A, P1", "not named"]
    assert table.rows[0][3:6] == ["2.000 ± 0.040", "–", "1.000 ± 0.020"]


def test_nothing_is_said_without_load_tests():
    assert load_points(results()) == []
