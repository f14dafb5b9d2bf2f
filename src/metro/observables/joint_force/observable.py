"""Force on the tool by the torques of the joints, against the dynamometer's."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import axes_of
from metro.observables.arm import joint_logs, tip_force
from metro.observables.arm.clock import Clock, clock
from metro.observables.arm.force_by_torques import force_without_dynamometer
from metro.observables.arm.no_arm import no_arm
from metro.observables.arm.tip_force import FORCE, REPEATABLE
from metro.observables.arm.wall import wall
from metro.observables.joint_force import NAME, TABLES, friction
from metro.observables.joint_force.model import (
    CROSS,
    ForceRecord,
    Instruments,
    JointForceModel,
    TorqueRun,
    in_waves,
    late,
    running,
)
from metro.observables.observable import Observable
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.robot.drive_torques import TURNING
from metro.robot.drives import declared, drives_of_cell
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.statics import driven_jacobian
from metro.signals import align, kalman
from metro.signals.intervals import uneven
from metro.signals.waves import variance, wandering, waves
from metro.units import JSON, MM, MS, Array

SCATTER = 0.01
CALIBRATED = 0.01  # relative error of an axis of the dynamometer, in all runs
DRIVEN = 0.03  # of the torque of a joint, in all runs: torque constants are stated to some 5 %
LAG = 10 * MS  # of all torques behind the force: filters of the drives (20 to 60 Hz), clock of the log
# After a start from rest the joints' friction first winds up, over 1e-4 to 1e-3 rad: some millimetres of the
# path at a lever of a metre and more. Cut and idle run may have started elsewhere.
SETTLED, OF_AIR = 5 * MM, 1.0 / 3.0
SHIFT = 4 * MS  # of the log of one run: it is stamped in cycles of 4 to 12 ms
# Of the force along one axis that another one shows: makers state up to 2 % of crosstalk, and a mounting is
# square to 1° or so, as two standard deviations each.
CROSSTALK = math.hypot(0.01, 0.5 * math.radians(1.0))

GRID = 5 * MS
NOISE, WANDER = "noise{}_nm", "wander{}_nm"
WORK = ("x", "y", "z")
LONG, SHORT = 50.0, 5.0  # mm, of waves along the path as the report names them


def observe(batch: Batch, read: Tables, _identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Torques of each cut less those of its idle run, and the dynamometer's force beside them.

    Tables ``joint_torque`` (per bin of the path), ``tool_force`` (per 5 ms), ``joint_force_refused``.
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal(no_arm(batch.cell))
    torques, forces, refused = [], [], []
    for run in batch.with_files("robot_log", "idle_log", "dynamometer"):
        force = _force(batch, run, read)
        torque = force if isinstance(force, Refusal) else _torque(batch, run, read("robot", run), arm, force)
        if isinstance(torque, Refusal) or isinstance(force, Refusal):
            reason = torque.reason if isinstance(torque, Refusal) else ""
            refused.append({"run": run, "reason": reason})
        else:
            torques.append(torque.assign(run=run))
            forces.append(force.assign(run=run))
    if not torques and not refused:
        return Refusal("no run has a robot_log, an idle_log and a dynamometer record")
    return {
        **({"joint_torque": pd.concat(torques, ignore_index=True)} if torques else {}),
        **({"tool_force": pd.concat(forces, ignore_index=True)} if forces else {}),
        "joint_force_refused": pd.DataFrame(refused, columns=["run", "reason"], dtype=str),
    }


def _force(batch: Batch, run: str, read: Tables) -> pd.DataFrame | Refusal:
    """Force about the zero of the air, each value the mean over a revolution of the spindle."""
    measured = tip_force.about_air(batch, run, read, wall(batch, run))
    if isinstance(measured, Refusal):
        return measured
    row: Any = batch.runs.loc[run]
    turn, length = 60.0 / row["spindle_rpm"], measured.record.end - measured.record.start
    grid = np.arange(0.0, length, GRID)
    ends = np.unique(np.clip(np.concatenate([grid - 0.5 * turn, grid + 0.5 * turn]), 0.0, length))
    mean = _integral(measured, ends).mean(grid, np.full(len(grid), turn))
    return pd.DataFrame({"t_s": grid, **dict(zip(FORCE, mean.T, strict=True))})


def _integral(measured: tip_force.AboutAir, places: Array) -> ForceRecord:
    """Return the running integral of a measured about its zero at rising times (k,), s, from its start."""
    integral, before, last = np.zeros((len(places), 3)), np.zeros(3), (np.zeros(0), np.zeros((0, 3)))
    for part in measured.record.stretches():
        here = part.time - measured.record.start, measured.of(part)
        time, force = (np.concatenate(ends) for ends in zip(last, here, strict=True))
        whole = running(time, force).integral
        inside = (places >= time[0]) & (places <= time[-1])
        for axis in range(3):
            integral[inside, axis] = before[axis] + np.interp(places[inside], time, whole[:, axis])
        before, last = before + whole[-1], (time[-1:], force[-1:])
    return ForceRecord(places, integral)


def _torque(
    batch: Batch, run: str, table: pd.DataFrame, arm: Arm, force: pd.DataFrame
) -> pd.DataFrame | Refusal:
    """Bins of the path: where the arm was, when, and the torques of the cut less those of the idle run."""
    cut, idle = tip_force.logs(table, arm)
    if len(cut.tip) < 2:
        return Refusal("the log of the cut does not move")
    step = float(np.median(np.linalg.norm(np.diff(cut.tip, axis=0), axis=1)))
    rate = np.gradient(cut.commanded, cut.time, axis=0)
    begun = float(table["t_s"][table["log"] == "cut"].min())
    meet = cut.time[0] < force["t_s"].iloc[-1] and cut.time[-1] > 0.0
    time = cut.time if meet else cut.time - begun
    channels = [
        np.column_stack([cut.torque, cut.actual, rate, time, cut.tip @ wall(batch, run).along]),
        np.column_stack([idle.torque, np.zeros((len(idle.torque), 2 * len(arm.axes) + 2))]),
    ]
    places = [align.along_path(log.tip, cut.tip) for log in (cut, idle)]
    width = max(tip_force.BIN, 3 * step)
    gaps = any(log.interval is not None for log in (cut, idle))
    try:
        pair = align.align(places[0], channels[0], places[1], channels[1], width, gaps=gaps)
    except ValueError as error:
        return Refusal(str(error))
    pair = _settled(pair, pair.first[:, -1] - wall(batch, run).start)
    period = float(np.median(np.diff(cut.time)))
    samples = width / step
    white = [
        np.maximum(kalman.noise_variance(log.torque, log.interval), tip_force.LEAST_NOISE**2)
        for log in (cut, idle)
    ]
    # what wanders in the idle run wanders as much in the cut, where the force hides it
    axes, parts = arm.axes, np.cumsum([len(arm.axes.turning), len(arm.axes), len(arm.axes)])
    torque, actual, rates, rest = np.split(pair.first, parts, axis=1)
    idle_torque = pair.second[:, : parts[0]]
    turning = np.tanh(rates[:, axes.turning] / TURNING)
    idling = wandering(idle_torque, white[1] / samples, turning, uneven(pair.s) if gaps else None)
    start = wall(batch, run).start
    columns = {"s_mm": pair.s / MM, "x_mm": (rest[:, 1] - start) / MM, "t_s": rest[:, 0]}
    columns |= {"since_s": columns["t_s"] - (begun if meet else 0.0), "meet": np.full(len(pair.s), meet)}
    columns |= {"width_s": np.full(len(pair.s), samples * period), "samples": np.full(len(pair.s), samples)}
    columns |= dict(zip(axes.torques, (torque - idle_torque).T, strict=True))
    columns |= dict(zip(axes.positions, (actual / axes.units).T, strict=True))
    columns |= dict(zip(axes.rates, (rates / axes.units).T, strict=True))
    columns |= dict(zip(axes.driven(NOISE), np.sqrt(white[0] + white[1]), strict=True))
    columns |= dict(zip(axes.driven(WANDER), np.sqrt(2.0 * idling), strict=True))
    return pd.DataFrame(columns)


def _settled(pair: align.Aligned, x: Array) -> align.Aligned:
    """Leave out the first millimetres of a path, at most a third of what lies before the block (x < 0)."""
    kept = x - x[0] >= min(SETTLED, OF_AIR * max(0.0, -float(x[0])))
    return align.Aligned(pair.s[kept], pair.first[kept], pair.second[kept])


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
    # one run tells little of its slow noise: all of them together do
    levels = observed["joint_torque"].groupby("run")[arm.axes.driven(WANDER)].first()
    wander = np.sqrt((levels**2).mean().to_numpy())
    blocks = tuple(
        _block(batch.runs.loc[str(run)], table, forces[run], arm, wander)
        for run, table in observed["joint_torque"].groupby("run", sort=False)
        if roles[run] in {"identify", "validate"}
    )
    apart = [str(run) for run, rows in observed["joint_torque"].groupby("run") if not rows["meet"].all()]
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
    model = JointForceModel(arm)
    scatter = np.zeros(len(model.parameters))
    scatter[0] = SCATTER
    return Problem(
        NAME, "N", 1.0, model, (_instruments(batch, arm), *blocks), scatter, notes=notes, basis_unit="N m"
    )


def _instruments(batch: Batch, arm: Arm) -> Block:
    """Return what is known of gains and crosstalk; of joints, what the cell declares of each one."""
    joints, names = arm.axes.turning, arm.axes.driven("joint {}")
    axis = np.array([*names, *WORK, *(WORK[seen] for seen, _ in CROSS), "time"])
    count = len(axis)
    zeros, known, sigma = np.zeros((count, 0)), np.zeros(count), np.full(count, CALIBRATED)
    sigma[: len(joints)] = DRIVEN
    sigma[len(joints) + len(WORK) : -1] = CROSSTALK
    sigma[-1] = LAG
    if declared(batch.cell):
        drives = drives_of_cell(batch.cell, len(arm.axes)).covariance
        own = np.diag(drives)[joints] - drives[0, 1]  # what joints share is the gain of all torques
        sigma[: len(joints)] = np.maximum(np.sqrt(np.maximum(own, 0.0)), CALIBRATED)
    return Block(
        *("instruments", "instruments", "calibrate", 0, known, sigma, Instruments(), axis, zeros),
        *(known[:0], {}),
        belief=True,
    )


def _block(row: Any, table: pd.DataFrame, force: pd.DataFrame, arm: Arm, wander: Array) -> Block:
    """Torques of the run whose row of the run table is ``row``, in waves along its path."""
    setting, count, axes = torque_run(table, force), len(table), arm.axes
    noise = table[axes.driven(NOISE)].to_numpy()[0]
    white = noise**2 / table["samples"].iloc[0]
    turning = np.tanh(setting.rate[:, axes.turning] / TURNING)
    zeros = np.stack([in_waves(turning * joint) for joint in np.eye(len(axes.turning))], axis=1)
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
        zeros=zeros,
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
    return TorqueRun(q, rate, time, since, width, record)


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
        tables = Refusal("")  # the joint logs tell the friction
    arm = {**friction.report(tables).get("arm", {}), **force_without_dynamometer(batch, read, identified)}
    return ({} if isinstance(tables, Refusal) else tables) | free, {**({"arm": arm} if arm else {}), **blocks}


OBSERVABLE = Observable(NAME, TABLES, observe, problem, report, beside=beside, retold=True)
