"""The joint force model: motor torques of the cut less those of the idle run, given the force on the tool.

Per joint and bin of the path: torque = gain × (−Jᵀ f) + drives + payload (virtual work), with f the
dynamometer's force, averaged over a revolution of the spindle and over the bin. Each joint's torque, whatever
makes it, and each axis of the dynamometer may have a small additional gain, and each axis may show some of
the force along the others (crosstalk, a turned mounting), to first order, within the accuracy of the
instruments. Joints may be warmer in the cut than in the idle run: their friction has changed by a share of
it, and a motor shows all of its torque, that of the arm's weight, too, by another torque constant. The
torques may follow the force late, by the filters of the drives and the clock of the log. The rows of the
comparison are forces: that of the dynamometer, and the sensorless force, which is that of the dynamometer
plus the force at the tip that belongs to the residual torques.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise, permutations
from typing import Any

import numpy as np

from metro.observables.problem import Block, Parameter
from metro.robot.drive_torques import DriveTorques, rippling
from metro.robot.kinematics import Arm, Geometry, axes
from metro.robot.payload import Payload, gravity_torque
from metro.robot.statics import Flange, flange_of, joint_torque, tip_jacobian_of
from metro.same import Same
from metro.signals.waves import waves
from metro.units import MS, Array, ComplexArray

AXES = "xyz"
# What each joint may have otherwise in the cut than in the idle run.
CONSTANT, LEVEL, VISCOUS = "torque_constant_of_joint_", "friction_of_joint_", "viscous_friction_of_joint_"
LAG_STEP = 5 * MS  # over which the torques are differentiated
LAG_GRID = 1 * MS
CROSS = tuple(permutations(range(3), 2))  # axis that shows it, axis along which the force is


@dataclass(frozen=True, eq=False)
class ForceRecord:
    """The force on the tool, work frame, through the running integral of its record.

    ``t`` (k,) s from the record's start; ``integral`` (k, 3), N s, of the force averaged over a revolution;
    before and after the record there is none.
    """

    t: Array
    integral: Array

    def mean(self, middle: Array, width: Array) -> Array:
        """Mean force (m, 3), N, over windows of ``width`` (m,) s about ``middle`` (m,) s."""
        ends = np.stack([middle - width / 2, middle + width / 2])
        sums = np.stack([np.interp(ends, self.t, column) for column in self.integral.T], axis=-1)
        return np.asarray((sums[1] - sums[0]) / width[:, None])


def running(t: Array, force: Array) -> ForceRecord:
    """Return a record (k, 3), N, at times ``t`` (k,), s, as its running integral (trapezia)."""
    steps = 0.5 * (force[1:] + force[:-1]) * np.diff(t)[:, None]
    return ForceRecord(t, np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]))


@dataclass(frozen=True, eq=False)
class TorqueRun:
    """Inputs of a run's torques, at m bins of the path.

    Attributes
    ----------
    q, rate : (m, n) of all joints: angles, rad, and speeds, rad/s; m and m/s of a linear axis.
    t, width : (m,) middle and length of the bin's time, s, by the dynamometer's clock. since : (m,) the same
        from the start of the log.
    force : the dynamometer's record.
    idle : (m, k) torques of the idle run at the same places without their noise, N m, of the k joints that
        turn.
    start : (n,) friction of the joints over its level where the path begins, −1 … 1; without it they moved
        before as they do there. turn : (n,) over which it follows, rad; NaN where it is not identified.
    peak : (m, n) its level at these speeds over that of all cuts (Stribeck); without it that is one.
    """

    q: Array
    rate: Array
    t: Array
    since: Array
    width: Array
    force: ForceRecord
    idle: Array
    start: Array | None = None
    turn: Array | None = None
    peak: Array | None = None


@dataclass(frozen=True, eq=False)
class Instruments:
    """Setting of the prior knowledge on the gains of joints and axes, and on crosstalk: they are small."""


@dataclass(frozen=True, eq=False)
class JointForceModel:
    """Torques of the cut less those of the idle run.

    Attributes
    ----------
    arm : geometry: DH, tip in the flange, work in the base.
    drives : torques of friction and gears that the idle run does not have.
    payload : masses on the flange that the idle run does not have.
    offset : time by which the robot log of the cut stamps an event later than the dynamometer, s.
    """

    arm: Arm
    drives: DriveTorques = field(default_factory=DriveTorques)
    payload: tuple[Payload, ...] = ()
    offset: float = 0.0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """A gain that all torques share, one of each joint and axis, crosstalk, and what a cut changes.

        That is each joint's torque constant, its friction and viscous friction, against the idle run; and by
        how much the torques spread the force in time, and follow it late.
        """
        names = ["torque_gain", *(f"gain_of_joint_{i + 1}" for i in self.joints)]
        names += [f"gain_of_{a}" for a in AXES]
        names += [f"crosstalk_of_{AXES[along]}_in_{AXES[seen]}" for seen, along in CROSS]
        names += [f"{CONSTANT}{i + 1}" for i in self.joints]
        level = [Parameter(f"{LEVEL}{i + 1}", "N m") for i in self.joints]
        viscous = [Parameter(f"{VISCOUS}{i + 1}", "N m s/rad") for i in self.joints]
        drives = Parameter("drive_smoothing", "ms2", MS**2), Parameter("drive_lag", "ms", MS)
        return (*(Parameter(name, "1") for name in names), *level, *viscous, *drives)

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints whose torques are compared, from 0: those that turn."""
        return tuple(self.arm.axes.turning)

    def nuisance_starts(self, _block: Block) -> Array:
        """Return the one empty set of nonlinear unknowns, shape (1, 0)."""
        return np.zeros((1, 0))

    def design(self, block: Block, _nuisance: Array, beta: Array | None = None) -> tuple[Array, Array]:
        """Waves of the torque (k m, 4 k + 12) per base parameter, and those without a force (k m,), N m.

        For :class:`Instruments` they are all but the first (4 k + 11, 4 k + 12) themselves; k joints turn.
        The torques of drives and payload are read with the gains of the joints, too. The time by which the
        torques are late is linear about that of ``beta``, to a grid.
        """
        run: Any = block.setting
        if isinstance(run, Instruments):
            gains = len(self.parameters)
            return np.eye(gains)[1:], np.zeros(gains - 1)
        at, more = self._lateness(beta)
        matrix, later = basis(self.arm, run, at), late(self.arm, run, at)
        read = self._beside(run)
        if read.any():
            matrix, ends = matrix.copy(), np.arange(len(self.joints) + 1) * len(run.t)
            for i, (first, end) in enumerate(pairwise(ends)):
                matrix[first:end, 1 + i] += read[first:end]
        return matrix, read + (more - (0.0 if beta is None else beta[-1])) * later

    def predictions(self, block: Block, nuisances: Array, beta: Array) -> Array:
        """Prediction (k, n) of a block, k times the same: no run has unknowns of its own.

        It is ``offset + matrix @ beta`` of :meth:`design`, without a matrix of its own.
        """
        run: Any = block.setting
        if isinstance(run, Instruments):
            predicted = beta[1:]
        else:
            at, more = self._lateness(beta)
            read, each = self._beside(run), np.repeat(beta[1 : 1 + len(self.joints)], len(run.t))
            later = (more - beta[-1]) * late(self.arm, run, at)
            predicted = basis(self.arm, run, at) @ beta + (1.0 + each) * read + later
        return np.broadcast_to(predicted, (len(nuisances), len(predicted)))

    def differences(
        self, others: Sequence[JointForceModel], block: Block, nuisances: Array, beta: Array
    ) -> tuple[Array, Array]:
        """Return by how much predictions differ (:class:`metro.observables.problem.Differing`).

        Where the arm or the clock is another one, the torques are added up before they become waves, all
        linear about one lateness: the derivatives of clock and lag are alike.
        """
        run: Any = block.setting
        size = len(beta) - 1 if isinstance(run, Instruments) else len(self.joints) * len(run.t)
        moved, others_own = np.zeros((len(others), size)), np.zeros((len(nuisances) - 1, size))
        if isinstance(run, Instruments):
            return moved, others_own
        read, each = self._beside(run), 1.0 + np.repeat(beta[1 : 1 + len(self.joints)], len(run.t))
        at, _ = self._lateness(beta)
        for i, other in enumerate(others):
            moved[i] = each * (other._beside(run) - read)
            if other.arm is not self.arm or other.offset != self.offset:
                moved[i] += other._asked(run, beta, at) - self._asked(run, beta, at)
        return moved, others_own

    def ripples(self, block: Block, joint: int, orders: Array) -> ComplexArray:
        """Return waves (k m, f) of ripples of 1 N m of a joint's gear: complex amplitudes of a cosine."""
        run: TorqueRun = block.setting
        torque = rippling(run.q[:, joint], run.rate[:, joint], run.width, orders)
        seen = np.zeros((len(self.joints), *torque.shape), complex)
        seen[self.joints.index(joint)] = waves(torque.view(float)).view(complex)
        return seen.reshape(-1, len(orders))

    def _asked(self, run: TorqueRun, beta: Array, at: float) -> Array:
        """Waves (k m,), N m, of the torques that balance the force, with all gains, linear about a lateness.

        As :func:`basis` makes them of the force, in one transform of k torques instead of one of 11 k.
        """
        force, later, curved = _forces(run, at)
        of_joints, by_axis, across = np.split(beta[1:], np.cumsum([len(self.joints), 3, len(CROSS)]))[:3]
        gains = np.diag(beta[0] + by_axis)
        gains[tuple(np.transpose(CROSS))] = across
        jacobian = _driven_jacobian(self.arm, run)
        acting = force @ gains.T + beta[-2] * curved + (self.offset + beta[-1] - at) * later
        return in_waves(joint_torque(jacobian, acting) + of_joints * joint_torque(jacobian, force))

    def _lateness(self, beta: Array | None) -> tuple[float, float]:
        """By how much the torques are late by clock and lag: on a grid, and what is more than that, both s.

        Only their sum shows: were one of them on the grid alone, a descent would stop between the two.
        """
        whole = self.offset + (0.0 if beta is None else float(beta[-1]))
        at = LAG_GRID * round(whole / LAG_GRID)
        return at, whole - at

    def _beside(self, run: TorqueRun) -> Array:
        """Waves (k m,), N m, of the torques of drives and payload."""
        dh = Same(self.arm.dh)
        read = driven(self.drives, dh, run)
        if self.payload:
            read = read + held(dh, run) @ sum(mass.moments for mass in self.payload)
        return read


@lru_cache(maxsize=256)
def along(dh: Same[Geometry], run: TorqueRun) -> Flange:
    """Return the flange along a run: no effect moves it, whatever else an effect changes of the arm."""
    return flange_of(dh.value, run.q)


@lru_cache(maxsize=256)
def driven(drives: DriveTorques, dh: Same[Geometry], run: TorqueRun) -> Array:
    """Waves (k m,), N m, of the torques of the drives; not to be changed."""
    torque = drives.at(run.q, run.rate, run.since, run.width, start=run.start, peak=run.peak)
    torque = torque[:, axes(dh.value).turning]
    return in_waves(torque) if torque.any() else np.zeros(torque.size)


@lru_cache(maxsize=256)
def held(dh: Same[Geometry], run: TorqueRun) -> Array:
    """Waves (k m, 4), N m, of the torques that hold a mass on the flange, per moment of it."""
    torques = gravity_torque(along(dh, run))[:, axes(dh.value).turning]
    return np.stack([in_waves(one) for one in np.moveaxis(torques, -1, 0)], axis=1)


@lru_cache(maxsize=256)
def basis(arm: Arm, run: TorqueRun, offset: float) -> Array:
    """Waves (k m, 4 k + 12) per base parameter without the torques of drives and payload; not to be changed.

    The log stamps the force ``offset`` s later than the dynamometer.
    """
    drives = spread(arm, run, offset), late(arm, run, offset)
    return np.column_stack([carried(arm, run, offset), beside(run, tuple(arm.axes.turning)), *drives])


@lru_cache(maxsize=256)
def beside(run: TorqueRun, joints: tuple[int, ...]) -> Array:
    """Waves (k m, 3 k) of each joint's idle torque, of its friction over its level, and of its speed."""
    idle, speed = (_one_by_one(waves(each)) for each in (run.idle, run.rate[:, joints]))
    return np.column_stack([idle, rubbing(run, joints), speed])


@lru_cache(maxsize=256)
def rubbing(run: TorqueRun, joints: tuple[int, ...]) -> Array:
    """Waves (k m, k) of the friction of each joint that turns, over its level."""
    turn = () if run.turn is None else tuple(run.turn.tolist())
    one = DriveTorques((1.0,) * run.q.shape[1], presliding=turn)
    states = one.at(run.q, run.rate, run.since, start=run.start, peak=run.peak)[:, joints]
    return _one_by_one(waves(states))


def carried(arm: Arm, run: TorqueRun, offset: float) -> Array:
    """Waves (k m, k + 10), N m, of the torque that balances the force: whole, by joint, by axis, crosstalk.

    The log stamps it ``offset`` s later than the dynamometer.
    """
    each = _balanced(arm, run, offset)[0]
    whole = np.sum([each[i, i] for i in range(3)], axis=0)
    by_axis, across = [each[i, i].ravel() for i in range(3)], [each[pair].ravel() for pair in CROSS]
    return np.column_stack([whole.ravel(), _one_by_one(whole.T), *by_axis, *across])


def late(arm: Arm, run: TorqueRun, offset: float) -> Array:
    """Waves (k m,), N m/s, of the torque that balances the force, per second by which it comes later."""
    return _balanced(arm, run, offset)[1].ravel()


def spread(arm: Arm, run: TorqueRun, offset: float) -> Array:
    """Waves (k m,), N m/s², of the torque that balances the force, per variance in time over two, s².

    A filter that spreads the force over times of a variance changes it by half of that times its curvature.
    """
    return _balanced(arm, run, offset)[2].ravel()


@lru_cache(maxsize=256)
def _balanced(arm: Arm, run: TorqueRun, offset: float) -> tuple[Array, Array, Array]:
    """Waves of the torques that balance the force, and of those per second and second squared of it.

    Returns
    -------
    (3, 3, k, m), N m, of a force along each axis (the second) as each axis shows it (the first); (k, m),
    N m/s and N m/s²: all in one transform.
    """
    force, later, curved = _forces(run, offset)
    jacobian = _driven_jacobian(arm, run)
    m, _, k = jacobian.shape
    crossed = -jacobian[:, :, None, :] * force[:, None, :, None]
    changes = [joint_torque(jacobian, each) for each in (later, curved)]
    moved = np.ascontiguousarray(waves(np.concatenate([crossed.reshape(m, -1), *changes], axis=1)).T)
    return moved[: 9 * k].reshape(3, 3, k, m), moved[9 * k : 10 * k], moved[10 * k :]


@lru_cache(maxsize=256)
def _forces(run: TorqueRun, offset: float) -> tuple[Array, Array, Array]:
    """Mean force (m, 3), N, as the log stamps it, and its differences by the offset, N/s and N/s²."""
    after, now, before = (
        run.force.mean(run.t - offset - step, run.width) for step in (LAG_STEP, 0.0, -LAG_STEP)
    )
    return now, (after - before) / (2.0 * LAG_STEP), (after - 2.0 * now + before) / LAG_STEP**2


@lru_cache(maxsize=256)
def _driven_jacobian(arm: Arm, run: TorqueRun) -> Array:
    """Tip velocity per rate of each joint that turns, along a run, (m, 3, k)."""
    return np.asarray(tip_jacobian_of(arm, along(Same(arm.dh), run))[..., arm.axes.turning])


def _one_by_one(moved: Array) -> Array:
    """Return waves (m, k) of joints as those along the path of one joint at a time (k m, k)."""
    m, k = moved.shape
    each = np.zeros((k, m, k))
    each[np.arange(k), :, np.arange(k)] = moved.T
    return each.reshape(k * m, k)


def in_waves(torque: Array) -> Array:
    """Return torques (m, k) as waves along the path (k m,), joint after joint."""
    return waves(torque).T.ravel()
