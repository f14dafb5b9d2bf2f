"""The waviness model: the wall follows the tip's tracking error, and joint motion that no encoder sees.

waviness = transfer × (tracking error of the tip by the encoders) + F n · [Σ_i j_i x_i + vibration], with F
the filter of the profile, n the wall's normal, j_i the columns of the tip's Jacobian. The encoders are on the
motors, so they do not see the twist x_i = (T_i − τ_i) c_i of joint i. T_i is the torque of the cut, and τ_i
the friction and ripple of the gears. When T_i changes its sign, the joint passes its gap. A ripple that comes
near the first mode of the arm's structure is amplified by it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from metro.observables.problem import Block, Parameter
from metro.robot.amplified import AmplifiedRipple, Shape
from metro.robot.drive_torques import DriveTorques, rippling
from metro.robot.torsion import Torsion
from metro.units import Array, ComplexArray

KEPT = 1024  # waves of runs: those of every run for some ten changes of a fit
NO_DRIVES = DriveTorques()
PHASES = tuple(2 * math.pi * third / 3 for third in range(3))  # of a vibration: starts of the fit to a run


@dataclass(frozen=True, eq=False)
class WavyCut:
    """Inputs of a run's waviness: n waves of the wall, at m points along it.

    Attributes
    ----------
    by_joint : (k, n) tracking error of the tip along the wall's normal by the encoders, joint by joint,
        filtered as the profile is, m. idle : (k, n) that of the idle run; None if there is none.
    share : (k, n) share of each joint's waves that is not noise of its encoder.
    q, rate, pace : (m, n) joint angles, rad, and speeds, rad/s: from point to point, and smooth.
    t : (m,) from the start of the log of the cut, s.
    moves : (m, n) displacement of the tip along the wall's normal per turn of each joint, m/rad.
    load : (m, n) torque of the steady cut on the link of each joint, N m; zero if no force is known.
    compliance : (n,) of the joints, rad/(N m).
    filtered : (n, m) map from heights at the points to waves, filtered as the profile is.
    longer : (2, rows) longer waves that pass the filter, of the profile and of the tracking error, m. They
        belong to the deformation too, so they are not compared.
    """

    by_joint: Array
    idle: Array | None
    share: Array
    q: Array
    rate: Array
    pace: Array
    t: Array
    moves: Array
    load: Array
    compliance: Array
    filtered: Array
    longer: Array

    @cached_property
    def tracking(self) -> Array:
        """Tracking error (n,), m, without the share that is noise."""
        return np.asarray((self.share * self.by_joint).sum(axis=1))


@dataclass(frozen=True, eq=False)
class BelievedSetting:
    """Setting of what is believed of the transfer beforehand."""


@dataclass(frozen=True)
class Vibration:
    """A vibration of the tip along the wall's normal: amplitude sin(2π frequency t + phase); m, Hz.

    A run has a ``phase`` of its own.
    """

    frequency: float = 0.0
    amplitude: float = 0.0


def phase_starts(vibration: Sequence[Vibration]) -> Array:
    """Return starts (k, m) of the phases of a run, rad: three of each wave; at least one."""
    each = [PHASES if swing.amplitude else PHASES[:1] for swing in vibration]
    return np.array(list(itertools.product(*(each or [PHASES[:1]]))))


def phases_of(vibration: Sequence[Vibration], nuisance: Array) -> tuple[float, ...]:
    """Return the phase of each wave: zero where its amplitude is, and where no phase is given."""
    known = itertools.chain(nuisance, itertools.repeat(0.0))
    return tuple(
        float(phase) if swing.amplitude else 0.0 for swing, phase in zip(vibration, known, strict=False)
    )


@dataclass(frozen=True, eq=False)
class WavinessModel:
    """Waviness of a side-milled wall.

    Attributes
    ----------
    joints : that effects of one joint may belong to, from 0.
    drives : torques of friction and gears that the idle run does not have.
    torsion : of the joints; only its gaps make waves.
    vibration : waves that are functions of time alone, not of the place; each run has its own phase of each,
        since nothing starts a vibration with the log.
    amplified : ripples of gears that the arm's structure amplifies.
    """

    joints: tuple[int, ...]
    drives: DriveTorques = field(default_factory=DriveTorques)
    torsion: Torsion = field(default_factory=Torsion)
    vibration: tuple[Vibration, ...] = ()
    amplified: tuple[AmplifiedRipple, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Share of the tracking error that the wall shows; ideally it is 1."""
        return (Parameter("transfer", "1"),)

    def largest_in_cut(self, blocks: Sequence[Block]) -> Array:
        """Largest torque of the cuts on the link of each joint, (n,) N m."""
        settings: list[Any] = [block.setting for block in blocks if not block.belief]
        return np.asarray(np.abs(np.vstack([run.load for run in settings])).max(axis=0, initial=0.0))

    def nuisance_starts(self, block: Block) -> Array:
        """Return starts of the phases of a run."""
        return np.zeros((1, 0)) if block.belief else phase_starts(self.vibration)

    def design(self, block: Block, nuisance: Array, _beta: Array | None = None) -> tuple[Array, Array]:
        """Waves (n, 1), m per unit of transfer, and the waves that no encoder sees (n,), m.

        For :class:`BelievedSetting` it is the transfer itself.
        """
        run: Any = block.setting
        if isinstance(run, BelievedSetting):
            return np.ones((1, 1)), np.zeros(1)
        unseen = loaded(run, self.torsion)
        if self.drives != NO_DRIVES:
            unseen = unseen - driven(run, self.drives)
        for ripple in self.amplified:
            for times, (sine, cosine) in ripple.multiples:
                unseen = unseen - ((cosine - 1j * sine) * amplified(run, ripple.shape, times)).real
        for swing, phase in zip(self.vibration, phases_of(self.vibration, nuisance), strict=True):
            if swing.amplitude:
                turned = np.exp(1j * phase) * swinging(run, swing.frequency)
                unseen = unseen + swing.amplitude * turned.imag
        return run.tracking[:, None], unseen

    def ripples(self, block: Block, joint: int, orders: Array) -> ComplexArray:
        """Return waves (n, f), m per N m, of ripples of a joint's gear: complex amplitudes of a cosine."""
        run: WavyCut = block.setting
        torque = rippling(run.q[:, joint], run.rate[:, joint], 0.0, orders)
        return -_filtered(run, (run.moves[:, joint] * run.compliance[joint])[:, None] * torque)


# A fit asks for each of these again and again: of what acts on the wall, few numbers change at a time.
@lru_cache(maxsize=KEPT)
def loaded(run: WavyCut, torsion: Torsion) -> Array:
    """Waves (n,), m, that the steady cut makes with the springs and gaps of the joints; not to be changed."""
    return _of_twist(run, run.compliance * run.load + torsion.passed(run.load))


@lru_cache(maxsize=KEPT)
def driven(run: WavyCut, drives: DriveTorques) -> Array:
    """Waves (n,), m, of the torques of the drives; not to be changed."""
    return _of_twist(run, run.compliance * drives.at(run.q, run.rate, run.t))


@lru_cache(maxsize=KEPT)
def amplified(run: WavyCut, shape: Shape, times: int) -> ComplexArray:
    """Waves (n,), m per N m, of a ripple of so many times its order, as complex amplitudes of a cosine."""
    torque = shape.following(run.q, run.pace, times)
    height = run.moves[:, shape.joint] * run.compliance[shape.joint] * torque
    return _filtered(run, height[:, None])[:, 0]


@lru_cache(maxsize=KEPT)
def swinging(run: WavyCut, frequency: float) -> ComplexArray:
    """Waves (n,) of a vibration of amplitude 1, as complex amplitudes of a cosine."""
    return _filtered(run, np.exp(2j * math.pi * frequency * run.t)[:, None])[:, 0]


def _filtered(run: WavyCut, height: ComplexArray) -> ComplexArray:
    """Waves (n, f) of complex heights (m, f): both parts in one product, else the map becomes complex."""
    return np.asarray((run.filtered @ height.view(float)).view(complex))


def _of_twist(run: WavyCut, twist: Array) -> Array:
    """Waves (n,), m, of twists of the joints (m, n), rad."""
    return np.asarray(run.filtered @ (run.moves * twist).sum(axis=1))
