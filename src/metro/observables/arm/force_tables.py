"""Tables of the sensorless force: torques and joints of every run, the force along the path, its mean.

Tables ``robot_torques`` (of the cut beyond the idle run, by bin and smoothed), ``robot_aligned`` (one joint's
logs as they came, for the first run), ``robot_joints`` (observability, noise, whiteness), ``robot_force`` and
``robot_means`` (the force along the path, and its steady mean with that of the dynamometer, in the work's and
in the tool's frame), ``robot_refused``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.arm import tip_force
from metro.observables.arm.tip_force import FORCE, REPEATABLE, Log, Sensorless
from metro.observables.arm.wall import Wall, wall
from metro.observables.problem import Refusal
from metro.robot.kinematics import Arm
from metro.robot.sensorless import (
    LEAST_INDEX,
    LEAST_JOINTS,
    TipForce,
    beyond_noise,
    drive_shares,
    friction_repeatability,
    mean_force,
)
from metro.robot.sensorless import tip_force as tip_force_of
from metro.signals.kalman import noise_variance
from metro.signals.segmentation import knees
from metro.units import MM, Array

CALIBRATED = tip_force.SYSTEMATIC["dynamometer"]


@dataclass(frozen=True, eq=False)
class RunForce:
    """Torques of a run, or why there are none; the level of their noise, (k,) N m; the tool's axes.

    ``turn`` (3, 3): columns are the tool's axes in the work frame; None if the batch does not state them.
    """

    sensorless: Sensorless | Refusal
    noise: Array
    turn: Array | None


@dataclass(frozen=True, eq=False)
class Common:
    """What all runs of a batch share: how repeatable friction is, (k,) N m; the level of slow noise, (k,)."""

    friction: Array
    wander: Array


def logged_cuts(batch: Batch, read: Tables, arm: Arm) -> Iterator[tuple[str, Log, Log]]:
    """Yield the runs whose log moves, in the order of cutting: name, log of the cut, log of the idle run."""
    logged = set(read("robot")["run"].astype(str))
    for run in [str(r) for r in batch.runs.sort_values("order", kind="stable").index if str(r) in logged]:
        cut, idle = tip_force.logs(read("robot", run), arm)
        if len(cut.tip):
            yield run, cut, idle


def run_force(batch: Batch, cut: Log, idle: Log, arm: Arm, face: Wall) -> RunForce:
    """Return the torques of a run: of all joints, whatever their observability index is."""
    axes = batch.manifest.get("tool_axes_in_flange")
    middle = cut.commanded[len(cut.commanded) // 2]
    turn = None if axes is None else arm.flange_axes(middle) @ np.asarray(axes, dtype=float)
    noise = np.sqrt(noise_variance(cut.torque, cut.interval))
    return RunForce(tip_force.sensorless(cut, idle, arm, face, 0.0), noise, turn)


def force_tables(
    batch: Batch, read: Tables, solved: Mapping[str, RunForce], drives: Array
) -> dict[str, list[pd.DataFrame]]:
    """Return the tables of all runs together, which share the level of slow noise and of friction.

    ``drives`` (k, k): covariance of the relative errors of the torques.
    """
    shared = common(list(solved.values()))
    parts: dict[str, list[pd.DataFrame]] = {}
    for run, one in solved.items():
        if isinstance(one.sensorless, Refusal):
            tables = {"robot_refused": pd.DataFrame({"reason": [one.sensorless.reason]})}
        else:
            tables = _tables(one, one.sensorless, shared, drives, _measured(batch, run, read))
        for name, table in tables.items():
            parts.setdefault(name, []).append(table.assign(run=run))
    return parts


def common(runs: Sequence[RunForce]) -> Common:
    """Return the mean levels of slow noise and friction over all runs, of which one alone says little."""
    known = [(one.noise, one.sensorless) for one in runs if isinstance(one.sensorless, Sensorless)]
    if not known:
        return Common(np.zeros(0), np.zeros(0))
    wander = np.mean([sensorless.wander for _, sensorless in known], axis=0)
    least = REPEATABLE * np.sqrt(np.mean([noise**2 for noise, _ in known], axis=0))
    air = [means for _, one in known if (means := tip_force.in_the_air(one, wander)) is not None]
    if not air:
        return Common(least, wander)
    mean, variance = (np.array(values) for values in zip(*air, strict=True))
    return Common(friction_repeatability(mean, variance, least), wander)


def force_of_all(one: Sensorless, shared: Common) -> TipForce:
    """Solve for the force from all joints, each weighted by its noise and by how repeatable its friction is.

    Raises
    ------
    ValueError
        If the joints do not determine all three axes.
    """
    variance = beyond_noise(one.torques.variance, shared.friction, shared.wander)
    return tip_force_of(one.torques.level, variance, one.moves, one.index, 0.0)


def _tables(
    run: RunForce, one: Sensorless, shared: Common, drives: Array, measured: tuple[Array, Array]
) -> dict[str, pd.DataFrame]:
    """Tables of a run whose steady mean is ``measured`` (3,), covariance (3, 3), by a dynamometer."""
    joints = pd.DataFrame(
        {
            "joint": one.joints,
            "index": one.index,
            "threshold": LEAST_INDEX,
            "used": False,
            "noise_nm": np.sqrt(one.torques.noise),
            "drift_nm": np.sqrt(one.torques.drift),
            "friction_nm": shared.friction,
            "whiteness": one.torques.whiteness,
            "remark": "; ".join(one.remarks),
        }
    )
    tables = {"robot_joints": joints, "robot_torques": _torques(one)}
    try:
        solution = force_of_all(one, shared)
    except ValueError as error:
        return tables | {"robot_refused": pd.DataFrame({"reason": [str(error)]})}
    joints["used"] = solution.used
    names = knees(one.x, solution.force).names(one.x)
    course = pd.DataFrame({"x_mm": one.x / MM, "part": names})
    course[FORCE] = solution.force
    course[[f"sd_{name}" for name in FORCE]] = np.sqrt(np.einsum("maa->ma", solution.covariance))
    mean = mean_force(solution, one.torques, one.steady, shared.friction, shared.wander)
    enough = bool((one.index >= LEAST_INDEX).sum() >= LEAST_JOINTS)
    shares = drive_shares(solution, one.torques, one.steady)
    means = _means(mean, measured, shares @ drives @ shares.T, run.turn).assign(
        enough=enough, condition=float(solution.condition.max())
    )
    return tables | {"robot_force": course, "robot_means": means}


def _torques(sensorless: Sensorless) -> pd.DataFrame:
    """Torque of the cut beyond the idle run, bin by bin and smoothed, joint after joint."""
    count = len(sensorless.x)
    return pd.DataFrame(
        {
            "joint": np.repeat(sensorless.joints, count),
            "x_mm": np.tile(sensorless.x / MM, len(sensorless.joints)),
            "bin_nm": sensorless.difference.T.ravel(),
            "level_nm": sensorless.torques.level.T.ravel(),
            "level_sd_nm": np.sqrt(sensorless.torques.variance).T.ravel(),
        }
    )


def _measured(batch: Batch, run: str, read: Tables) -> tuple[Array, Array]:
    """Steady mean (3,) of the dynamometer and its covariance (3, 3); NaN if there is none."""
    record = tip_force.from_dynamometer(batch, run, read, wall(batch, run))
    if isinstance(record, Refusal):
        return np.full(3, np.nan), np.full((3, 3), np.nan)
    mean = record[FORCE].to_numpy(dtype=float)[0]
    own = record[[f"sd_{name}" for name in FORCE]].to_numpy(dtype=float)[0]
    return mean, np.diag(own**2 + (CALIBRATED * mean) ** 2)


def _means(
    estimated: tuple[Array, Array], measured: tuple[Array, Array], drives: Array, turn: Array | None
) -> pd.DataFrame:
    """Mean force of the steady cut with standard errors, by frame and axis, as estimated and as measured.

    ``drives`` (3, 3) N²: what the drives' constants add to the covariance of the estimate.
    """
    frames = {"work": np.eye(3)} | ({} if turn is None else {"tool": turn})
    parts = []
    for name, axes in frames.items():
        table = pd.DataFrame({"frame": name, "axis": list("xyz")})
        for source, (mean, covariance) in (("sensorless", estimated), ("dynamometer", measured)):
            table[f"{source}_n"] = mean @ axes
            table[f"{source}_sd_n"] = np.sqrt(np.diag(axes.T @ covariance @ axes))
        table["drives_sd_n"] = np.sqrt(np.diag(axes.T @ drives @ axes))
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


def aligned(cut: Log, idle: Log, face: Wall, joint: int, place: int) -> pd.DataFrame:
    """Return the torque of a joint in both logs over time and over the place along the wall.

    ``place``: of the joint among those with a torque, from 0.
    """
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "log": name,
                    "joint": joint,
                    "t_s": log.time - cut.time[0],
                    "x_mm": (log.tip @ face.along - face.start) / MM,
                    "torque_nm": log.torque[:, place],
                }
            )
            for name, log in (("cut", cut), ("idle", idle))
        ],
        ignore_index=True,
    )
