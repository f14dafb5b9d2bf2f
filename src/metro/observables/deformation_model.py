"""The deformation model: how far the joints give way under the cutting force, and the tip strays by itself.

The wall at x stands proud by n · Σ_i j_i x_i: the force twists joint i by x_i, which moves the tip by j_i,
the column of its Jacobian; plus the tracking error of the tip along the wall's normal n (no unknown). Load
tests are the same sum without a cut. Joints that are linear springs, x_i = c_i T_i, make it linear in their
compliances; of others the model is linear about given compliances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from metro.observables.problem import Block, Parameter
from metro.robot.drive_torques import DriveTorques
from metro.robot.kinematics import Arm
from metro.robot.statics import joint_torque, moving_jacobian, tip_jacobian
from metro.robot.torsion import Torsion
from metro.structure import Structure
from metro.surface.profile import gaussian_filter
from metro.units import Array


@dataclass(frozen=True, eq=False)
class CutWall:
    """What a run's deformation follows from, at m points evenly spaced along the wall.

    Attributes
    ----------
    commanded, actual : (m, 6) joint angles of the log of the cut, rad. rate : (m, 6) their speeds, rad/s.
    force : (m, 3) on the tool, work frame, N. normal : (3,) of the wall, out of the material.
    spacing, cutoff : of the points and of the profile's filter, m. kept : (n,) points that are compared.
    """

    commanded: Array
    actual: Array
    rate: Array
    force: Array
    normal: Array
    spacing: float
    cutoff: float
    kept: np.ndarray


@dataclass(frozen=True, eq=False)
class LoadTest:
    """Static loads: joint angles (m, 6) rad, forces (m, 3) N, which displacements (m, 3) were measured."""

    joints: Array
    force: Array
    measured: np.ndarray


@dataclass(frozen=True, eq=False)
class KnownJoints:
    """Joint compliances that are known beforehand: the indices of the joints."""

    joints: np.ndarray


@dataclass(frozen=True, eq=False)
class DeformationModel:
    """Wall deformation of an arm with elastic joints.

    Attributes
    ----------
    arm : geometry: DH, tip in the flange, work in the base. The force acts on this tip, and this tip cuts;
        the path of the joints is that of the log, whichever tip it was programmed for.
    structure : stiffness in the cut relative to the load tests.
    flange_rotation : how much of what the flange turns moves the tip: all of it, in truth.
    torsion : what the joints do beyond linear springs.
    drives : friction that the idle run does not have, on the far side of the springs.
    drift : how far the tip has moved from one run to the next, work frame x and y, m.
    give : of what lies between flange and edge, in the cut: m of the wall per newton along its normal.
    """

    arm: Arm
    structure: Structure = field(default_factory=Structure)
    flange_rotation: float = 1.0
    torsion: Torsion = field(default_factory=Torsion)
    drives: DriveTorques = field(default_factory=DriveTorques)
    drift: tuple[float, float] = (0.0, 0.0)
    give: float = 0.0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Compliances of the joints, from the base up."""
        return tuple(Parameter(f"joint_compliance_{i + 1}", "rad/(N m)") for i in range(len(self.arm.dh)))

    def nuisance_starts(self, _block: Block) -> Array:
        """Return the one empty set of nonlinear unknowns, shape (1, 0)."""
        return np.zeros((1, 0))

    def design(self, block: Block, _nuisance: Array, beta: Array | None = None) -> tuple[Array, Array]:
        """Design matrix (n, 6), m per rad/(N m), and offset (n,), m, of a cut, load test or known joints."""
        setting: Any = block.setting
        about = np.zeros(len(self.arm.dh)) if beta is None else beta
        if isinstance(setting, CutWall):
            matrix, offset = self._cut(setting, about)
            return matrix, offset + block.order * float(setting.normal[:2] @ np.array(self.drift))
        if isinstance(setting, LoadTest):
            return self._loaded(setting, about)
        rows = np.eye(len(self.arm.dh))[setting.joints]
        return rows, np.zeros(len(rows))

    def torques(self, joints: Array, force: Array) -> Array:
        """Torque on the link of each joint that a force on the tip makes, (m, 6), N m."""
        return -joint_torque(tip_jacobian(self.arm, joints), force)

    def contributions(self, joints: Array, force: Array) -> Array:
        """Deflection of the tip per joint compliance, (m, 3, 6), work frame, by the load tests' stiffness."""
        moved = moving_jacobian(self.arm, joints, self.flange_rotation)
        return moved * self.torques(joints, force)[..., None, :]

    def deflection(self, setting: CutWall, compliance: Array) -> Array:
        """Deflection of the tip in the cut, (m, 3) m, work frame, for joint compliances (6,)."""
        moved, _ = _static(self.arm, self.flange_rotation, setting)
        return np.asarray(np.einsum("mai,mi->ma", moved, self.twists(setting, compliance)))

    def twists(self, setting: CutWall, compliance: Array) -> Array:
        """How far the joints are twisted in the cut, (m, 6) rad."""
        _, torque = _static(self.arm, self.flange_rotation, setting)
        return self.torsion.in_cut(self.structure.in_cut(torque), compliance)[0]

    def per_newton(self, setting: CutWall, compliance: Array) -> Array:
        """How far the wall stands proud per newton more in x, y and z where the tool cuts, (n, 3) m/N.

        By linear springs; the error of the force is taken to come and go along the wall as the force does.
        """
        moved, _ = _static(self.arm, self.flange_rotation, setting)
        at_tip = tip_jacobian(self.arm, setting.commanded)
        size = np.linalg.norm(setting.force, axis=1)
        share = size / max(float(size.max()), np.finfo(float).tiny)
        columns = np.einsum("m,a,mai,i,mbi->mb", share, setting.normal, moved, compliance, at_tip)
        return np.asarray(_filter(len(size), setting.spacing, setting.cutoff)[setting.kept] @ columns)

    def largest_twists(self, blocks: Sequence[Block]) -> tuple[Array, Array]:
        """Roughly how soft each joint is, (6,) rad/(N m), and the largest torsion of it in a batch, (6,) rad.

        By linear springs fitted to the evidence on the joints alone; one that this tells nothing of is taken
        to be a hundredth as soft as the softest.
        """
        rows = [self.design(block, np.zeros(0))[0] / block.sigma[:, None] for block in _calibrating(blocks)]
        right = [block.measured / block.sigma for block in _calibrating(blocks)]
        size = np.linalg.norm(matrix := np.vstack(rows), axis=0)
        scale = np.where(size > 0.0, size, 1.0)
        found = np.linalg.lstsq(matrix / scale, np.concatenate(right), rcond=1e-6)[0] / scale
        compliance = np.maximum(found, 0.01 * found.max())
        settings: list[Any] = [block.setting for block in blocks]
        forced = [one for one in settings if isinstance(one, CutWall | LoadTest)]
        torque = np.vstack([_static(self.arm, self.flange_rotation, one)[1] for one in forced])
        return compliance, np.abs(torque).max(axis=0) * compliance

    def _cut(self, setting: CutWall, compliance: Array) -> tuple[Array, Array]:
        out, torque = _outwards(self.arm, self.flange_rotation, setting)
        twist, slope = self.torsion.in_cut(self.structure.in_cut(torque), compliance)
        held = self._held(setting)
        twist, slope = twist - held * compliance, slope - held
        # what the profile was filtered by, the prediction is filtered by: at the entry that matters
        smooth = _filter(len(out), setting.spacing, setting.cutoff)[setting.kept]
        rest = (out * (twist - slope * compliance)).sum(axis=1) + _strayed(self.arm, setting)
        rest = rest + self.give * (setting.force @ setting.normal)
        return smooth @ (out * slope), smooth @ rest

    def _held(self, setting: CutWall) -> Array:
        """Torque (m, 6), N m, that friction keeps from the springs in the cut, as stiff as in load tests."""
        friction = self.drives.at(setting.commanded, setting.rate, np.zeros(len(setting.rate)))
        return np.asarray(self.structure.in_cut(friction) / np.array(self.torsion.factor))

    def _loaded(self, setting: LoadTest, compliance: Array) -> tuple[Array, Array]:
        moved, torque = _static(self.arm, self.flange_rotation, setting)
        twist, slope = self.torsion.at_rest(torque, compliance)
        rest = np.einsum("mai,mi->ma", moved, twist - slope * compliance)
        return (moved * slope[:, None, :])[setting.measured], rest[setting.measured]


def _calibrating(blocks: Sequence[Block]) -> list[Block]:
    return [block for block in blocks if block.role == "calibrate"]


@lru_cache(maxsize=1024)
def _static(arm: Arm, flange_rotation: float, setting: CutWall | LoadTest) -> tuple[Array, Array]:
    """Where a turn of each joint takes the tip (m, 3, 6), and the torques of the force on it (m, 6)."""
    joints = setting.commanded if isinstance(setting, CutWall) else setting.joints
    torque = -joint_torque(tip_jacobian(arm, joints), setting.force)
    return moving_jacobian(arm, joints, flange_rotation), torque


@lru_cache(maxsize=1024)
def _outwards(arm: Arm, flange_rotation: float, setting: CutWall) -> tuple[Array, Array]:
    """How far a turn of each joint takes the tip out of the wall (m, 6), and the torques of the force."""
    moved, torque = _static(arm, flange_rotation, setting)
    return np.einsum("a,mai->mi", setting.normal, moved), torque


@lru_cache(maxsize=256)
def _strayed(arm: Arm, setting: CutWall) -> Array:
    """Tracking error of the tip along the wall's normal, (m,) m."""
    return np.asarray((arm.tip(setting.actual) - arm.tip(setting.commanded)) @ setting.normal)


@lru_cache(maxsize=32)
def _filter(points: int, spacing: float, cutoff: float) -> Array:
    """Return the filter of the profile as a matrix (points, points)."""
    return gaussian_filter(np.eye(points), spacing, cutoff)
