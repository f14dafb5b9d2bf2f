"""Load tests in any shape: blanks, repeats, stated errors, joints that they do not see."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.arm.load_tests import (
    calibration,
    fitted_loads,
    in_words,
    joint_observability,
    lacking,
    usable,
)
from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.setting import LoadTest
from metro.observables.problem import Refusal
from metro.robot.kinematics import arm_of_cell
from metro.units import DEG, MM

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
ARM = arm_of_cell({"arm": {"dh": DH}}, {"tool_in_flange_mm": [212.5, 0.0, 279.91]})
MODEL = DeformationModel(ARM)
STIFFNESS = np.array([1.8e6, 2.1e6, 1.3e6, 3.1e5, 3.9e5, 2.3e5])
NEAR = np.radians([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7])
MOVED = ["dx_mm", "dy_mm", "dz_mm"]
FORCES = ["fx_n", "fy_n", "fz_n"]
QS = [f"q{i}_deg" for i in range(1, 7)]


def table(sigma_mm, poses=5, replicates=2, seed=0, *, arm=ARM, link=0.0):
    """Loads along every axis both ways; each row's readings scatter by its own ``sigma_mm`` of the cycle.

    ``arm``: with its tip where it is. ``link``: of a link that bends, m/N: in each pose the tip gives way by
    a compliance of its own, symmetric and positive, beside that of the joints.
    """
    rng = np.random.default_rng(seed)
    rows = []
    for pose, q in enumerate(NEAR + rng.uniform(-0.5, 0.5, (poses, 6))):
        step = 1e-6
        moves = np.stack(
            [(arm.tip(q + step * e) - arm.tip(q - step * e)) / (2 * step) for e in np.eye(6)], axis=-1
        )
        root = rng.normal(size=(3, 3))
        bent = link * root @ root.T
        for force in 400 * np.vstack([np.eye(3), -np.eye(3)]):
            for replicate in range(1, replicates + 1):
                sigma = sigma_mm[len(rows) % len(sigma_mm)]
                given = moves @ ((moves.T @ force) / STIFFNESS) + bent @ force
                moved = given / MM + sigma * rng.normal(size=3)
                rows.append([f"p{pose}", *(q / DEG), *force, *moved, replicate, sigma])
    names = ["pose", *QS, *FORCES, *MOVED, "replicate"]
    return pd.DataFrame(rows, columns=[*names, "sigma_mm"])


def batch(**cell):
    return Batch("b", {}, {"cell": "kr", "arm": {"dh": DH}, **cell}, pd.DataFrame(), {})


@pytest.mark.parametrize("kept", [("dx_mm",), ("dy_mm", "dz_mm"), ("dy_mm",), tuple(MOVED)])
def test_any_components_of_the_displacement_tell_the_joints(kept):
    loads = table([0.002])
    loads[[name for name in MOVED if name not in kept]] = np.nan
    found = fitted_loads(MODEL, loads)
    assert found.seen.all()
    assert (np.abs(found.value - 1 / STIFFNESS) < 4 * found.sd).all()
    blocks, _ = calibration(batch(), MODEL, loads, lacking(MODEL, loads))
    assert sum(len(block.measured) for block in blocks) == len(kept) * len(loads)


def test_blanks_that_differ_from_row_to_row_leave_the_other_readings():
    loads = table([0.002])
    for i in range(len(loads)):
        loads.loc[i, MOVED[i % 3]] = np.nan
    blocks, _ = calibration(batch(), MODEL, loads, lacking(MODEL, loads))
    for block in blocks:
        setting: LoadTest = block.setting
        assert len(block.measured) == setting.measured.sum() == 2 * len(setting.force)
        predicted, _ = MODEL.design(block, np.zeros(0))
        np.testing.assert_allclose(predicted @ (1 / STIFFNESS), block.measured, atol=2e-5)


def test_repeats_narrow_the_interval_by_their_root():
    once, often = (fitted_loads(MODEL, table([0.004], replicates=n, seed=2)) for n in (2, 18))
    np.testing.assert_allclose(often.sd / once.sd, 1 / 3, rtol=0.25)


def test_readings_with_a_larger_stated_error_weigh_less():
    """Half of the readings are twenty times worse; told so, the fit is nearly that of the good half alone."""
    sigma = [0.002, 0.04]
    errors = {"told": [], "not told": [], "good half": []}
    for seed in range(12):
        loads = table(sigma, seed=seed)
        variants = {
            "told": loads,
            "not told": loads.drop(columns="sigma_mm"),
            "good half": loads[loads["sigma_mm"] < 0.01],
        }
        for name, rows in variants.items():
            errors[name].append(fitted_loads(MODEL, rows).value * STIFFNESS - 1)
    rms = {name: np.sqrt(np.mean(np.square(values))) for name, values in errors.items()}
    assert rms["told"] < 0.4 * rms["not told"]
    assert rms["told"] == pytest.approx(rms["good half"], rel=0.25)
    loads = table(sigma)
    blocks, _ = calibration(batch(), MODEL, loads, lacking(MODEL, loads))
    ratio = [block.sigma.max() / block.sigma.min() for block in blocks]
    np.testing.assert_allclose(ratio, 20.0)


def test_a_blank_error_is_that_of_the_average_reading():
    loads = table([0.004])
    loads.loc[::3, "sigma_mm"] = np.nan
    np.testing.assert_allclose(
        fitted_loads(MODEL, loads).value, fitted_loads(MODEL, loads.drop(columns="sigma_mm")).value
    )


def test_the_interval_holds_the_truth_as_often_as_it_says():
    inside = []
    for seed in range(60):
        found = fitted_loads(MODEL, table([0.003], poses=4, replicates=1, seed=seed))
        inside.append(np.abs(found.value - 1 / STIFFNESS) < 1.96 * found.sd)
    assert 0.90 < np.mean(inside) < 0.985


def test_what_the_loads_do_not_see_is_named_with_the_load_that_would():
    """Joint 1 turns about the vertical: readings of the height alone do not see it."""
    loads = table([0.002])
    loads[["dx_mm", "dy_mm"]] = np.nan
    told, load = joint_observability(MODEL, loads)
    assert np.isinf(told.relative).tolist() == [True] + [False] * 5
    assert load.joint == 0
    assert load.before == pytest.approx(1.0)
    assert load.after < 0.05
    sentence = in_words(told, load, MODEL.arm.axes)
    assert "do not see joint 1 " in sentence
    assert "would determine joint 1 to" in sentence


def test_loads_that_tell_every_joint_name_the_one_they_tell_least():
    loads = table([0.003], seed=4)
    told, load = joint_observability(MODEL, loads)
    found = fitted_loads(MODEL, loads)
    np.testing.assert_allclose(told.relative, found.sd / found.value, rtol=1e-6)
    assert load.joint == told.worst
    assert f"joint {told.worst + 1} is the least certain" in in_words(told, load, MODEL.arm.axes)
    blocks, notes = calibration(batch(), MODEL, loads, lacking(MODEL, loads))
    assert in_words(told, load, MODEL.arm.axes) in notes
    assert len(blocks) == 5


def test_no_usable_load_is_a_refusal_with_its_reason():
    loads = table([0.002]).assign(q3_deg=np.nan)
    refused = joint_observability(MODEL, usable(loads, MODEL.arm))
    assert isinstance(refused, Refusal)
    assert "loads.csv" in refused.reason


def missed(loads):
    """Residual of the joints with the declared tip, m."""
    joints, force, moved = (loads[names].to_numpy() for names in (QS, FORCES, MOVED))
    known = MODEL.contributions(joints * DEG, force) @ fitted_loads(MODEL, loads).value
    return np.linalg.norm(moved * MM - known)


FAR = np.array([-0.35, 0.08, 0.1])  # the row of another tool


@pytest.mark.parametrize("offset", [FAR, -FAR, FAR[[1, 2, 0]], np.array([0.0, 0.0, -0.28])])
def test_a_tip_that_is_elsewhere_is_no_lack_of_elastic_joints(offset):
    """The levers of the joints are others; where the tip is, the joints explain the tests to their noise."""
    right, wrong = (table([0.003], seed=3, arm=arm) for arm in (ARM, ARM.with_tip_moved(offset)))
    assert lacking(MODEL, wrong).share == pytest.approx(lacking(MODEL, right).share, abs=0.01)
    assert missed(wrong) > 3.0 * missed(right)  # as declared


@pytest.mark.parametrize("seed", range(6))
def test_links_that_bend_stay_a_lack_of_elastic_joints(seed):
    """No tip makes the compliance of links, another in each pose: it takes a part of it at most."""
    rigid, bending = (table([0.003], poses=6, seed=seed, link=link) for link in (0.0, 1e-7))
    made = bending[MOVED].to_numpy() - rigid[MOVED].to_numpy()
    true = np.sqrt(np.mean(made**2) / np.mean(bending[MOVED].to_numpy() ** 2))
    assert 0.5 * true < lacking(MODEL, bending).share < 1.1 * true
