"""The deformation model: how far the joints give way under the cutting force, and the tip strays by itself.

Linear in the six joint compliances: the wall at x stands proud by n · Σ_i c_i ∂δ/∂c_i (force), plus the
tracking error of the tip along the wall's normal n (no unknown). Load tests are the same sum without a cut.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from metro.observables.problem import Block, Parameter
from metro.robot.kinematics import Arm
from metro.robot.statics import joint_contributions
from metro.structure import Structure
from metro.surface.profile import gaussian_filter
from metro.units import Array


@dataclass(frozen=True, eq=False)
class CutWall:
    """What a run's deformation follows from, at m points evenly spaced along the wall.

    Attributes
    ----------
    commanded, actual : (m, 6) joint angles of the log of the cut, rad.
    force : (m, 3) on the tool, work frame, N. normal : (3,) of the wall, out of the material.
    spacing, cutoff : of the points and of the profile's filter, m. kept : (n,) points that are compared.
    """

    commanded: Array
    actual: Array
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
    arm : geometry: DH, tip in the flange, work in the base.
    structure : stiffness in the cut relative to the load tests.
    flange_rotation : whether the tip also moves because the flange turns, as it does in truth.
    """

    arm: Arm
    structure: Structure = field(default_factory=Structure)
    flange_rotation: bool = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Compliances of the joints, from the base up."""
        return tuple(Parameter(f"joint_compliance_{i + 1}", "rad/(N m)") for i in range(len(self.arm.dh)))

    def nuisance_starts(self, _block: Block) -> Array:
        """Return the one empty set of nonlinear unknowns, shape (1, 0)."""
        return np.zeros((1, 0))

    def design(self, block: Block, _nuisance: Array, _beta: Array | None = None) -> tuple[Array, Array]:
        """Design matrix (n, 6), m per rad/(N m), and offset (n,), m, of a cut, load test or known joints."""
        setting: Any = block.setting
        if isinstance(setting, CutWall):
            return self._cut(setting)
        if isinstance(setting, LoadTest):
            rows = self.contributions(setting.joints, setting.force)[setting.measured]
        else:
            rows = np.eye(len(self.arm.dh))[setting.joints]
        return rows, np.zeros(len(rows))

    def contributions(self, joints: Array, force: Array) -> Array:
        """Deflection of the tip per joint compliance, (m, 3, 6), work frame, by the load tests' stiffness."""
        return joint_contributions(self.arm, joints, force, flange_rotation=self.flange_rotation)

    def deflection(self, setting: CutWall, compliance: Array) -> Array:
        """Deflection of the tip in the cut, (m, 3) m, work frame, for joint compliances (6,)."""
        return self.structure.in_cut(self.contributions(setting.commanded, setting.force) @ compliance)

    def _cut(self, setting: CutWall) -> tuple[Array, Array]:
        rows = np.einsum("a,mai->mi", setting.normal, self.contributions(setting.commanded, setting.force))
        strayed = (self.arm.tip(setting.actual) - self.arm.tip(setting.commanded)) @ setting.normal
        # what the profile was filtered by, the prediction is filtered by: at the entry that matters
        columns = np.column_stack([self.structure.in_cut(rows), strayed])
        smooth = gaussian_filter(columns, setting.spacing, setting.cutoff)[setting.kept]
        return smooth[:, :-1], smooth[:, -1]
