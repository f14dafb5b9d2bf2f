"""The force on the tip along the path: from joint torques, else a dynamometer, else the cutting law."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables import cutting_force
from metro.observables.long_record import LongRecord
from metro.observables.problem import Refusal
from metro.observables.wall import Wall
from metro.robot.drive_torques import TURNING
from metro.robot.kinematics import Arm
from metro.robot.sensorless import (
    LEAST_INDEX,
    TipForce,
    Torques,
    noise_of_bins,
    observability,
    smoothed_torque,
    tip_force,
)
from metro.robot.statics import tip_jacobian
from metro.signals import align, steady
from metro.signals.kalman import noise_variance
from metro.signals.path_match import match
from metro.signals.waves import wandering
from metro.units import DEG, JSON, MM, Array

Read = Callable[..., pd.DataFrame]
JOINTS = range(1, 7)
SET = [f"q{i}_set_deg" for i in JOINTS]
ACTUAL = [f"q{i}_deg" for i in JOINTS]
TORQUE = [f"tau{i}_nm" for i in JOINTS]
FORCE = ["fx_n", "fy_n", "fz_n"]
BIN = 1 * MM
LEAST_BINS = 5
ITERATIONS = 6
LEAST_NOISE = 1e-3  # N m: a log that is written to fewer digits than it has noise

# Relative error that all runs may share, by where the force comes from: friction that is not that of the idle
# run; the dynamometer's calibration; a radial depth that is not the nominal one because the tool yields.
SYSTEMATIC = {"torque": 0.05, "dynamometer": 0.01, "coefficients": 0.03}


@dataclass(frozen=True, eq=False)
class Log:
    """The moving part of a robot log: joint angles (n, 6) rad, torques (n, 6) N m, commanded tip (n, 3) m.

    ``time`` (n,) s by the dynamometer's clock; empty where there is none.
    """

    commanded: Array
    actual: Array
    torque: Array
    tip: Array
    time: Array = field(default_factory=lambda: np.zeros(0))


def logs(table: pd.DataFrame, arm: Arm) -> tuple[Log, Log]:
    """Return the log of the cut and that of the idle run, either of them empty where there is none."""
    idle = (table["log"] == "idle").to_numpy()
    return _log(table[~idle], arm), _log(table[idle], arm)


def _log(table: pd.DataFrame, arm: Arm) -> Log:
    commanded = table[SET].to_numpy(dtype=float) * DEG
    tip = arm.tip(commanded)
    moves = align.moving(tip) if len(tip) > 2 else np.zeros(len(tip), dtype=bool)
    actual, torque = table[ACTUAL].to_numpy(dtype=float) * DEG, table[TORQUE].to_numpy(dtype=float)
    time = table["t_s"].to_numpy(dtype=float)
    return Log(commanded[moves], actual[moves], torque[moves], tip[moves], time[moves])


@dataclass(frozen=True, eq=False)
class Sensorless:
    """What the torques of the joints tell of the force on the tip of a run, over m bins of its path.

    Attributes
    ----------
    s, x : (m,) along the path, and along the wall from its start, m. steady : (m,) bool.
    torques : the smoothed torque of the cut less that of the idle run. wander : (6,) level of its slow noise,
        N² m² (:mod:`metro.signals.waves`), as the idle run has it. index : (6,) observability.
    found : force; None where ``refusal`` says why. remarks : what idle run and cut do not share.
    """

    s: Array
    x: Array
    steady: np.ndarray
    torques: Torques
    wander: Array
    index: Array
    found: TipForce | None
    refusal: str
    remarks: tuple[str, ...]


def sensorless(
    cut: Log, idle: Log, arm: Arm, wall: Wall, least_index: float = LEAST_INDEX
) -> Sensorless | Refusal:
    """Solve for the force on the tip from the torques of the cut less those of the idle run.

    ``least_index``: observability that a joint needs to be used.
    """
    if not len(cut.tip) or not len(idle.tip):
        return Refusal(f"no {'idle_log' if len(cut.tip) else 'robot_log'}")
    alike = match(cut.tip, cut.time, idle.tip, idle.time)
    if alike.refusal is not None:
        return Refusal(alike.refusal)
    places = [align.along_path(log.tip, cut.tip) for log in (cut, idle)]
    steps = [float(np.median(np.abs(np.diff(place[np.isfinite(place)])))) for place in places]
    width = max(BIN, 3 * max(steps))
    channels = [
        np.column_stack([log.torque, log.commanded, log.tip @ wall.along - wall.start, _turning(log)])
        for log in (cut, idle)
    ]
    try:
        pair = align.align(places[0], channels[0], places[1], channels[1], width)
    except ValueError as error:
        return Refusal(str(error))
    x, joints = pair.first[:, 12], pair.first[:, 6:12]
    steady = wall.steady(x)
    if steady.sum() < LEAST_BINS:
        return Refusal(f"the logs hold {int(steady.sum())} mm of the cut; at least {LEAST_BINS} are needed")
    samples = (width / steps[0], width / steps[1])
    noise = np.maximum(noise_of_bins(cut.torque, idle.torque, samples, _turning(idle)), LEAST_NOISE**2)
    white = np.maximum(noise_variance(idle.torque), LEAST_NOISE**2) / samples[1]
    # what wanders in the idle run wanders as much in the cut, where the force hides it
    wander = 2.0 * wandering(pair.second[:, :6], white, pair.second[:, 13:])
    torques = smoothed_torque(pair.first[:, :6] - pair.second[:, :6], noise)
    index = observability((pair.first[:, :6] - pair.second[:, :6])[steady], pair.second[steady, :6])
    remarks = tuple(alike.remarks(np.gradient(cut.commanded, cut.time, axis=0)))
    moves = tip_jacobian(arm, joints)
    try:
        found, refusal = tip_force(torques.level, torques.variance, moves, index, least_index), ""
    except ValueError as error:
        return Sensorless(pair.s, x, steady, torques, wander, index, None, str(error), remarks)
    return Sensorless(pair.s, x, steady, torques, wander, index, found, refusal, remarks)


def _turning(log: Log) -> Array:
    """Which way the joints turn, (n, 6): the shape of their Coulomb friction."""
    return np.asarray(np.tanh(np.gradient(log.commanded, log.time, axis=0) / TURNING))


def from_torques(
    cut: Log, idle: Log, arm: Arm, wall: Wall
) -> tuple[pd.DataFrame | Refusal, pd.DataFrame | None]:
    """Force along the path from the torques of the cut less those of the idle run, and observability.

    Returns
    -------
    tuple
        The force, ``s_mm, x_mm, fx_n … sd_fz_n, condition_number`` per bin, or why there is none; and as far
        as the logs could be aligned ``joint, index, used, noise_nm, drift_nm, whiteness, remark`` per joint.
    """
    told = sensorless(cut, idle, arm, wall)
    if isinstance(told, Refusal):
        return told, None
    found = told.found
    per_joint = pd.DataFrame(
        {
            "joint": list(JOINTS),
            "index": told.index,
            "used": told.index >= LEAST_INDEX if found is None else found.used,
            "noise_nm": np.sqrt(told.torques.noise),
            "drift_nm": np.sqrt(told.torques.drift),
            "whiteness": told.torques.whiteness,
            "remark": "; ".join(told.remarks),
        }
    )
    if found is None:
        return Refusal(told.refusal), per_joint
    sd = np.sqrt(np.einsum("maa->ma", found.covariance))
    return _table(told.s, told.x, found.force, sd, found.condition), per_joint


def from_dynamometer(batch: Batch, run: str, read: Tables, wall: Wall) -> pd.DataFrame | Refusal:
    """Mean force of the steady cut, about the zero of the air where there is any; constant along the wall."""
    found = about_air(batch, run, read, wall)
    if isinstance(found, Refusal):
        return found
    count, total, square = 0, np.zeros(3), np.zeros(3)
    for part in found.record.stretches(found.steady):
        signal = part.signal - found.zero
        total, square = total + signal.sum(axis=0), square + (signal**2).sum(axis=0)
        count += len(signal)
    mean = total / count
    row: Any = batch.runs.loc[run]
    turns = count / found.record.rate * row["spindle_rpm"] / 60.0
    return _constant(mean, np.sqrt(np.maximum(square / count - mean**2, 0.0) / turns), wall)


@dataclass(frozen=True, eq=False)
class AboutAir:
    """A dynamometer record, its ``zero`` (3,) N in the air, and where in it the steady cut is."""

    record: LongRecord
    zero: Array
    steady: slice


def about_air(batch: Batch, run: str, read: Tables, wall: Wall) -> AboutAir | Refusal:
    """Take the zero of a record from where the tool is in the air, if it is anywhere."""
    row: Any = batch.runs.loc[run]
    record = LongRecord(read, run)
    if record.samples < 2:
        return Refusal("no dynamometer record")
    turns = record.turns(record.rate * 60.0 / row["spindle_rpm"])
    try:
        found = steady.segments(turns, round(record.rate * wall.leaving / cutting_force.feed(batch, run)))
    except ValueError as error:
        return Refusal(str(error))
    zero = turns.mean[found.quiet].mean(axis=0) if found.quiet.any() else np.zeros(3)
    return AboutAir(record, zero, found.steady)


def from_coefficients(
    batch: Batch, run: str, identified: JSON, wall: Wall, give: Callable[[Array], float]
) -> pd.DataFrame | Refusal:
    """Mean force by the cutting law, constant along the wall.

    A tool that yields cuts less: the radial depth is the nominal one less ``give(force)``, how far (m) the
    wall stands proud under a force (3,) N, by fixed-point iteration (it converges as the give is a small part
    of the depth).
    """
    values = cutting_force.coefficients(batch, identified)
    if isinstance(values, Refusal):
        return values
    try:
        force = cutting_force.mean_force_on_tool(batch, run, values)
        for _ in range(ITERATIONS):
            force = cutting_force.mean_force_on_tool(batch, run, values, give(force))
    except ValueError as error:
        return Refusal(str(error))
    return _constant(force, SYSTEMATIC["coefficients"] * np.abs(force), wall)


def _constant(force: Array, sd: Array, wall: Wall) -> pd.DataFrame:
    end = wall.length - wall.leaving if math.isfinite(wall.length) else 1.0
    x = np.array([0.0, end])
    return _table(x, x, np.tile(force, (2, 1)), np.tile(sd, (2, 1)), np.full(2, np.nan))


def _table(s: Array, x: Array, force: Array, sd: Array, condition: Array) -> pd.DataFrame:
    columns = {"s_mm": s / MM, "x_mm": x / MM, **dict(zip(FORCE, force.T, strict=True))}
    columns |= {f"sd_{name}": values for name, values in zip(FORCE, sd.T, strict=True)}
    return pd.DataFrame({**columns, "condition_number": condition})
