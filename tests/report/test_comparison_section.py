"""Predicted against measured: the table of errors."""

import numpy as np
import pandas as pd
import pytest

from metro.report.sections.comparison import errors


def frame(after):
    measured = np.array([3.0, -3.0, 4.0, -4.0])
    return pd.DataFrame(
        {"run": ["r1", "r1", "r2", "r2"], "axis": "x", "unit": "N", "measured": measured,
         "before": measured + 1.0, "after": measured + np.asarray(after)}
    )  # fmt: skip


def test_where_effects_were_added_both_errors_and_the_gain_are_given():
    table = errors(frame([0.5, 0.5, 0.25, 0.25]))
    assert table.header == ["run", "axis", "measured", "base model", "with effects", "gain", "values"]
    assert table.rows == [
        ["r1", "x", "3.00", "1.00", "0.500", "50 %", "2"],
        ["r2", "x", "4.00", "1.00", "0.250", "75 %", "2"],
    ]


def test_where_nothing_was_added_there_is_one_error():
    table = errors(frame([1.0, 1.0, 1.0, 1.0]))
    assert table.header == ["run", "axis", "measured", "base model (nothing added)", "values"]
    assert table.rows[1] == ["r2", "x", "4.00", "1.00", "2"]


@pytest.mark.parametrize("after", [[0.5] * 4, [1.0] * 4])
def test_every_column_has_its_width_and_numbers_are_to_the_right(after):
    table = errors(frame(after))
    assert len(table.widths) == len(table.header) == len(table.rows[0])
    assert table.numeric == list(range(2, len(table.header)))
