"""Load tests by themselves: stiffness at the loaded points, and what a batch of nothing else lacks."""

import json

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.batch.capabilities import Stock
from metro.joint_columns import POSITIONS
from metro.observables.arm.description import needs as needs_of_calibration
from metro.observables.loads.description import needs
from metro.observables.loads.observable import observe

SPRING = np.array([[2.0, -0.3, 0.4], [-0.3, 0.8, 0.1], [0.4, 0.1, 1.25]])  # N/µm
BATCH = Batch("b", {}, {}, pd.DataFrame(), {})
MOVED = ["dx_mm", "dy_mm", "dz_mm"]


def pushed(spring, axes="xyz", noise_um=0.0, seed=0, **where):
    """Push a spring (3, 3) N/µm along ``axes``, twice by 100 and 200 N."""
    rng = np.random.default_rng(seed)
    rows = []
    for axis in axes:
        for size in (100.0, 200.0, -100.0, -200.0):
            force = size * np.eye(3)["xyz".index(axis)]
            moved = (np.linalg.solve(spring, force) + noise_um * rng.normal(size=3)) / 1e3
            rows.append(dict(zip(["fx_n", "fy_n", "fz_n", *MOVED], [*force, *moved], strict=True)) | where)
    columns = ["pose", "point", *POSITIONS, "x_mm", "y_mm", "z_mm"]
    table = pd.DataFrame(rows)
    for column in columns:
        if column not in table:
            table[column] = "" if column in ("pose", "point") else np.nan
    return table


def observed(*tables):
    return observe(BATCH, lambda _name, _run=None: pd.concat(tables, ignore_index=True))


def test_the_stiffness_along_an_axis_is_that_of_a_spring_free_across_it():
    tables, block = observed(pushed(SPRING, pose="A", point="P1"))
    row = tables["load_points"].iloc[0]
    # The tip is free across the push, so that what yields is the Schur complement of the other two axes.
    across = SPRING[0, 0] - SPRING[0, 1:] @ np.linalg.solve(SPRING[1:, 1:], SPRING[1:, 0])
    assert row["kx_n_um"] == pytest.approx(across)
    assert row["tests"] == 12
    assert row["force_n"] == 200.0
    entries = block["tip_compliance"]["A"]["P1"]
    assert set(entries) == {"xx", "xy", "xz", "yy", "yz", "zz"}


def test_intervals_hold_the_truth_as_often_as_they_say():
    """Three tests of one component leave two degrees of freedom: 1.96 standard errors would hold 81 %."""
    held = 0
    for seed in range(400):
        table = pushed(np.diag([1.0, 1.0, 1.0]), "z", 1.0, seed, pose="A", point="P").iloc[:3]
        table[["dx_mm", "dy_mm"]] = np.nan
        row = observed(table)[0]["load_points"].iloc[0]
        held += row["kz_low_n_um"] <= 1.0 <= row["kz_high_n_um"]
    assert 0.92 <= held / 400 <= 0.98


def test_an_axis_that_was_not_loaded_has_no_stiffness():
    tables, block = observed(pushed(SPRING, "z", pose="A", point="P"))
    row = tables["load_points"].iloc[0]
    assert np.isnan([row["kx_n_um"], row["ky_n_um"]]).all()
    assert row["kz_n_um"] == pytest.approx(1.0 / np.linalg.inv(SPRING)[2, 2])
    json.dumps(block, allow_nan=False)


def test_points_without_a_name_are_told_apart_by_their_place():
    here = pushed(SPRING, x_mm=10.0, y_mm=0.0, z_mm=0.0)
    there = pushed(2.0 * SPRING, x_mm=90.0, y_mm=0.0, z_mm=0.0)
    turned = pushed(3.0 * SPRING, x_mm=90.0, y_mm=0.0, z_mm=0.0, q1_deg=40.0, q2_deg=5.0)
    straight = [one.assign(q1_deg=0.0, q2_deg=5.0) for one in (here, there)]
    found = observed(*straight, turned)[0]["load_points"]
    assert list(found["pose"]) == ["(0, 5)", "(0, 5)", "(40, 5)"]
    assert list(found["point"]) == ["(10, 0, 0)", "(90, 0, 0)", "(90, 0, 0)"]
    np.testing.assert_allclose(found["ky_n_um"] / found["ky_n_um"].iloc[0], [1.0, 2.0, 3.0])


def test_no_load_tests_give_nothing():
    assert observed(pushed(SPRING).head(0)) == ({}, {})


def stock(loads, cell=None, manifest=None, **tables):
    empty = {name: pd.DataFrame() for name in ("touches", "payload")}
    return Stock(manifest or {}, cell or {}, pd.DataFrame(), {"loads": loads, **empty, **tables})


def test_what_load_tests_lack_for_the_joints_is_named():
    assert needs(stock(pushed(SPRING).head(0))) == ()
    (alone,) = needs(stock(pushed(SPRING)))
    assert alone.source == "12 load tests"
    assert alone.missing[1:] == (
        "arm.dh in cell.yaml", "tool_in_flange_mm in batch.yaml", "the joints' places (q1_deg …) in loads.csv"
    )  # fmt: skip
    joints = {f"q{i}_deg": 1.0 for i in range(1, 7)}
    arm, tip = {"arm": {"dh": [[0, 0, 1, 1]] * 6}}, {"tool_in_flange_mm": [0, 0, 1]}
    assert needs(stock(pushed(SPRING, **joints), arm, tip))[0].missing == ()


def test_touches_and_payloads_are_measurements():
    rows = pd.DataFrame({"loaded": ["no", "yes"]})
    assert needs_of_calibration(stock(rows.head(0))) == ()
    touched, weighed = needs_of_calibration(stock(rows.head(0), touches=rows, payload=rows))
    assert touched.source == "2 rows of touches.csv"
    assert (weighed.source, weighed.missing) == ("", ("arm.dh or arm.urdf in cell.yaml",))
