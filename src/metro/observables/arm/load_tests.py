"""Evidence on the joints without any cut: load tests, and the cell file for joints they do not identify."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.joint_columns import Axes
from metro.observables.arm.lack_of_fit import LackOfFit, directions, lack_of_fit
from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.setting import KnownParameters, LoadTest
from metro.observables.problem import Block, Refusal
from metro.robot import identifiability
from metro.robot.identifiability import Identifiability, NextLoad
from metro.robot.kinematics import FARTHEST_TIP, Arm, prismatic
from metro.robot.stiffness import Compliances, joint_compliances
from metro.units import MM, UM, Array

KNOWN = 0.02  # assumed relative uncertainty of joint stiffnesses that the cell file states without one
GAUGE = 0.1 * UM
TIP_STEP = 0.1  # m, scale of the search for the tip
LOAD_FORCE, MOVED = ["fx_n", "fy_n", "fz_n"], ["dx_mm", "dy_mm", "dz_mm"]


def usable(loads: pd.DataFrame, arm: Arm) -> pd.DataFrame:
    """Return the load tests that a model can use: with the place of every joint and the whole force."""
    return loads.dropna(subset=[*arm.axes.positions, *LOAD_FORCE]).reset_index(drop=True)


def joint_places(table: pd.DataFrame, arm: Arm) -> Array:
    """Return where the joints are in the rows of a table, (m, n) rad, or m of a linear axis."""
    return table[arm.axes.positions].to_numpy(dtype=float) * arm.axes.units


def calibration(
    batch: Batch, model: DeformationModel, loads: pd.DataFrame, beside: LackOfFit
) -> tuple[list[Block], tuple[str, ...]] | Refusal:
    """Gather the evidence on the joints: load tests, and the cell file for joints they do not identify.

    A joint without any evidence is taken as rigid; its uncertainty is the compliance of the softest joint.
    ``beside``: what the load tests show beside elastic joints.
    """
    known = batch.cell.get("joint_stiffness_nm_rad")
    tests = fitted_loads(model, loads)
    if isinstance(tests, Refusal):
        if known is None:
            return Refusal(f"{tests.reason}, and cell.yaml gives no joint_stiffness_nm_rad")
        value = 1.0 / np.asarray(known, dtype=float)
        note = f"Joint stiffnesses are those of the cell file, taken to be within {KNOWN:.0%}."
        return [_known_block(np.arange(len(value)), value, KNOWN * value)], (note,)
    sigma = max(beside.scatter, GAUGE) * _relative(loads)
    _, force, moved = _load_arrays(loads, model.arm)
    per_newton = beside.share * math.sqrt(np.nanmean(moved**2) / np.mean(np.sum(force**2, axis=1)))
    blocks = [
        _load_block(str(pose), loads.iloc[at], sigma[at], model.arm, per_newton)
        for pose, at in loads.groupby("pose", sort=False, dropna=False).indices.items()
    ]
    notes = [
        f"Load tests scatter by {tests.scatter / UM:.2g} µm about linear joints ({tests.dof} dof); "
        f"{100 * beside.share:.2g} % of the displacement is linear in the force, but not made by the joints."
    ]
    seen = joint_observability(model, loads)
    notes += [] if isinstance(seen, Refusal) else [in_words(*seen, model.arm.axes)]
    weak = np.flatnonzero(tests.sd > tests.value.max())
    if len(weak):
        names = ", ".join(str(i + 1) for i in weak)
        if known is None:
            value, sd = np.zeros(len(weak)), np.full(len(weak), tests.value.max())
            notes.append(
                f"The load tests do not determine joint {names}: taken as rigid, with the compliance of the "
                "softest joint as its uncertainty."
            )
        else:
            value = 1.0 / np.asarray(known, dtype=float)[weak]
            sd = KNOWN * value
            notes.append(
                f"The load tests do not determine joint {names}: its stiffness is taken from the cell file, "
                f"within {KNOWN:.0%}."
            )
        blocks.append(_known_block(weak, value, sd))
    return blocks, tuple(notes)


def best_compliance(batch: Batch, model: DeformationModel, loads: pd.DataFrame) -> Array:
    """Joint compliances (n,) before any cut: from the load tests, else the cell file, else of a rigid arm."""
    tests = fitted_loads(model, loads)
    if not isinstance(tests, Refusal):
        return tests.value
    known = batch.cell.get("joint_stiffness_nm_rad")
    return np.zeros(len(model.arm.dh)) if known is None else 1.0 / np.asarray(known, dtype=float)


def largest_loads(model: DeformationModel, loads: pd.DataFrame) -> Array:
    """Return the largest torque of the load tests on each joint, N m, (n,); (0,) where there is no test."""
    if loads.empty:
        return np.zeros(0)
    joints, force, _ = _load_arrays(loads, model.arm)
    return np.asarray(np.abs(model.torques(joints, force)).max(axis=0))


def fitted_loads(model: DeformationModel, loads: pd.DataFrame) -> Compliances | Refusal:
    """Joint compliances from the load tests alone."""
    if loads.empty:
        return Refusal("loads.csv has no test with joint angles and force")
    joints, force, moved = _load_arrays(loads, model.arm)
    try:
        return joint_compliances(model.contributions(joints, force), moved, _relative(loads))
    except ValueError as error:
        return Refusal(f"loads.csv: {error}")


def lacking(model: DeformationModel, loads: pd.DataFrame) -> LackOfFit:
    """Return what load tests show beside elastic joints; zero where they identify no joint."""
    return with_best_tip(model, loads)[1]


def with_best_tip(model: DeformationModel, loads: pd.DataFrame) -> tuple[DeformationModel, LackOfFit]:
    """Return the model with the tip where load tests put it, and what they show beside its joints.

    A tip that is not where it is declared is no lack of elastic joints, but makes one of tenths of the
    displacement. It would hide itself and all else there. The tip is as declared where that shows no more
    beside the joints, or as much for the parameters that another tip takes.
    """
    declared = _lacking(model, loads, 0)
    if declared.share == 0.0:
        return model, declared
    elsewhere = _at_best_tip(model, loads)
    moved = _lacking(elsewhere, loads, len(model.arm.tool))
    return (elsewhere, moved) if moved.share < declared.share else (model, declared)


def _lacking(model: DeformationModel, loads: pd.DataFrame, more: int) -> LackOfFit:
    """Return what load tests show beside the joints of a model with ``more`` fitted parameters than these."""
    tests = fitted_loads(model, loads)
    if isinstance(tests, Refusal):
        return LackOfFit(0.0, 0.0)
    joints, force, moved = _load_arrays(loads, model.arm)
    relative = _relative(loads)
    residual = moved - model.contributions(joints, force) @ tests.value
    unknowns = int(tests.seen.sum()) + more
    return lack_of_fit(_poses(loads), force, residual / relative, moved / relative, unknowns)


def _at_best_tip(model: DeformationModel, loads: pd.DataFrame) -> DeformationModel:
    """Return the model with the tip that the load tests fit best, as far away as it may be."""
    from scipy.optimize import least_squares

    joints, force, moved = _load_arrays(loads, model.arm)
    measured, relative = np.isfinite(moved), _relative(loads)

    def at(offset: Array) -> DeformationModel:
        return replace(model, arm=model.arm.with_tip_moved(offset))

    def residual(offset: Array) -> Array:
        tip = at(offset)
        tests = fitted_loads(tip, loads)
        known = 0.0 if isinstance(tests, Refusal) else tip.contributions(joints, force) @ tests.value
        return np.asarray(((moved - known) / relative)[measured])

    bounds = (-FARTHEST_TIP, FARTHEST_TIP)
    return at(least_squares(residual, np.zeros(3), bounds=bounds, x_scale=TIP_STEP).x)


def _poses(loads: pd.DataFrame) -> list[np.ndarray]:
    return [np.asarray(at) for at in loads.groupby("pose", sort=False, dropna=False).indices.values()]


def joint_observability(
    model: DeformationModel, loads: pd.DataFrame
) -> tuple[Identifiability, NextLoad] | Refusal:
    """Return how well the load tests identify each joint, and the test that is best for the worst joint.

    The next test has the largest force so far, in a pose of the tests or with one joint turned by 30° (a
    linear axis shifted by half a metre) from it. A joint that no test sees is taken to be as soft as the
    softest, a linear axis as a joint with a lever of one metre.
    """
    tests = fitted_loads(model, loads)
    if isinstance(tests, Refusal):
        return tests
    joints, force, moved = _load_arrays(loads, model.arm)
    softest = float(tests.value.max())
    size = np.where(tests.value > 0.01 * softest, tests.value, softest)
    sigma = max(tests.scatter, GAUGE)
    rows = model.contributions(joints, force)
    matrix = identifiability.information(rows, np.isfinite(moved), sigma * _relative(loads), size)
    newton = float(np.linalg.norm(force, axis=1).max())
    poses = identifiability.around(np.unique(joints, axis=0), prismatic(model.arm.dh))
    return identifiability.assess(matrix), identifiability.next_load(
        model.arm, matrix, poses, newton=newton, sigma=sigma, size=size
    )


def in_words(joints: Identifiability, load: NextLoad, axes: Axes) -> str:
    """Describe how well load tests identify the joints, and which load to apply next."""
    unseen = [str(i + 1) for i in np.flatnonzero(~np.isfinite(joints.relative))]
    if unseen:
        known = f"The load tests do not see joint {', '.join(unseen)} apart from the others."
    else:
        known = (
            f"The load tests determine the stiffness of every joint; joint {joints.worst + 1} is the least "
            f"certain, to {100 * joints.relative[joints.worst]:.2g} %."
        )
    places = [f"{value:.0f}" for value in load.joints / axes.units]
    turning = f"({', '.join(places[place] for place in axes.turning)})°"
    shifted = [f"axis {i + 1} at {place} mm" for i, place in enumerate(places) if axes.linear[i]]
    pull = ", ".join(f"{value:.0f}" for value in load.force)
    return (
        f"{known} A load of ({pull}) N on the tip in the pose {', '.join([turning, *shifted])} would "
        f"determine joint {load.joint + 1} "
        f"to {100 * load.after:.2g} %."
    )


def _load_arrays(loads: pd.DataFrame, arm: Arm) -> tuple[Array, Array, Array]:
    force, moved = (loads[names].to_numpy(dtype=float) for names in (LOAD_FORCE, MOVED))
    return joint_places(loads, arm), force, moved * MM


def _relative(loads: pd.DataFrame) -> Array:
    """Size of the error of each test's readings relative to the mean, (m, 1), as ``sigma_mm`` says.

    A test whose error is not stated is taken to be as good as the average of the others.
    """
    if "sigma_mm" not in loads or loads["sigma_mm"].isna().all():
        return np.ones((len(loads), 1))
    stated = loads["sigma_mm"].to_numpy(dtype=float)
    return np.asarray(np.where(np.isfinite(stated), stated / np.nanmean(stated), 1.0)[:, None])


def _load_block(pose: str, loads: pd.DataFrame, sigma: Array, arm: Arm, per_newton: float) -> Block:
    """Return the tests of one pose; ``per_newton``: deviation of the tip's compliance beside the joints."""
    joints, force, moved = _load_arrays(loads, arm)
    measured = np.isfinite(moved)
    axis = np.broadcast_to(["load x", "load y", "load z"], moved.shape)[measured]
    name = f"load tests {pose}"
    block = _evidence(
        name,
        moved[measured],
        np.broadcast_to(sigma, moved.shape)[measured],
        LoadTest(joints, force, measured),
        axis,
    )
    return replace(block, unidentified=directions(force, measured, per_newton))


def _known_block(joints: np.ndarray, value: Array, sd: Array) -> Block:
    axis = np.array([f"joint {i + 1}" for i in joints])
    return _evidence("known joints", value, sd, KnownParameters(joints), axis)


def _evidence(
    name: str, measured: Array, sigma: Array, setting: LoadTest | KnownParameters, axis: np.ndarray
) -> Block:
    """Return a block that calibrates: it belongs to no cut, has no zeros, and is never compared."""
    zeros = np.zeros((len(measured), 0))
    return Block(name, name, "calibrate", 0, measured, sigma, setting, axis, zeros, np.zeros(0), {})
