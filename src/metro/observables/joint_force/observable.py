"""Force on the tool by the torques of the joints, against the dynamometer's."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import axes_of
from metro.observables.arm import joint_logs
from metro.observables.arm.clock import Clock, clock
from metro.observables.arm.force_by_torques import force_without_dynamometer
from metro.observables.arm.no_arm import no_arm
from metro.observables.arm.tip_force import FORCE, REPEATABLE
from metro.observables.joint_force import NAME, TABLES, friction
from metro.observables.joint_force.along_path import IDLE, NOISE, PEAK, START, TURN, slow_noise, smooth
from metro.observables.joint_force.model import (
    CROSS,
    Instruments,
    JointForceModel,
    TorqueRun,
    carried,
    in_waves,
    late,
    rubbing,
    running,
)
from metro.observables.joint_force.tables import observe
from metro.observables.observable import Observable
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.robot.drive_torques import DriveTorques
from metro.robot.drives import declared, drives_of_cell
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.statics import driven_jacobian
from metro.signals.waves import variance, waves
from metro.units import DEG, JSON, MRAD, MS, Array

SCATTER = 0.01
CALIBRATED = 0.01  # relative error of an axis of the dynamometer, in all runs
DRIVEN = 0.03  # of the torque of a joint, in all runs: torque constants are stated to some 5 %
# Of a torque constant, against the idle run: magnets lose 0.11 % per kelvin, and motors differ by some 10 K.
WARMED = 0.011
# Of the friction of a joint, against the idle run: viscous friction halves while an arm warms up, all
# of it changes by some 5 % (at the fastest speed, where the idle runs do not separate the two).
WEARING, THINNING = 0.05, 0.25
USUAL = 0.1  # friction over the torque of the weight, of a joint whose friction the idle runs do not show
BY_LOAD = 0.015  # of the torque of the cut: what the friction of a joint has more, under load (0.3 to 2 %)
LEAST_FRICTION, LEAST_VISCOUS = 0.1, 1.0  # N m and N m s/rad, of a joint that shows none
LAG = 10 * MS  # of all torques behind the force: filters of the drives (20 to 60 Hz), clock of the log
SHIFT = 4 * MS  # of the log of one run: it is stamped in cycles of 4 to 12 ms
# Of the force along one axis that another one shows: makers state up to 2 % of crosstalk, and a mounting is
# square to 1° or so, as two standard deviations each.
CROSSTALK = math.hypot(0.01, 0.5 * math.radians(1.0))

WORK = ("x", "y", "z")
LONG, SHORT = 50.0, 5.0  # mm, of waves along the path as the report names them


def problem(batch: Batch, observed: Mapping[str, pd.DataFrame], _identified: JSON) -> Problem | Refusal:
    """Torques per run as blocks, and the model of what the dynamometer's force makes of them."""
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal(no_arm(batch.cell))
    left_out = [
        f"Run {row.run} is left out: {row.reason}." for row in observed["joint_force_refused"].itertuples()
    ]
    if "joint_torque" not in observed:
        return Refusal(" ".join(left_out))
    forces = dict(tuple(observed["tool_force"].groupby("run")))
    roles = batch.runs["role"].to_dict()
    torques = dict(tuple(observed["joint_torque"].groupby("run", sort=False)))
    wander = slow_noise(list(torques.values()), arm.axes)
    blocks = tuple(
        _block(batch.runs.loc[str(run)], table, torque_run(table, forces[run]), arm, wander)
        for run, table in torques.items()
        if roles[run] in {"identify", "validate"}
    )
    apart = [str(run) for run, rows in torques.items() if not rows["meet"].all()]
    notes = (
        "The torques of the cut less those of the idle run at the same place are what the dynamometer's "
        "force asks of the joints; friction and gravity are those of the idle run.",
        "The sensorless force is solved from all joints by weighted least squares.",
        "All torques may have one common scale error. The torques of each joint may have another of "
        f"{DRIVEN:.0%}, and the force along each axis one of {CALIBRATED:.0%}, the same in all runs. Each "
        f"axis of the dynamometer may show {CROSSTALK:.1%} of the force along the others. All torques may "
        f"follow the force {LAG / MS:.0f} ms late, and those of each run another {SHIFT / MS:.0f} ms.",
        *(
            f"Run {run}: the robot log is of another time than the dynamometer's record; it is taken to "
            "start with it."
            for run in apart
        ),
        *left_out,
    )
    model = JointForceModel(arm, DriveTorques(presliding=_turns(observed["joint_torque"], arm)))
    scatter = np.zeros(len(model.parameters))
    scatter[0] = SCATTER
    return Problem(
        NAME,
        "N",
        1.0,
        model,
        (_instruments(batch, arm, blocks, observed.get("joint_friction")), *blocks),
        scatter,
        notes=notes,
        basis_unit="N m",
    )


def _turns(torques: pd.DataFrame, arm: Arm) -> tuple[float, ...]:
    """Return the turn over which the friction of each joint follows, rad; NaN where it is not identified."""
    turns = np.full(len(arm.axes), np.nan)
    turns[arm.axes.turning] = torques[arm.axes.driven(TURN)].to_numpy()[0] * MRAD
    return tuple(turns.tolist())


def _instruments(batch: Batch, arm: Arm, blocks: Sequence[Block], friction: pd.DataFrame | None) -> Block:
    """Return what is known of gains, crosstalk and friction; of joints, what the cell declares of each.

    ``friction`` : table of the friction by the idle runs; None without one.
    """
    joints, names = arm.axes.turning, arm.axes.driven("joint {}")
    seen = (WORK[one] for one, _ in CROSS)
    axis = np.array([*names, *WORK, *seen, *3 * [*names], "time", "time"])
    count = len(axis)
    zeros, known, sigma = np.zeros((count, 0)), np.zeros(count), np.full(count, CALIBRATED)
    sigma[: len(joints)] = DRIVEN
    sigma[len(joints) + len(WORK) : -2] = CROSSTALK
    level, viscous = _friction(arm, friction, blocks)
    own = np.hypot(BY_LOAD * _largest(arm, blocks), WEARING * level)
    each = np.repeat(WARMED, len(joints)), np.maximum(own, LEAST_FRICTION), viscous
    sigma[-2 - 3 * len(joints) : -2] = np.concatenate(each)
    sigma[-2:] = 0.5 * LAG**2, LAG
    if declared(batch.cell):
        drives = drives_of_cell(batch.cell, len(arm.axes)).covariance
        own = np.diag(drives)[joints] - drives[0, 1]  # what joints share is the gain of all torques
        sigma[: len(joints)] = np.maximum(np.sqrt(np.maximum(own, 0.0)), CALIBRATED)
    return Block(
        *("instruments", "instruments", "calibrate", 0, known, sigma, Instruments(), axis, zeros),
        *(known[:0], {}),
        belief=True,
    )


def _friction(arm: Arm, table: pd.DataFrame | None, blocks: Sequence[Block]) -> tuple[Array, Array]:
    """Return the friction of each joint that turns (k,), N m, and by how much its viscous part may change.

    That is in N m s/rad. ``table`` : by the idle runs; where they show none it is as usual beside the weight.
    """
    joints = arm.axes.turning
    squares = [np.mean(block.setting.idle**2, axis=0) for block in blocks]
    held = np.sqrt(np.mean(squares, axis=0)) if squares else np.zeros(len(joints))
    if table is None:
        return USUAL * held, np.full(len(joints), LEAST_VISCOUS)
    rows = table.set_index("joint").loc[[joint + 1 for joint in joints]]
    seen = np.abs(rows["coulomb"].to_numpy())
    level = np.where(np.isfinite(seen), seen, USUAL * held)
    fastest = rows["fastest_deg_s"].to_numpy() * DEG
    fastest = np.where(fastest > 0.0, fastest, np.inf)  # of a joint that is at rest it would make nothing
    half = 0.5 * (rows["viscous_high"] - rows["viscous_low"]).to_numpy()
    known = THINNING * np.hypot(rows["viscous"].to_numpy(), half / 2.0)
    change = np.where(np.isfinite(known), known, WEARING * level / fastest)
    return level, np.maximum(change, LEAST_VISCOUS)


def _largest(arm: Arm, blocks: Sequence[Block]) -> Array:
    """Return the largest torque of the cuts on each joint that turns, (k,) N m: rms over a run."""
    count = len(arm.axes.turning)
    loads = [carried(arm, block.setting, 0.0)[:, 0].reshape(count, -1) for block in blocks]
    return np.asarray(
        np.max([np.zeros(count), *(np.sqrt(np.mean(load**2, axis=1)) for load in loads)], axis=0)
    )


def _block(row: Any, table: pd.DataFrame, setting: TorqueRun, arm: Arm, wander: Array) -> Block:
    """Torques of the run whose row of the run table is ``row``, in waves along its path."""
    count, axes = len(table), arm.axes
    noise = table[axes.driven(NOISE)].to_numpy()[0]
    white = noise**2 / table["samples"].iloc[0]
    solve = _least_squares(arm, setting, np.sqrt(white))
    torque = table[axes.torques].to_numpy()
    known = setting.force.mean(setting.t, setting.width)
    return Block(
        run=str(row.name),
        condition=str(row["condition"]),
        role="validate" if row["role"] == "validate" else "identify",
        order=int(row["order"]),
        measured=in_waves(torque),
        sigma=np.sqrt(variance(count, white, wander**2)).T.ravel(),
        setting=setting,
        axis=np.repeat(axes.driven("joint {}"), count),
        zeros=rubbing(setting, tuple(axes.turning)),
        zero_sd=REPEATABLE * noise,
        unidentified=SHIFT * late(arm, setting, 0.0)[:, None],
        labels=np.tile(_lengths(table["s_mm"].to_numpy()), len(axes.turning)),
        synthesis=-solve,
        anchor=known.T.ravel() + solve @ in_waves(torque),
        coordinates={
            "axis": np.repeat(WORK, count),
            "t_s": np.tile(setting.t, 3),
            "s_mm": np.tile(table["s_mm"].to_numpy(), 3),
            "x_mm": np.tile(table["x_mm"].to_numpy(), 3),
        },
    )


def torque_run(table: pd.DataFrame, force: pd.DataFrame) -> TorqueRun:
    """Return what the model needs of a run's rows of ``joint_torque`` and ``tool_force``."""
    record = running(force["t_s"].to_numpy(), force[FORCE].to_numpy())
    axes = axes_of(table)
    q, rate = (table[names].to_numpy() * axes.units for names in (axes.positions, axes.rates))
    time, since, width = (table[name].to_numpy() for name in ("t_s", "since_s", "width_s"))
    start, turn = np.zeros(len(axes)), np.full(len(axes), np.nan)
    start[axes.turning] = table[axes.driven(START)].to_numpy()[0]
    turn[axes.turning] = table[axes.driven(TURN)].to_numpy()[0] * MRAD
    peak = np.ones(q.shape)
    peak[:, axes.turning] = table[axes.driven(PEAK)].to_numpy()
    idle = smooth(table[axes.driven(IDLE)].to_numpy(), table["s_mm"].to_numpy(), rate[:, axes.turning])
    return TorqueRun(q, rate, time, since, width, record, idle, start, turn, peak)


def _lengths(s_mm: Array) -> np.ndarray:
    """Name the waves of a path in the words of the report, (m,)."""
    length = 2.0 * float(np.ptp(s_mm)) / np.maximum(np.arange(len(s_mm)), 1)
    words = [f"waves over {LONG:g} mm", f"waves of {SHORT:g} to {LONG:g} mm", f"waves under {SHORT:g} mm"]
    return np.select([length > LONG, length > SHORT], words[:2], words[2])


def _least_squares(arm: Arm, setting: TorqueRun, sigma: Array) -> Array:
    """Map (3 m, k m) from waves of the torques to the force on the tip: weighted least squares in each bin.

    ``sigma`` (k,) of the joints that turn, N m.
    """
    count = len(setting.q)
    system = -np.swapaxes(driven_jacobian(arm, setting.q), 1, 2) / sigma[:, None]
    solve = np.linalg.pinv(system) / sigma
    back = waves(np.eye(count)).T  # orthonormal: its transpose makes series of waves
    return np.asarray(np.einsum("mai,mw->amiw", solve, back).reshape(3 * count, -1))


def report(
    batch: Batch,
    _observed: Mapping[str, pd.DataFrame],
    _identified: JSON,
    task: Problem | Refusal,
    fit: BaseFit | None,
) -> JSON:
    """Return the part of the ``arm`` block: the gain of all torques, and each run's clock.

    The gain is the factor between the torques that were logged and those that the force asks for; a clock's
    offset is by how much later the robot's log stamps an event.
    """
    if isinstance(task, Refusal) or fit is None:
        reason = task.reason if isinstance(task, Refusal) else "no run to fit"
        return {"arm": {"not_identified": {"clock_offset_s": reason}}}
    arm = arm_of_cell(batch.cell, batch.manifest)
    assert arm is not None  # else there were no problem
    clocks: dict[str, Clock] = {
        block.run: clock(block, arm, float(fit.beta[0])) for block in task.role("identify", "validate")
    }
    deviation = float(np.sqrt(fit.covariance[0, 0]))
    return {
        "arm": {
            "torque_gain": quantity(float(fit.beta[0]), deviation, "1", fit.dof),
            "clock_offset_s": {
                run: quantity(one.offset, one.offset_sd, "s", one.dof) for run, one in clocks.items()
            },
            "clock_drift": {
                run: quantity(one.drift, one.drift_sd, "s/s", one.dof) for run, one in clocks.items()
            },
        }
    }


def beside(batch: Batch, read: Tables, identified: JSON) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return the friction of the joints by the idle runs, and all that logs of a free motion say."""
    tables = friction.observe(batch, read)
    free, blocks = joint_logs.observe(batch, read)
    if free and isinstance(tables, Refusal):
        tables = Refusal("")  # the joint logs determine the friction
    arm = {**friction.report(tables).get("arm", {}), **force_without_dynamometer(batch, read, identified)}
    return ({} if isinstance(tables, Refusal) else tables) | free, {**({"arm": arm} if arm else {}), **blocks}


OBSERVABLE = Observable(NAME, TABLES, observe, problem, report, beside=beside, retold=True)
