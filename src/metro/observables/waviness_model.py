"""The waviness model: the wall follows the tip's tracking error, and what no encoder sees of the joints.

waviness = transfer × (tracking error of the tip by the encoders) + F n · [Σ_i j_i x_i + vibration], with F
the filter of the profile, n the wall's normal, j_i the columns of the tip's Jacobian. The encoders sit on the
motors: the torque T_i of the cut, and friction and ripple τ_i of the gears on their other side, twist joint i
by x_i = (T_i − τ_i) c_i, and where T_i changes its sign, the joint passes its gap.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from metro.observables.problem import Block, Parameter
from metro.robot.drive_torques import DriveTorques
from metro.robot.torsion import Torsion, passed
from metro.units import Array


@dataclass(frozen=True, eq=False)
class WavyCut:
    """What a run's waviness follows from: n waves of the wall, at m points along it.

    Attributes
    ----------
    by_joint : (n, 6) tracking error of the tip along the wall's normal by the encoders, joint by joint,
        filtered as the profile is, m. idle : (n, 6) that of the idle run; None where there is none.
    share : (n, 6) of each joint's waves that may be more than the noise of its encoder.
    q, rate : (m, 6) joint angles, rad, and speeds, rad/s. t : (m,) from the start of the log of the cut, s.
    moves : (m, 6) how far a turn of each joint takes the tip along the wall's normal, m/rad.
    load : (m, 6) torque of the steady cut on the link of each joint, N m; zero where no force is known.
    compliance : (6,) of the joints, rad/(N m).
    filtered : (n, m) the waves of what lies at the points, filtered as the profile is.
    longer : (2, rows) what the filter lets through of longer waves, of the profile and of the tracking
        error, m: deformation has them too, so they are not compared.
    """

    by_joint: Array
    idle: Array | None
    share: Array
    q: Array
    rate: Array
    t: Array
    moves: Array
    load: Array
    compliance: Array
    filtered: Array
    longer: Array

    @property
    def tracking(self) -> Array:
        """Tracking error (n,) as far as it stands out of the noise, m."""
        return np.asarray((self.share * self.by_joint).sum(axis=1))


@dataclass(frozen=True)
class Vibration:
    """A vibration of the tip along the wall's normal: amplitude sin(2π frequency t + phase); m, Hz, rad."""

    frequency: float = 0.0
    amplitude: float = 0.0
    phase: float = 0.0

    def at(self, t: Array) -> Array:
        """Displacement (m,) at times ``t`` (m,), s."""
        return np.asarray(self.amplitude * np.sin(2.0 * math.pi * self.frequency * t + self.phase))


@dataclass(frozen=True, eq=False)
class WavinessModel:
    """Waviness of a side-milled wall.

    Attributes
    ----------
    drives : torques of friction and gears that the idle run does not have.
    torsion : of the joints; its gaps alone make waves.
    vibration : that goes with time, whatever the place.
    """

    drives: DriveTorques = field(default_factory=DriveTorques)
    torsion: Torsion = field(default_factory=Torsion)
    vibration: Vibration = field(default_factory=Vibration)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """How much of the tracking error the wall shows: all of it, ideally."""
        return (Parameter("transfer", "1"),)

    def nuisance_starts(self, _block: Block) -> Array:
        """Return the one empty set of nonlinear unknowns, shape (1, 0)."""
        return np.zeros((1, 0))

    def design(self, block: Block, _nuisance: Array, _beta: Array | None = None) -> tuple[Array, Array]:
        """Waves (n, 1), m per unit of transfer, and what no encoder sees (n,), m."""
        run: Any = block.setting
        torque = run.load - self.drives.at(run.q, run.rate, run.t)
        twist = run.compliance * torque + passed(run.load, np.array(self.torsion.gap))
        unseen = (run.moves * twist).sum(axis=1) + self.vibration.at(run.t)
        return run.tracking[:, None], run.filtered @ unseen
