"""Deflection of an arm under the mean force of a side cut: the tool leaves the wall proud and cuts less."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.arm import tip_force
from metro.observables.arm.load_tests import (
    best_compliance,
    joint_places,
    largest_loads,
    usable,
    with_best_tip,
)
from metro.observables.arm.no_arm import no_arm
from metro.observables.arm.tip_force import Log
from metro.observables.arm.wall import Wall, wall
from metro.observables.arm.wall_profile import in_one_pose
from metro.observables.deformation.blocks import SOFTER, TWISTED
from metro.observables.deformation.model import DeformationModel
from metro.observables.problem import Refusal
from metro.robot.kinematics import arm_of_cell
from metro.robot.statics import moving_jacobian
from metro.units import Array


@dataclass(frozen=True, eq=False)
class GivingArm:
    """An arm as it is known before any cut: its model, load tests, and joint compliances (n,) rad/(N m).

    ``tested``: the model with the tip where the load tests put it, which the compliances belong to. How far
    that tip gives way is what they measured, wherever the tip was declared, and with it the path.
    """

    model: DeformationModel
    loads: pd.DataFrame
    compliance: Array
    tested: DeformationModel

    def log(self, batch: Batch, run: str, cut: Log, face: Wall) -> Log | Refusal:
        """Return the log of the arm in a cut; without a log, the pose is that of the run's load tests."""
        if len(cut.tip):
            return cut
        rows = self.loads[self.loads["pose"] == batch.runs.loc[run, "pose"]]
        if rows.empty:
            return Refusal("no robot_log, and no load test in its pose: the pose of the arm is not known")
        return in_one_pose(joint_places(rows, self.model.arm)[0], face, self.model.arm)

    def give(self, log: Log | Refusal, face: Wall, force: Array) -> float:
        """Height by which the wall is proud under a force on the tip (3,) N, in the middle of the cut, m.

        It is zero if the pose of the arm is not known, or if there is no single wall.
        """
        if isinstance(log, Refusal) or not face.normal.any():
            return 0.0
        middle = log.commanded[len(log.commanded) // 2]
        return float(face.normal @ self.tested.contributions(middle, force) @ self.compliance)

    def give_sd(self, log: Log | Refusal, face: Wall, force: Array) -> float:
        """Return by how much the wall may be prouder than :meth:`give` says, or less so, m.

        A cut turns the joints less far than load tests do, where gears are softer and have passed less of
        their lost motion. All gears are: what that makes of the joints adds up.
        """
        if isinstance(log, Refusal) or not face.normal.any():
            return 0.0
        middle, largest = log.commanded[len(log.commanded) // 2], largest_loads(self.tested, self.loads)
        moved = face.normal @ moving_jacobian(self.tested.arm, middle, self.tested.flange_rotation)
        torque = self.tested.torques(middle, force)
        twist, more = self.compliance * torque, np.zeros(len(torque))
        if len(largest):
            gears = replace(self.tested, springs=tuple(self.compliance), loaded=tuple(largest))
            more = gears.lost(torque) - twist
        return float(np.abs(moved) @ np.hypot(SOFTER * twist, TWISTED * more))


class Give(NamedTuple):
    """By how much a run's wall is proud: per newton along x, y, z of the work, (3,) m/N; its error, m."""

    per_newton: Array
    sd: float


def giving_arm(batch: Batch, read: Tables) -> GivingArm | Refusal:
    """Return the arm of a batch's cell."""
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal(no_arm(batch.cell))
    model, loads = DeformationModel(arm), usable(read("loads"), arm)
    tested, _ = with_best_tip(model, loads)
    return GivingArm(model, loads, best_compliance(batch, tested, loads), tested)


def give_of(batch: Batch, run: str, read: Tables, arm: GivingArm | Refusal, force: Array) -> Give:
    """Return how far a wall is proud under a mean force (3,) N.

    It is zero on a machine without an arm. The give is linear in the mean force, and the prediction changes
    by a few per cent with it.
    """
    if isinstance(arm, Refusal):
        return Give(np.zeros(3), 0.0)
    face = wall(batch, run)
    cut, _ = tip_force.logs(read("robot", run), arm.model.arm)
    log = arm.log(batch, run, cut, face)
    per_newton = np.array([arm.give(log, face, newton) for newton in np.eye(3)])
    return Give(per_newton, arm.give_sd(log, face, force) if np.isfinite(force).all() else 0.0)
