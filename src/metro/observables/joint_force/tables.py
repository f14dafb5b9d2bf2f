"""What joint forces are made of: torques of each cut less those of its idle run, and the measured force."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.arm import tip_force
from metro.observables.arm.idle_runs import of_idle_logs
from metro.observables.arm.no_arm import no_arm
from metro.observables.arm.tip_force import FORCE
from metro.observables.arm.wall import wall
from metro.observables.joint_force import friction
from metro.observables.joint_force.along_path import IDLE, NOISE, WANDER, with_friction
from metro.observables.joint_force.model import ForceRecord, running
from metro.observables.problem import Refusal
from metro.robot.drive_torques import TURNING
from metro.robot.kinematics import Arm, arm_of_cell
from metro.same import Same
from metro.signals import align, kalman
from metro.signals.intervals import uneven
from metro.signals.waves import wandering
from metro.units import JSON, MM, MS, Array

# After a start from rest the joints' friction first winds up, over 1e-4 to 1e-3 rad: some millimetres of the
# path at a lever of a metre and more. Cut and idle run may have started elsewhere.
SETTLED, OF_AIR = 5 * MM, 1.0 / 3.0
GRID = 5 * MS
AT_AN_END = 0.1  # s by which the clocks of log and dynamometer may be apart, of a record that ends in the cut
LEAST_BINS = 8  # of the path


def observe(batch: Batch, read: Tables, _identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Torques of each cut less those of its idle run, and the dynamometer's force beside them.

    Tables ``joint_torque`` (per bin of the path), ``tool_force`` (per 5 ms), ``joint_force_refused``, and
    those of :func:`metro.observables.joint_force.friction.observe`.
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
    rubbed, of_idle = friction.observe(batch, read), of_idle_logs(Same(batch), Same(read))
    return {
        **({"joint_torque": with_friction(torques, arm, of_idle)} if torques else {}),
        **({"tool_force": pd.concat(forces, ignore_index=True)} if forces else {}),
        **({} if isinstance(rubbed, Refusal) else rubbed),
        "joint_force_refused": pd.DataFrame(refused, columns=["run", "reason"], dtype=str),
    }


def _force(batch: Batch, run: str, read: Tables) -> pd.DataFrame | Refusal:
    """Force about the zero of the air, each value the mean over a revolution of the spindle.

    ``known``: whether it is, from the start of the record to its end and, where the record shows the air
    there, beyond: a record that ends while the tool cuts says nothing of the force after it.
    """
    measured = tip_force.about_air(batch, run, read, wall(batch, run))
    if isinstance(measured, Refusal):
        return measured
    row: Any = batch.runs.loc[run]
    turn, length = 60.0 / row["spindle_rpm"], measured.record.end - measured.record.start
    grid = np.arange(0.0, length, GRID)
    ends = np.unique(np.clip(np.concatenate([grid - 0.5 * turn, grid + 0.5 * turn]), 0.0, length))
    mean = _integral(measured, ends).mean(grid, np.full(len(grid), turn))
    cut = measured.steady
    known = (cut.start > 0 or grid >= AT_AN_END) & (
        cut.stop < measured.record.samples or grid <= length - AT_AN_END
    )
    return pd.DataFrame({"t_s": grid, **dict(zip(FORCE, mean.T, strict=True)), "known": known})


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
    begun = float(table["t_s"][table["log"] == "cut"].min())
    meet = cut.time[0] < force["t_s"].iloc[-1] and cut.time[-1] > 0.0
    time = cut.time if meet else cut.time - begun
    channels = [
        np.column_stack([cut.torque, cut.commanded, time, cut.tip @ wall(batch, run).along]),
        np.column_stack([idle.torque, np.zeros((len(idle.torque), len(arm.axes) + 2))]),
    ]
    places = [align.along_path(log.tip, cut.tip) for log in (cut, idle)]
    width = max(tip_force.BIN, 3 * step)
    gaps = any(log.interval is not None for log in (cut, idle))
    try:
        pair = align.align(places[0], channels[0], places[1], channels[1], width, gaps=gaps)
    except ValueError as error:
        return Refusal(str(error))
    pair = _settled(pair, pair.first[:, -1] - wall(batch, run).start)
    pair = _covered(pair, pair.first[:, -2], force)
    if len(pair.s) < LEAST_BINS:
        return Refusal("the dynamometer's record ends in the cut and covers too little of the path")
    period = float(np.median(np.diff(cut.time)))
    samples = width / step
    white = [
        np.maximum(kalman.noise_variance(log.torque, log.interval), tip_force.LEAST_NOISE**2)
        for log in (cut, idle)
    ]
    # what wanders in the idle run wanders as much in the cut, where the force hides it
    # Angles are those that were commanded: the noise of those measured would make friction follow it.
    axes, parts = arm.axes, np.cumsum([len(arm.axes.turning), len(arm.axes)])
    torque, commanded, rest = np.split(pair.first, parts, axis=1)
    rates = align.slopes(commanded, rest[:, 0])
    idle_torque = pair.second[:, : parts[0]]
    turning = np.tanh(rates[:, axes.turning] / TURNING)
    idling = wandering(idle_torque, white[1] / samples, turning, uneven(pair.s) if gaps else None)
    start = wall(batch, run).start
    columns = {"s_mm": pair.s / MM, "x_mm": (rest[:, 1] - start) / MM, "t_s": rest[:, 0]}
    columns |= {"since_s": columns["t_s"] - (begun if meet else 0.0), "meet": np.full(len(pair.s), meet)}
    columns |= {"width_s": np.full(len(pair.s), samples * period), "samples": np.full(len(pair.s), samples)}
    columns |= dict(zip(axes.torques, (torque - idle_torque).T, strict=True))
    columns |= dict(zip(axes.positions, (commanded / axes.units).T, strict=True))
    columns |= dict(zip(axes.rates, (rates / axes.units).T, strict=True))
    columns |= dict(zip(axes.driven(NOISE), np.sqrt(white[0] + white[1]), strict=True))
    columns |= dict(zip(axes.driven(WANDER), np.sqrt(2.0 * idling), strict=True))
    columns |= dict(zip(axes.driven(IDLE), idle_torque.T, strict=True))
    return pd.DataFrame(columns)


def _settled(pair: align.Aligned, x: Array) -> align.Aligned:
    """Leave out the first millimetres of a path, at most a third of what lies before the block (x < 0)."""
    kept = x - x[0] >= min(SETTLED, OF_AIR * max(0.0, -float(x[0])))
    return align.Aligned(pair.s[kept], pair.first[kept], pair.second[kept])


def _covered(pair: align.Aligned, time: Array, force: pd.DataFrame) -> align.Aligned:
    """Leave out where the force is not known, by ``time`` (m,) on the dynamometer's clock."""
    known, at = force["known"].to_numpy(), force["t_s"].to_numpy()
    low = -math.inf if known[0] else at[known].min(initial=math.inf)
    high = math.inf if known[-1] else at[known].max(initial=-math.inf)
    kept = (time >= low) & (time <= high)
    return align.Aligned(pair.s[kept], pair.first[kept], pair.second[kept])
