"""What captions say of their figures: numbers that one can compute by hand."""

import pandas as pd
import pytest

from metro.report.figures.verdicts import Change
from metro.report.sections import findings


def compared(after, measured=(3.0, -4.0, 3.0, -4.0), before=(0.0, 0.0, 0.0, 0.0)):
    rows = {"measured": measured, "before": before, "after": after, "sigma": 0.5}
    return pd.DataFrame({**rows, "run": ["a", "a", "b", "b"], "axis": ["x", "y"] * 2, "unit": "N"})


def change(label, before, after):
    return Change(label, before, after, None, None, None)


def test_what_is_left_is_the_rms_of_the_rest_with_and_without_effects():
    alone = findings.left(compared((0.0,) * 4))
    assert alone == "The error of the base model is 3.54 N rms, for a measured signal of 3.54 N rms."
    both = findings.left(compared((2.0, -3.0, 3.0, -4.0)))
    assert both.endswith("and 0.707 N with the effects found, for a measured signal of 3.54 N rms.")


def test_the_run_that_is_missed_most_is_told_by_its_own_values():
    told = findings.missed(compared((2.0, -3.0, 3.0, -4.0)), "b")
    assert told.startswith("Held-out run b has the largest error of the base model: 3.54 N rms")
    assert "and 0 N with the effects found" in told


def test_offsets_are_means_by_axis_to_the_digits_of_the_rest():
    assert "base model x 3.0, y −4.0 N;" in findings.offsets(compared((3.0, -4.0, 3.0, -4.0)))


def test_differences_are_put_beside_those_of_noise_alone():
    assert (
        "within 4.00 N of the base model; with noise alone they would lie within 0.980 N"
        in findings.scatter(compared((0.0,) * 4))
    )


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ([("a", 8.0, 2.0)], "falls from 8.0 % to 2.0 % of the signal"),
        ([("a", 8.0, 8.0)], "8.0 % of the signal; no effect was added"),
        ([("a", 8.0, 7.99)], "does not fall; it is 8.0 % of the signal"),
        ([("a", 8.0, 2.0), ("b", 5.0, 4.99)], "fall in 1 of 2 cases"),
        ([("a", 8.0, 2.0), ("b", 5.0, 5.0)], "fall in 1 of 2 cases; the largest remaining error is 5.0 %"),
        ([("a", 8.0, 8.0), ("b", 5.0, 5.0)], "No effect was added"),
    ],
)
def test_errors_before_and_after_are_told_in_a_sentence(rows, told):
    assert told in findings.changed([change(*row) for row in rows])


def test_runs_above_the_noise_floor_are_counted_and_the_worst_is_named():
    blocks = [
        {"run": name, "rms_before": rest, "rms_after": None}
        for name, rest in zip("abc", (1, 3, 2), strict=True)
    ]
    assert (
        findings.above_floor(blocks, 2.5, "N")
        == "1 of 3 runs exceeds the noise floor, as up to half of them do where nothing is missing; "
        "b has the largest residual, 3.00 N."
    )
    assert findings.above_floor(blocks, 9.0, "N").startswith("None of 3 runs exceeds")


def test_the_order_and_the_tooth_that_are_missed_most_are_named():
    orders = pd.DataFrame({"order": [0, 3], "axis": ["x", "z"], "after": [0.1, 0.4], "measured": [9.0, 8.0]})
    assert "at order 3 along z: 0.400 N, for 8.00 N" in findings.peak_order(orders)
    peaks = pd.DataFrame(
        {"model": "before", "percent": [1.0, -5.0, 2.0], "run": ["a", "b", "c"], "axis": "y"}
    )
    assert "2.0 % in the median, 5.0 % at worst (b, y)" in findings.tooth_peaks(peaks)


def test_the_worst_speed_of_a_stability_boundary_is_told():
    boundary = pd.DataFrame({"rpm": [1000.0, 2000.0], "depth_mm": [0.5, 0.2]})
    told = findings.lowest_boundary(boundary, [("depth_mm", "")])
    assert "up to 0.200 mm (reached at 2000 rpm, the end of the computed speeds)" in told
    within = pd.DataFrame({"rpm": [1000.0, 2000.0, 3000.0], "depth_mm": [0.5, 0.2, 0.6]})
    assert "up to 0.200 mm (reached at 2000 rpm)." in findings.lowest_boundary(within, [("depth_mm", "")])
