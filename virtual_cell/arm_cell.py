"""A cutting arm as it really is: what it declares, and what it hides of drives, joints, tool and clocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.robot import Drives
from virtual_cell.units import Array

NONE = (0.0,) * 6
TURNING = 2e-4  # rad/s: Coulomb friction goes as tanh(rate / TURNING)
_SMOOTH = 0.02  # of the largest torque: below it a joint is within its gap


@dataclass(frozen=True)
class Moves:
    """How the joints move in the cuts of a batch: what the sizes of effects are drawn by.

    ``travel`` (6,) rad per m of the path, mean; ``turning``: joints (0 … 5) that turn round within a cut;
    ``swaying``: joints on which the torque of the cut changes its sign within one; ``speed``: lowest and
    highest feed, m/s; ``lever`` (6,) of the joints on the tip, m; ``seconds`` of a cut; ``give`` (6,) of the
    joints, by how much each lets the tip go out of the walls in the cuts, m.
    """

    travel: tuple[float, ...]
    turning: tuple[int, ...]
    swaying: tuple[int, ...]
    speed: tuple[float, float]
    lever: tuple[float, ...]
    seconds: float
    give: tuple[float, ...]


@dataclass(frozen=True)
class ArmCell:
    """The truth of a batch of side cuts. Whatever is (6,) is per joint, from the base up.

    Attributes
    ----------
    arm : as it is declared; ``stiffness`` that of the load tests. drives : of the idle run.
    origin, turn : of the work in the base, (3,) m and (3, 3). moves : how the joints move.
    clock_offset : by how much later the log of the cut stamps an event than the dynamometer, s.
    reversal, warmup : Coulomb level of the cut less that of the idle run, N m, and its slope, N m/s.
    ripple, ripple_order, ripple_phase : torque of the gears in the cut, N m, per radian of the joint, rad.
    payload, payload_at : mass on the flange in the cut, kg, and where it is in the flange frame, m.
    tip_offset : true tip less the declared one, flange frame, m.
    gap : whole backlash of the joints in the cut, rad. cubic : hardening, N m/rad³. factor : stiffness in the
        cut over that of the load tests.
    vibration : (Hz, m, rad) of a vibration along the wall's normal, by the clock of the log.
    viscous_change : relative, of the cut. torque_gain : relative error of the torques, of both logs.
        delay : of the torques behind the angles in both logs, s.
    link, link_compliance : the link that twists about its own x axis, and by how much, rad/(N m).
    tool_compliance : of the tool across its axis, in the cut, m/N.
    drift : of the base along its axes, m/s. gain_drift : of the dynamometer along a record, 1/s.
    tilt : of the block when it is traced, rad. wave : (m, m, rad) length, amplitude and phase of a wave along
        the wall. ringing : (Hz, damping, m) of the tip after the tool has met the block.
    chirp : relative growth of the vibration's frequency, 1/s.
    """

    arm: Arm
    drives: Drives
    origin: Array
    turn: Array
    moves: Moves
    clock_offset: float = 0.0
    reversal: tuple[float, ...] = NONE
    warmup: tuple[float, ...] = NONE
    ripple: tuple[float, ...] = NONE
    ripple_order: tuple[float, ...] = NONE
    ripple_phase: tuple[float, ...] = NONE
    payload: float = 0.0
    payload_at: tuple[float, ...] = (0.0, 0.0, 0.0)
    tip_offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    gap: tuple[float, ...] = NONE
    cubic: tuple[float, ...] = NONE
    factor: tuple[float, ...] = (1.0,) * 6
    vibration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    viscous_change: tuple[float, ...] = NONE
    torque_gain: tuple[float, ...] = NONE
    delay: tuple[float, ...] = NONE
    link: int = 1
    link_compliance: float = 0.0
    tool_compliance: float = 0.0
    drift: tuple[float, ...] = (0.0, 0.0, 0.0)
    gain_drift: float = 0.0
    tilt: float = 0.0
    wave: tuple[float, float, float] = (1.0, 0.0, 0.0)
    ringing: tuple[float, float, float] = (0.0, 0.0, 0.0)
    chirp: float = 0.0

    @cached_property
    def true(self) -> Arm:
        """The arm with the tip where it really is."""
        return replace(self.arm, tip=self.arm.tip + np.array(self.tip_offset))

    def in_base(self, point: Array) -> Array:
        """Points (…, 3), m, of the work frame in the base frame."""
        moved: Array = point @ self.turn.T + self.origin
        return moved

    def friction(self, rate: Array) -> Array:
        """Torque (n, 6), N m, of friction at joint speeds (n, 6), rad/s, in the idle run."""
        torque: Array = self.drives.coulomb * np.tanh(rate / TURNING) + self.drives.viscous * rate
        return torque

    def more_friction(self, rate: Array, t: Array) -> Array:
        """Friction (n, 6), N m, that only the cut has, at times ``t`` (n,), s, of its log."""
        level = np.array(self.reversal) + np.outer(t, self.warmup)
        viscous = self.drives.viscous * np.array(self.viscous_change)
        torque: Array = level * np.tanh(rate / TURNING) + viscous * rate
        return torque

    def gears(self, q: Array) -> Array:
        """Ripple (n, 6), N m, of the gears in the cut at joint angles (n, 6), rad."""
        wave: Array = np.array(self.ripple) * np.sin(q * self.ripple_order + self.ripple_phase)
        return wave

    def torsion(self, torque: Array) -> Array:
        """Torsion (n, 6), rad, of the joints along a cut that puts torques (n, 6), N m, on the links.

        T/factor = k x + cubic x³, and half the gap to the side of the torque.
        """
        largest = np.maximum(np.abs(torque).max(axis=0), 1e-9)
        lost = 0.5 * np.array(self.gap) * np.tanh(torque / (_SMOOTH * largest))
        sprung = hardened(torque / np.array(self.factor), self.arm.stiffness, np.array(self.cubic))
        return np.asarray(sprung + lost)

    def unseen_torsion(self, q: Array, rate: Array) -> Array:
        """Torsion (n, 6), rad, by friction and gears of the link side, which no encoder sees."""
        torque = np.array(self.reversal) * np.tanh(rate / TURNING) + self.gears(q)
        twisted: Array = -torque / (self.arm.stiffness * np.array(self.factor))
        return twisted


def hardened(torque: Array, stiffness: Array, cubic: Array) -> Array:
    """Solve T = k x + c x³ for x, c ≥ 0: the one real root, by Cardano's hyperbolic formula."""
    some = np.maximum(cubic, 1e-30)
    reach = np.sqrt(stiffness / (3.0 * some))
    root = 2.0 * reach * np.sinh(np.arcsinh(1.5 * torque / (stiffness * reach)) / 3.0)
    return np.where(cubic > 0.0, root, torque / stiffness)


def payload_torque(arm: Arm, q: Array, mass: float, at: Array) -> Array:
    """Torques (6,), N m, that hold a mass (kg) ``at`` (3,), m, in the flange frame."""
    frames = arm.frames(q)
    place = frames[6, :3, :3] @ at + frames[6, :3, 3]
    height = np.cross(frames[:6, :3, 2], place - frames[:6, :3, 3])[:, 2]
    return np.asarray(mass * 9.81 * height)
