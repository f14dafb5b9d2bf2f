"""What the idle runs of a batch say of its arm: the friction of its joints, and what its links weigh."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import Axes
from metro.observables.arm.load_tests import joint_places
from metro.observables.problem import Refusal
from metro.robot.friction import Friction, of_idle_runs
from metro.robot.kinematics import Geometry, arm_of_cell, prismatic
from metro.robot.motion import Motion
from metro.robot.rigid_body import gravity_regressor
from metro.same import Same
from metro.units import DEG, Array

LEAST_SAMPLES = 100
NEAR = 2.0 * DEG  # of a joint from the idle runs, where the weight is known that these determine


@lru_cache(maxsize=1)
def of_idle_logs(batch: Same[Batch], read: Same[Tables]) -> tuple[Friction, Motion] | Refusal:
    """Identify the friction of all idle runs together; with their motion. It is asked for several times."""
    arm = arm_of_cell(batch.value.cell, batch.value.manifest)
    if arm is None:
        return Refusal("")  # without an arm there is nothing to report as missing
    table = read.value("robot")
    idle = [rows for _, rows in table[table["log"] == "idle"].groupby("run") if len(rows) >= LEAST_SAMPLES]
    if not idle:
        return Refusal("no run has an idle_log")
    runs = [(r["t_s"].to_numpy(), joint_places(r, arm), _torques(r, arm.axes)) for r in idle]
    try:
        return of_idle_runs(arm.dh, runs)
    except ValueError as error:
        return Refusal(f"idle runs: {error}")


def carried_weight(found: tuple[Friction, Motion] | Refusal, dh: Geometry, q: Array) -> Array:
    """Return the torque of the arm's own weight on the link of each joint along a path (m, n), N m.

    Only how it changes along paths near those of the idle runs is known: its level is one with the offset of
    friction, and elsewhere what these do not determine would count. Zero where no idle run shows it, and on
    linear axes, whose drives are not evaluated.
    """
    if isinstance(found, Refusal) or not _near(found[1].angle, q):
        return np.zeros(q.shape)
    held = gravity_regressor(dh, q) @ found[0].others
    return np.asarray(np.where(prismatic(dh), 0.0, -held))


def _near(idle: Array, q: Array) -> bool:
    """Whether every point of a path (m, n) is near some place of the idle runs (k, n), joint by joint."""
    from scipy.spatial import KDTree

    return bool((KDTree(idle).query(q, p=np.inf)[0] < NEAR).all())


def _torques(log: pd.DataFrame, axes: Axes) -> Array:
    """Torques of all joints (m, n), N m; zero of a linear axis, whose drive is not evaluated."""
    torque = np.zeros((len(log), len(axes)))
    torque[:, axes.turning] = log[axes.torques].to_numpy(dtype=float)
    return torque
