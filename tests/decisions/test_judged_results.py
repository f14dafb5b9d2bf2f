"""Which results a tolerance is applied to, and the peak force of a record with its uncertainty."""

import numpy as np
import pandas as pd
import pytest

from metro.decisions.results import decisions, peak_forces


def q(value, half, unit="um"):
    return {"value": value, "ci95": [value - half, value + half], "unit": unit}


def orders(run, x, y, variance=0.0, blocks=2):
    """Table of the orders of a run: ``x``, ``y`` are mean, cosine, sine, … divided by √2 as stored."""
    parts = ["mean", "cosine", "sine"]
    rows = [
        {"run": run, "block": b, "axis": a, "order": (i + 1) // 2, "part": parts[0 if i == 0 else 2 - i % 2],
         "force_n": f, "variance_n2": variance}
        for b in range(blocks) for a, values in (("x", x), ("y", y), ("z", [0.0] * len(x)))
        for i, f in enumerate(values)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def test_the_peak_is_that_of_the_resultant_in_the_plane():
    """x = 30 + 10 cos α, y = 40: at α = 0 the resultant is hypot(40, 40)."""
    table = orders("r1", [30.0, 10.0 / np.sqrt(2.0), 0.0], [40.0, 0.0, 0.0])
    ((where, result),) = peak_forces(table, 0.0)
    assert (where, result.value) == ("r1", pytest.approx(np.hypot(40.0, 40.0)))
    assert result.high == pytest.approx(result.value)


def test_its_uncertainty_is_that_of_the_average_and_of_the_calibration():
    """Variance at an angle: of the mean, and 2 (cos² + sin²) of each order; the blocks are averaged."""
    table = orders("r1", [300.0, 0.0, 0.0], [0.0, 0.0, 0.0], variance=4.0)
    ((_, own),) = peak_forces(table, 0.0)
    assert own.high - own.value == pytest.approx(1.96 * np.sqrt((4.0 + 2.0 * 4.0) / 2.0), rel=1e-3)
    ((_, both),) = peak_forces(table, 0.02)
    assert both.high - both.value == pytest.approx(np.hypot(own.high - own.value, 6.0), rel=1e-6)


IDENTIFIED = {
    "faces": {
        "f1": {"minimum_zone": q(60.0, 3.0), "noise_corrected": {"minimum_zone": q(44.0, 3.0)}},
        "f2": {"minimum_zone": q(60.0, 3.0)},
        "f3": {},
    },
    "texture": {"r1": {"Ra": q(1.2, 0.1), "Rz": q(6.0, 1.0)}, "r2": {"Ra": {"value": None, "ci95": None}}},
    "arm": {"walls": {"r1": {"measured": q(0.231, 0.01, "mm")}}},
    "lobes": [{"position": 1, "lowest_mm": q(0.3, 0.05, "mm")}],
}


def judged(tolerances, **manifest):
    return decisions({"tolerances": tolerances, **manifest}, IDENTIFIED, pd.DataFrame())


def test_a_face_is_judged_without_the_share_of_the_noise_where_that_is_known():
    first, second = judged({"flatness_um": {"upper": 50.0}})
    assert (first["where"], first["value"], first["decision"]) == ("f1", 44.0, "conforms")
    assert (second["value"], second["decision"], second["unit"]) == (60.0, "does_not_conform", "um")


def test_a_wall_is_judged_in_micrometres():
    (wall,) = judged({"wall_error_um": {"lower": -50.0, "upper": 235.0}})
    assert wall["value"] == pytest.approx(231.0)
    assert wall["ci95"] == pytest.approx([221.0, 241.0])
    assert (wall["decision"], wall["quantity"]) == ("undecided", "wall_error")


def test_roughness_and_depth_are_judged_where_they_have_a_value():
    ra, rz, depth = judged(
        {"ra_um": {"upper": 1.6}, "rz_um": {"upper": 6.3}, "stable_depth_mm": {"lower": 0.2}}
    )
    assert [each["decision"] for each in (ra, rz, depth)] == ["conforms", "undecided", "conforms"]
    assert (depth["where"], depth["unit"]) == ("position 1", "mm")


def test_a_tolerance_without_any_result_is_undecided_and_said():
    (force,) = judged({"force_n": {"upper": 500.0}})
    assert (force["decision"], force["value"], force["where"], force["unit"]) == (
        "undecided",
        None,
        None,
        "N",
    )
