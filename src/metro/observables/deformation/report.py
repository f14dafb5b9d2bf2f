"""Report on an elastic arm: stiffnesses, how well the load tests identify them, deformation per run."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.joint_columns import Axes
from metro.observables.arm.force_by_torques import gain_errors
from metro.observables.arm.load_tests import fitted_loads, in_words, joint_observability
from metro.observables.arm.tip_force import FORCE
from metro.observables.arm.wall import Wall, wall
from metro.observables.deformation.blocks import ZERO
from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.setting import CutWall
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.robot.kinematics import arm_of_cell
from metro.robot.statics import deflections
from metro.units import JSON, MM, Array


def arm_block(
    batch: Batch, observed: Mapping[str, pd.DataFrame], task: Problem | Refusal, fit: BaseFit | None
) -> JSON:
    """Return the ``arm`` block of identified.json.

    Joint stiffnesses come from the fit, or from the load tests alone if no wall could be compared.
    """
    lacking: dict[str, str] = {}
    block: JSON = {}
    stiffness = _stiffness(batch, observed, fit)
    if isinstance(stiffness, Refusal):
        lacking["joint_stiffness"] = stiffness.reason
    else:
        block["joint_stiffness"] = stiffness
    seen = _joint_observability(batch, observed)
    if isinstance(seen, Refusal):
        lacking["joint_observability"] = seen.reason
    else:
        block["joint_observability"] = seen
    if "observability" in observed:
        groups = observed["observability"].groupby("run", sort=False)
        block["observability"] = {run: [float(value) for value in rows["index"]] for run, rows in groups}
    if isinstance(task, Problem) and isinstance(task.base, DeformationModel) and fit is not None:
        model = task.base
        walls = [one for one in task.blocks if isinstance(one.setting, CutWall)]
        block["deformation"] = {one.run: _deformation(model, one.setting, fit) for one in walls}
        block["walls"] = {one.run: wall_figures(model, one, fit) for one in walls}
    else:
        lacking["deformation"] = task.reason if isinstance(task, Refusal) else "no run to fit"
    return {**block, "not_identified": lacking}


def _joint_observability(batch: Batch, observed: Mapping[str, pd.DataFrame]) -> JSON | Refusal:
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal("no arm.dh")
    seen = joint_observability(DeformationModel(arm), observed["arm_loads"])
    if isinstance(seen, Refusal):
        return seen
    identifiability, load = seen
    relative = [float(value) if np.isfinite(value) else None for value in identifiability.relative]
    return {
        "relative_sd": relative,
        "worst_joint": identifiability.worst + 1,
        "condition": identifiability.condition if np.isfinite(identifiability.condition) else None,
        "unseen": identifiability.unseen.tolist(),
        "next_load": {
            "joint": load.joint + 1,
            **_pose(load.joints, arm.axes),
            "force_n": load.force.tolist(),
            "relative_sd_before": load.before,
            "relative_sd_after": load.after,
        },
        "sentence": in_words(identifiability, load, arm.axes),
    }


def _pose(joints: Array, axes: Axes) -> JSON:
    """Angles of the joints that turn, and places of those that shift, where there are any."""
    places = joints / axes.units
    shifted = places[np.array(axes.linear)].tolist()
    return {"q_deg": places[axes.turning].tolist()} | ({"q_mm": shifted} if shifted else {})


def wall_figures(model: DeformationModel, block: Block, fit: BaseFit) -> JSON:
    """Steady deformation of one wall as in [K] table 8, with its contributions.

    Returns
    -------
    JSON
        ``measured, predicted`` (mm, along the wall's normal, mean of the steady cut), ``error_percent`` of
        the measured value; mean displacement of ``flange`` and ``tip``, mm, and rotation of the flange, work
        frame; displacement of the tip from the wall with and without that rotation, mm ([K] eq. 16 to 18);
        the ``curve`` of cut-in and steady cut, mm, not filtered.
    """
    setting = model.believed_force(block.setting, fit.beta)
    matrix, offset = model.design(block, np.zeros(0), fit.beta)
    row = matrix.mean(axis=0)
    zero, *force = np.array([ZERO]) if block.unidentified is None else block.unidentified.mean(axis=0)
    predicted = float(offset.mean() + row @ fit.beta)
    sd = math.sqrt(float(row @ fit.covariance @ row) + float(np.sum(np.square(force))))
    measured = float(block.measured.mean())
    read = math.hypot(float(np.sqrt(np.mean(block.sigma**2) / len(block.sigma))), zero)
    twist = model.twists(setting, fit.beta)
    flange, turned, tip = (
        part[setting.kept].mean(axis=0) for part in deflections(model.arm, setting.commanded, twist)
    )
    proud = model.deflection(setting, fit.beta) @ setting.normal
    along = setting.spacing * np.arange(len(proud)) / MM + block.coordinates["x_mm"][0]
    along -= setting.spacing * setting.kept[0] / MM
    return {
        "measured": quantity(measured / MM, read / MM, "mm"),
        "predicted": quantity(predicted / MM, sd / MM, "mm", fit.dof),
        "error_percent": quantity(
            100 * (predicted / measured - 1), 100 * math.hypot(sd, read) / abs(measured), "%", fit.dof
        ),
        "flange": dict(zip("xyz", (flange / MM).tolist(), strict=True)),
        "flange_rotation_mrad": dict(zip("xyz", (turned * 1e3).tolist(), strict=True)),
        "tip": dict(zip("xyz", (tip / MM).tolist(), strict=True)),
        "with_flange_rotation": float(tip @ setting.normal) / MM,
        "without_flange_rotation": float(flange @ setting.normal) / MM,
        "curve": {"x_mm": along.tolist(), "predicted_mm": (proud / MM).tolist()},
    }


def _stiffness(
    batch: Batch, observed: Mapping[str, pd.DataFrame], fit: BaseFit | None
) -> list[JSON] | Refusal:
    """Joint stiffnesses k = 1/c; a joint has no value if its compliance cannot be distinguished from zero."""
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal("no arm.dh")
    if fit is not None:
        count = len(arm.dh)  # what follows is believed of the walls
        value, sd, dof = fit.beta[:count], np.sqrt(np.diag(fit.covariance))[:count], fit.dof
    else:
        tests = fitted_loads(DeformationModel(arm), observed["arm_loads"])
        if isinstance(tests, Refusal):
            return tests
        value, sd, dof = tests.value, tests.sd, float(tests.dof)
    identified = value > 2.0 * sd
    known = np.where(identified, value, np.nan)
    units = ["N/m" if linear else "N m/rad" for linear in arm.axes.linear]
    return [quantity(1.0 / c, s / c**2, u, dof) for c, s, u in zip(known, sd, units, strict=True)]


def tip_forces(batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON) -> JSON:
    """Return the force on the tip that the deformation takes, run by run; nothing without an arm.

    That of the torques holds the uncertainty of the drives.
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None or "tip_force" not in observed:
        return {}
    drives = float(np.sqrt(np.mean(np.diag(gain_errors(batch, identified, arm)[0]))))
    forces = {}
    for run, rows in observed["tip_force"].groupby("run", sort=False):
        relative = drives if rows["source"].iloc[0] == "torque" else 0.0
        forces[str(run)] = _mean_force(wall(batch, str(run)), rows, relative)
    return {"tip_force": forces}


def _mean_force(face: Wall, rows: pd.DataFrame, relative: float) -> JSON:
    """Mean of the steady cut; its error is assumed constant along the wall, like a wrong zero of a torque.

    ``relative``: of an error of the whole force.
    """
    steady = rows[face.steady(rows["x_mm"].to_numpy() * MM)]
    block: JSON = {}
    for axis, name in zip("xyz", FORCE, strict=True):
        force, sd = float(steady[name].mean()), float(steady[f"sd_{name}"].mean())
        block[axis] = quantity(force, math.hypot(sd, relative * force), "N")
    return block


def _deformation(model: DeformationModel, wall: CutWall, fit: BaseFit) -> JSON:
    """Mean deflection of the tip at the compared points of the wall, work frame, by the fitted base model."""
    count = len(model.arm.dh)

    def deflected(beta: Array) -> Array:
        cut = model.believed_force(wall, beta)
        return np.asarray(model.deflection(cut, beta)[wall.kept].mean(axis=0))

    mean = deflected(fit.beta)
    cut = model.believed_force(wall, fit.beta)
    each = model.contributions(cut.commanded, cut.force)[wall.kept].mean(axis=0)
    # It is linear in what is believed of the force, so that a step of any size gives the slope.
    steps = np.eye(len(fit.beta))[count:]
    each = np.hstack([each, *((deflected(fit.beta + step) - mean)[:, None] for step in steps)])
    sd = np.sqrt(np.einsum("ai,ij,aj->a", each, fit.covariance, each))
    return {
        axis: quantity(value / MM, error / MM, "mm", fit.dof)
        for axis, value, error in zip("xyz", mean, sd, strict=True)
    }
