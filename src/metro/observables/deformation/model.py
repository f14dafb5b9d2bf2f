"""The deformation model: the twist of the joints under the cutting force, and the tip's tracking error.

The wall at x is proud by n · Σ_i j_i x_i. The force twists joint i by x_i, which moves the tip by j_i, the
column of its Jacobian. The tracking error of the tip along the wall's normal n is added; it has no unknown.
Load tests are the same sum without a cut. Joints that are linear springs, x_i = c_i T_i, make the sum linear
in their compliances; with other joints the model is linear about given compliances.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from metro.observables.deformation.along_wall import outwards, profile_filter, static, strayed
from metro.observables.deformation.setting import CutWall, LoadTest
from metro.observables.problem import Block, Parameter
from metro.robot.drive_torques import DriveTorques
from metro.robot.kinematics import Arm
from metro.robot.statics import joint_torque, moving_jacobian, tip_jacobian
from metro.robot.torsion import Torsion
from metro.structure import Structure
from metro.units import UM, Array

WALL_ZERO = "wall_zero"
LOST_MOTION = "lost_motion_joint_"
GEAR_WAVE = "gear_wave_"
STRAIGHT = "straight_joint_"
PASSED = 0.2  # of a joint's largest load: where its lost motion is passed
AXES = "xyz"


@dataclass(frozen=True, eq=False)
class DeformationModel:
    """Wall deformation of an arm with elastic joints.

    Attributes
    ----------
    arm : geometry: DH, tip in the flange, work in the base. The force acts on this tip, and this tip cuts;
        the path of the joints is that of the log, whichever tip it was programmed for.
    structure : stiffness in the cut relative to the load tests.
    flange_rotation : share of the flange's rotation that moves the tip; physically it is 1.
    torsion : deviations of the joints from linear springs.
    drives : friction that the idle run does not have, on the far side of the springs.
    drift : displacement of the tip from one run to the next, work frame x and y, m.
    give : compliance between flange and edge in the cut: m of the wall per newton along its normal.
    touched : whether all walls share an error of their zero: the touch on the work, and the tool's radius.
    forces : sources of the force on the walls. Walls of one source share its errors, along each work axis.
    springs : compliances of the joints by the load tests alone. Those in the cut may deviate from them, since
        a gear is softer where it is twisted less. Empty where they do not.
    loaded : largest torque of the load tests on each joint, N m. Empty where no lost motion is believed.
    waves : how many waves of the gears all walls share (:mod:`metro.observables.deformation.gear_waves`).
    """

    arm: Arm
    structure: Structure = field(default_factory=Structure)
    flange_rotation: float = 1.0
    torsion: Torsion = field(default_factory=Torsion)
    drives: DriveTorques = field(default_factory=DriveTorques)
    drift: tuple[float, float] = (0.0, 0.0)
    give: float = 0.0
    touched: bool = False
    forces: tuple[str, ...] = ()
    springs: tuple[float, ...] = ()
    loaded: tuple[float, ...] = ()
    waves: int = 0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Compliances of the joints, from the base up, and what is believed of beforehand."""
        units = ["m/N" if linear else "rad/(N m)" for linear in self.arm.axes.linear]
        joints = (Parameter(f"joint_compliance_{i + 1}", unit) for i, unit in enumerate(units))
        return (*joints, *self.believed)

    @property
    def believed(self) -> tuple[Parameter, ...]:
        """By how much each joint is softer in the cut, its lost motion, common errors, what does not harden.

        The lost motion is relative to the joint's twist under the largest load. Common are the zero of all
        walls, errors of the force relative to its size, for each of its sources along the work axes, and the
        waves of the gears. Where a joint hardens, its link and its seat do not: a share of its compliance.
        """
        softer = [Parameter(f"softer_joint_{i + 1}", "%", 0.01) for i in range(len(self.springs))]
        lost = [Parameter(f"{LOST_MOTION}{i + 1}", "%", 0.01) for i in range(len(self.loaded))]
        zero = [Parameter(WALL_ZERO, "um", UM)] if self.touched else []
        force = itertools.product(self.forces, AXES)
        waves = (Parameter(f"{GEAR_WAVE}{i + 1}", "1") for i in range(self.waves))
        straight = (Parameter(f"{STRAIGHT}{i + 1}", "%", 0.01) for i in range(len(self.springs)))
        return (
            *softer,
            *lost,
            *zero,
            *(Parameter(f"force_off_{source}_{axis}", "%", 0.01) for source, axis in force),
            *waves,
            *straight,
        )

    def compliance(self, beta: Array) -> Array:
        """Return the compliances of the joints in load tests, (n,), among the base parameters."""
        return beta[: len(self.arm.dh)]

    def in_cut(self, beta: Array) -> Array:
        """Return the compliances of the joints in the cut, (n,), by the base parameters."""
        count = len(self.springs)
        return self.compliance(beta) + (np.array(self.springs) * beta[count : 2 * count] if count else 0.0)

    def straight(self, beta: Array) -> Array:
        """Return the share of each joint's compliance that does not harden, (n,), by the base parameters."""
        count = len(self.springs)
        return beta[len(beta) - count :] if count else np.zeros(len(self.arm.dh))

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints that effects of one joint may belong to."""
        return tuple(range(len(self.arm.dh)))

    def nuisance_starts(self, _block: Block) -> Array:
        """Return the one empty set of nonlinear unknowns, shape (1, 0)."""
        return np.zeros((1, 0))

    def design(self, block: Block, _nuisance: Array, beta: Array | None = None) -> tuple[Array, Array]:
        """Design matrix (n, p), m per base parameter, and offset (n,), m, of a cut, load test or belief."""
        setting: Any = block.setting
        about = np.zeros(len(self.parameters)) if beta is None else beta
        if isinstance(setting, CutWall):
            matrix, straight, offset = self._cut(setting, self.in_cut(about), self.straight(about))
            offset = offset + block.order * float(setting.normal[:2] @ np.array(self.drift))
            softer = [matrix * np.array(self.springs)] if self.springs else []
            common = self._lost_in_cut(setting), self._off(setting)
            return np.hstack([matrix, *softer, *common, straight]), offset
        if isinstance(setting, LoadTest):
            matrix, straight, offset = self._loaded(setting, self.compliance(about), self.straight(about))
            own = matrix, np.zeros((len(matrix), len(self.springs))), self._lost_in_test(setting)
            common = len(self.parameters) - sum(part.shape[1] for part in (*own, straight))
            return np.hstack([*own, np.zeros((len(matrix), common)), straight]), offset
        rows = np.eye(len(self.parameters))[setting.places]
        return rows, np.zeros(len(rows))

    def lost(self, torque: Array) -> Array:
        """Return the way of each joint, (…, n) rad, if its lost motion is its twist under its largest load.

        A gear is softer up to some fraction of its load; beyond that, it has only passed a way that the
        others have not.
        """
        if not self.loaded:
            return np.zeros((len(torque), 0))
        largest = np.array(self.loaded)
        share = np.tanh(torque / np.where(largest > 0.0, PASSED * largest, 1.0))
        return np.asarray(np.array(self.springs) * largest * share)

    def _lost_in_test(self, setting: LoadTest) -> Array:
        """Return what load tests gain by that way, (n, k) m."""
        moved, torque = static(self.arm, self.flange_rotation, setting)
        lost = self.lost(torque)
        return np.asarray((moved[..., : lost.shape[1]] * lost[:, None, :])[setting.measured])

    def _lost_in_cut(self, setting: CutWall) -> Array:
        """Return what a wall gains by that way, (n, k) m."""
        out, torque = outwards(self.arm, self.flange_rotation, setting)
        lost = self.lost(self.structure.in_cut(torque) / self.torsion.factors(torque.shape[1]))
        smooth = profile_filter(len(out), setting.spacing, setting.cutoff)[setting.kept]
        return np.asarray(smooth @ (out[:, : lost.shape[1]] * lost))

    def _off(self, setting: CutWall) -> Array:
        """Return what a wall gains per unit of its zero, of what the force is off, and of the waves, (n, k).

        That of the force holds for the compliances of the load tests alone, so that it is linear in the base
        parameters.
        """
        zero = np.ones((len(setting.kept), int(self.touched)))
        harder = np.zeros((len(zero), len(AXES))) if setting.harder is None else setting.harder
        waves = np.zeros((len(zero), self.waves)) if setting.waves is None else setting.waves
        return np.hstack([zero, *(harder * (source == setting.source) for source in self.forces), waves])

    def believed_force(self, setting: CutWall, beta: Array) -> CutWall:
        """Return the wall with the force that the base parameters say, instead of the one that was read."""
        if setting.source not in self.forces:
            return setting
        before = len(self.arm.dh) + len(self.springs) + len(self.loaded) + int(self.touched)
        first = before + len(AXES) * self.forces.index(setting.source)
        size = np.linalg.norm(setting.force, axis=1)
        return replace(setting, force=setting.force + np.outer(size, beta[first : first + len(AXES)]))

    def torques(self, joints: Array, force: Array) -> Array:
        """Torque on the link of each joint that a force on the tip makes, (m, n), N m."""
        return -joint_torque(tip_jacobian(self.arm, joints), force)

    def contributions(self, joints: Array, force: Array) -> Array:
        """Deflection of the tip per joint compliance, (m, 3, n), work frame, by the load tests' stiffness."""
        moved = moving_jacobian(self.arm, joints, self.flange_rotation)
        return moved * self.torques(joints, force)[..., None, :]

    def deflection(self, setting: CutWall, beta: Array) -> Array:
        """Deflection of the tip in the cut, (m, 3) m, work frame, by the base parameters."""
        moved, _ = static(self.arm, self.flange_rotation, setting)
        return np.asarray(np.einsum("mai,mi->ma", moved, self.twists(setting, beta)))

    def twists(self, setting: CutWall, beta: Array) -> Array:
        """Twist of the joints in the cut, (m, n) rad, by the base parameters."""
        _, torque = static(self.arm, self.flange_rotation, setting)
        given = self.in_cut(beta), self.straight(beta)
        return self.torsion.in_cut(self.structure.in_cut(torque), *given).angle

    def per_newton(self, setting: CutWall, compliance: Array) -> Array:
        """Height by which the wall is proud per additional newton in x, y and z at the tool, (n, 3) m/N.

        The joints are linear springs here. The error of the force is assumed to vary along the wall as the
        force does.
        """
        moved, _ = static(self.arm, self.flange_rotation, setting)
        at_tip = tip_jacobian(self.arm, setting.commanded)
        size = np.linalg.norm(setting.force, axis=1)
        share = size / max(float(size.max()), np.finfo(float).tiny)
        columns = np.einsum("m,a,mai,i,mbi->mb", share, setting.normal, moved, compliance, at_tip)
        return np.asarray(profile_filter(len(size), setting.spacing, setting.cutoff)[setting.kept] @ columns)

    def outwards(self, setting: CutWall) -> Array:
        """Return how far a turn of each joint moves the tip out of the wall along its path, (m, n) m/rad."""
        return outwards(self.arm, self.flange_rotation, setting)[0]

    def per_radian(self, setting: CutWall) -> Array:
        """Height of the wall, (n,) m/rad, that turns of all joints make, each by itself: root of squares."""
        height = np.linalg.norm(self.outwards(setting)[:, self.arm.axes.turning], axis=1)
        return np.asarray(profile_filter(len(height), setting.spacing, setting.cutoff)[setting.kept] @ height)

    def largest_twists(self, blocks: Sequence[Block]) -> tuple[Array, Array]:
        """Approximate compliance of each joint, (n,) rad/(N m), and its largest torsion in a batch, (n,) rad.

        Linear springs are fitted to the evidence on the joints alone. A joint without evidence is taken to
        have at least a hundredth of the largest compliance.
        """
        rows = [
            self.compliance(self.design(block, np.zeros(0))[0].T).T / block.sigma[:, None]
            for block in _calibrating(blocks)
        ]
        right = [block.measured / block.sigma for block in _calibrating(blocks)]
        size = np.linalg.norm(matrix := np.vstack(rows), axis=0)
        scale = np.where(size > 0.0, size, 1.0)
        estimate = np.linalg.lstsq(matrix / scale, np.concatenate(right), rcond=1e-6)[0] / scale
        compliance = np.maximum(estimate, 0.01 * estimate.max())
        settings: list[Any] = [block.setting for block in blocks]
        forced = [one for one in settings if isinstance(one, CutWall | LoadTest)]
        torque = np.vstack([static(self.arm, self.flange_rotation, one)[1] for one in forced])
        return compliance, np.abs(torque).max(axis=0) * compliance

    def largest_in_cut(self, blocks: Sequence[Block]) -> Array:
        """Largest torque of the cuts on the link of each joint, (n,) N m."""
        settings: list[Any] = [block.setting for block in blocks]
        walls = [one for one in settings if isinstance(one, CutWall)]
        torques = [static(self.arm, self.flange_rotation, wall)[1] for wall in walls]
        return np.asarray(np.abs(np.vstack(torques)).max(axis=0, initial=0.0))

    def _cut(self, setting: CutWall, compliance: Array, straight: Array) -> tuple[Array, Array, Array]:
        """Return what a wall gains per compliance and per straight share of the springs, and without, m."""
        out, torque = outwards(self.arm, self.flange_rotation, setting)
        angle, slope, bent = self.torsion.in_cut(self.structure.in_cut(torque), compliance, straight)
        held = self._held(setting) - (
            0.0 if setting.weight is None else self.structure.in_cut(setting.weight)
        )
        angle, slope = angle - held * compliance, slope - held
        # The prediction passes the same filter as the profile, because that matters at the entry.
        smooth = profile_filter(len(out), setting.spacing, setting.cutoff)[setting.kept]
        rest = angle - slope * compliance - bent * straight
        constant = (out * rest).sum(axis=1) + strayed(self.arm, setting)
        constant = constant + self.give * (setting.force @ setting.normal)
        hardening = smooth @ (out * bent)[:, : len(self.springs)]
        return smooth @ (out * slope), hardening, smooth @ constant

    def _held(self, setting: CutWall) -> Array:
        """Torque (m, n), N m, that friction keeps off the springs in the cut, at load-test stiffness."""
        friction = self.drives.at(setting.commanded, setting.rate, np.zeros(len(setting.rate)))
        return np.asarray(self.structure.in_cut(friction) / self.torsion.factors(friction.shape[1]))

    def _loaded(self, setting: LoadTest, compliance: Array, straight: Array) -> tuple[Array, Array, Array]:
        """Return what load tests gain per compliance and per straight share, and without, m."""
        moved, torque = static(self.arm, self.flange_rotation, setting)
        angle, slope, bent = self.torsion.at_rest(torque, compliance, straight)
        rest = angle - slope * compliance - bent * straight
        constant = np.einsum("mai,mi->ma", moved, rest)
        hardening = (moved * bent[:, None, :])[setting.measured][:, : len(self.springs)]
        return (moved * slope[:, None, :])[setting.measured], hardening, constant[setting.measured]


def _calibrating(blocks: Sequence[Block]) -> list[Block]:
    return [block for block in blocks if block.role == "calibrate" and not block.belief]
