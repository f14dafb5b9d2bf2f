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
from metro.observables.arm.wall import Wall
from metro.observables.cut import conditions as cutting_force
from metro.observables.cut.long_record import LongRecord, Stretch
from metro.observables.problem import Refusal
from metro.robot.drive_torques import TURNING
from metro.robot.joint_dynamics import low_passed
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
from metro.robot.statics import driven_jacobian
from metro.signals import align, steady
from metro.signals.intervals import uneven
from metro.signals.kalman import noise_variance
from metro.signals.path_match import match
from metro.signals.waves import wandering, waves
from metro.units import JSON, MM, Array

Read = Callable[..., pd.DataFrame]
FORCE = ["fx_n", "fy_n", "fz_n"]
NO_SET_POINTS = "the robot log has no set-points (q1_set_deg …): how far the tip strayed is not known"
BIN = 1 * MM
LEAST_BINS = 5
ITERATIONS = 6
REPEATABLE = 0.1  # of the torque's noise: how well the friction of the cut is that of the idle run
LEAST_NOISE = 1e-3  # N m: floor for a log whose digits are coarser than its noise

# Relative error that all runs may share, by the source of the force: friction that differs from the idle run;
# gain, crosstalk and mounting of the dynamometer; a radial depth that is not nominal, because the tool
# yields. A dynamometer of a machining cell has gains that are off by 0.5 to 2 % (rms 1.3), reads 0.5 to 3 %
# of each other axis in an axis (1.9), and is turned by 0.2 to 2° (2.1 % of each other axis): of a force of no
# preferred direction, the rms error of an axis is √((1.3² + 2·1.9² + 2·2.1²)/3) = 2.4 % of the whole force.
# Coefficients were fitted to such a dynamometer, and the depth adds 3 %.
SYSTEMATIC = {"torque": 0.05, "dynamometer": 0.024, "coefficients": 0.038}


@dataclass(frozen=True, eq=False)
class Log:
    """The moving part of a robot log of m samples: commanded tip (m, 3) m, and what the joints did.

    ``commanded``, ``actual`` (m, n): of all joints, rad, or m of a linear axis. ``torque`` (m, k) N m: of
    the k joints that turn. ``time`` (m,) s by the dynamometer's clock; empty if there is none. ``followed``:
    whether set-points were logged; else ``commanded`` are the measured angles, smoothed.
    """

    commanded: Array
    actual: Array
    torque: Array
    tip: Array
    time: Array = field(default_factory=lambda: np.zeros(0))
    followed: bool = True

    @property
    def interval(self) -> Array | None:
        """Intervals of the clock over their median; None where it is even."""
        return uneven(self.time)


def logs(table: pd.DataFrame, arm: Arm) -> tuple[Log, Log]:
    """Return the log of the cut and that of the idle run; a log that does not exist is empty."""
    idle = (table["log"] == "idle").to_numpy()
    return _log(table[~idle], arm), _log(table[idle], arm)


def _log(table: pd.DataFrame, arm: Arm) -> Log:
    axes = arm.axes
    actual = table[axes.positions].to_numpy(dtype=float) * axes.units
    commanded, given = table[axes.commanded].to_numpy(dtype=float) * axes.units, True
    if len(table) and not np.isfinite(commanded).all():
        commanded, given = low_passed(table["t_s"].to_numpy(dtype=float), actual), False
    tip = arm.tip(commanded)
    moves = align.moving(tip) if len(tip) > 2 else np.zeros(len(tip), dtype=bool)
    torque = table[axes.torques].to_numpy(dtype=float)
    time = table["t_s"].to_numpy(dtype=float)
    return Log(commanded[moves], actual[moves], torque[moves], tip[moves], time[moves], given)


@dataclass(frozen=True, eq=False)
class Sensorless:
    """The force on the tip of a run, estimated from the torques of the joints over m bins of its path.

    Attributes
    ----------
    s, x : (m,) along the path, and along the wall from its start, m.
    steady, air : (m,) bool, where the tool is wholly in the work, and where it touches nothing.
    joints : (k,) that turn, from 1; their torques are those that follow.
    difference : (m, k) N m, torque of the cut less that of the idle run, by bins; ``torques``: smoothed.
    moves : (m, 3, k) Jacobian of the tip, m/rad.
    wander : (k,) level of the slow noise, N² m² (:mod:`metro.signals.waves`), estimated from the idle run.
    index : (k,) observability.
    solution : force; None if it could not be solved for, and ``refusal`` gives the reason. remarks : in which
        ways the idle run and the cut differ.
    """

    s: Array
    x: Array
    steady: np.ndarray
    air: np.ndarray
    joints: np.ndarray
    difference: Array
    moves: Array
    torques: Torques
    wander: Array
    index: Array
    solution: TipForce | None
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
        np.column_stack(
            [log.torque, log.commanded, log.tip @ wall.along - wall.start, turning_round(log, arm)]
        )
        for log in (cut, idle)
    ]
    clocks = cut.interval, idle.interval
    gaps = any(interval is not None for interval in clocks)
    try:
        pair = align.align(places[0], channels[0], places[1], channels[1], width, gaps=gaps)
    except ValueError as error:
        return Refusal(str(error))
    count, driven = len(arm.axes), len(arm.axes.turning)
    torque, turning = (slice(0, driven), slice(driven + count + 1, None))
    joints, x = pair.first[:, driven : driven + count], pair.first[:, driven + count]
    steady = wall.steady(x)
    if steady.sum() < LEAST_BINS:
        return Refusal(f"the logs hold {int(steady.sum())} mm of the cut; at least {LEAST_BINS} are needed")
    samples = (width / steps[0], width / steps[1])
    noise = noise_of_bins(cut.torque, idle.torque, samples, turning_round(idle, arm), clocks)
    noise = np.maximum(noise, LEAST_NOISE**2)
    white = np.maximum(noise_variance(idle.torque, clocks[1]), LEAST_NOISE**2) / samples[1]
    # The slow noise of the idle run is as large in the cut, where the force conceals it.
    interval = uneven(pair.s) if gaps else None
    wander = 2.0 * wandering(pair.second[:, torque], white, pair.second[:, turning], interval)
    phase, difference = wall.phase(x, width), (pair.first - pair.second)[:, torque]
    air = (phase % 2 == 0) & ~steady
    torques = smoothed_torque(difference, noise, phase, pair.s if gaps else None)
    index = observability(difference[steady], pair.second[steady, torque])
    remarks = tuple(alike.remarks(np.gradient(cut.commanded, cut.time, axis=0)))
    moves = driven_jacobian(arm, joints)
    solution, refusal = None, ""
    try:
        solution = tip_force(torques.level, torques.variance, moves, index, least_index)
    except ValueError as error:
        refusal = str(error)
    return Sensorless(
        pair.s,
        x,
        steady,
        air,
        np.array(arm.axes.turning) + 1,
        difference,
        moves,
        torques,
        wander,
        index,
        solution,
        refusal,
        remarks,
    )


def in_the_air(one: Sensorless, wander: Array) -> tuple[Array, Array] | None:
    """Mean (k,) of the torques in the air, N m, and its variance by the noise; None if no air was logged.

    ``wander`` (k,) is the level of the slow noise.
    """
    if not one.air.any():
        return None
    weights = one.air / one.air.sum()
    shares = waves(weights[:, None])[1:, 0] ** 2
    noise = one.torques.noise / one.air.sum() + wander * float((shares / np.arange(1, len(weights))).sum())
    return weights @ one.difference, noise


def turning_round(log: Log, arm: Arm) -> Array:
    """Which way the joints turn, (m, k): the shape of the Coulomb friction of those with a torque."""
    rate = np.gradient(log.commanded[:, arm.axes.turning], log.time, axis=0)
    return np.asarray(np.tanh(rate / TURNING))


def from_torques(
    cut: Log, idle: Log, arm: Arm, wall: Wall
) -> tuple[pd.DataFrame | Refusal, pd.DataFrame | None]:
    """Force along the path from the torques of the cut less those of the idle run, and observability.

    Returns
    -------
    tuple
        The force, ``s_mm, x_mm, fx_n … sd_fz_n, condition_number`` per bin, or the reason why there is none;
        and, if the logs could be aligned, ``joint, index, used, noise_nm, drift_nm, whiteness, remark`` per
        joint.
    """
    solved = sensorless(cut, idle, arm, wall)
    if isinstance(solved, Refusal):
        return solved, None
    solution = solved.solution
    per_joint = pd.DataFrame(
        {
            "joint": solved.joints,
            "index": solved.index,
            "used": solved.index >= LEAST_INDEX if solution is None else solution.used,
            "noise_nm": np.sqrt(solved.torques.noise),
            "drift_nm": np.sqrt(solved.torques.drift),
            "whiteness": solved.torques.whiteness,
            "remark": "; ".join(solved.remarks),
        }
    )
    if solution is None:
        return Refusal(solved.refusal), per_joint
    sd = np.sqrt(np.einsum("maa->ma", solution.covariance))
    return _table(solved.s, solved.x, solution.force, sd, solution.condition), per_joint


def from_dynamometer(batch: Batch, run: str, read: Tables, wall: Wall) -> pd.DataFrame | Refusal:
    """Mean force of the steady cut, constant along the wall; its zero is the signal in the air, if any."""
    about = about_air(batch, run, read, wall)
    if isinstance(about, Refusal):
        return about
    count, total, square = 0, np.zeros(3), np.zeros(3)
    for part in about.record.stretches(about.steady):
        signal = about.of(part)
        total, square = total + signal.sum(axis=0), square + (signal**2).sum(axis=0)
        count += len(signal)
    mean = total / count
    row: Any = batch.runs.loc[run]
    turns = count / about.record.rate * row["spindle_rpm"] / 60.0
    return _constant(mean, np.sqrt(np.maximum(square / count - mean**2, 0.0) / turns), wall)


@dataclass(frozen=True, eq=False)
class AboutAir:
    """A dynamometer record, its zero in the air, and the slice of the steady cut.

    ``zero`` (3,) N at the start of the record, ``drift`` (3,) N/s of it: none where there is air on one side
    of the cut alone.
    """

    record: LongRecord
    zero: Array
    drift: Array
    steady: slice

    def of(self, part: Stretch) -> Array:
        """Return the force (n, 3), N, of a stretch of the record."""
        since = part.time - self.record.start
        return np.asarray(part.signal - self.zero - since[:, None] * self.drift)


def about_air(batch: Batch, run: str, read: Tables, wall: Wall) -> AboutAir | Refusal:
    """Estimate the zero of a record from the samples in which the tool is in the air, if there are any."""
    if blank := cutting_force.unset(batch, run):
        return Refusal(blank)
    row: Any = batch.runs.loc[run]
    record = LongRecord(read, run)
    if record.samples < 2:
        return Refusal("no dynamometer record")
    turns = record.turns(record.rate * 60.0 / row["spindle_rpm"])
    try:
        segments = steady.segments(turns, round(record.rate * wall.leaving / cutting_force.feed(batch, run)))
    except ValueError as error:
        return Refusal(str(error))
    if not segments.quiet.any():
        return AboutAir(record, np.zeros(3), np.zeros(3), segments.steady)
    # An amplifier that drifts by a tenth of a newton a second is wrong by more than the noise after a path of
    # ten seconds.
    middle = 0.5 * (segments.steady.start + segments.steady.stop) / turns.length
    zero, drift = steady.zero_line(turns.mean, segments.quiet, middle)
    return AboutAir(record, zero, drift * record.rate / turns.length, segments.steady)


def from_coefficients(
    batch: Batch, run: str, identified: JSON, wall: Wall, give: Callable[[Array], float]
) -> pd.DataFrame | Refusal:
    """Mean force by the cutting law, constant along the wall.

    A tool that yields cuts less. The radial depth is the nominal one less ``give(force)``, the height (m) by
    which the wall is proud under a force (3,) N. Fixed-point iteration solves for it; it converges because
    the give is a small part of the depth.
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
