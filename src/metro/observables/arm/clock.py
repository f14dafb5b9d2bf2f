"""The offset and the drift of the clock of a cut's log against the clock of the dynamometer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.observables.joint_force.model import TorqueRun, in_waves
from metro.observables.problem import Block
from metro.robot.kinematics import Arm
from metro.robot.statics import driven_jacobian, joint_torque
from metro.units import MS, Array

WIDEST, COARSE = 2.0, 20 * MS  # s, range and step of the offsets that are tried first
STEP = 1 * MS
ROUNDS = 8


@dataclass(frozen=True)
class Clock:
    """Offset of the log's clock, s, in the middle of the run, its drift, s/s, and their standard errors."""

    offset: float
    offset_sd: float
    drift: float
    drift_sd: float
    dof: float


def clock(block: Block, arm: Arm, gain: float) -> Clock:
    """Estimate the clock of one run from the times at which the torques rise and fall with the force.

    The fit is least squares on offset, drift and the run's own zeros, which represent the friction that the
    idle run does not share. The errors are enlarged where the residual exceeds the noise.

    Parameters
    ----------
    block : of the joint force. gain : of the torques.
    """
    run: TorqueRun = block.setting
    weight, jacobian = 1.0 / block.sigma, gain * driven_jacobian(arm, run.q)
    zeros, _ = np.linalg.qr(block.zeros * weight[:, None])
    middle, length = float(run.t.mean()), max(float(np.ptp(run.t)), STEP)

    def residual(theta: Array) -> Array:
        """Return the residual orthogonal to the zeros, in units of the noise; ``theta``: offset, drift."""
        force = run.force.mean(run.t - theta[0] - theta[1] * (run.t - middle), run.width)
        values = (block.measured - in_waves(joint_torque(jacobian, force))) * weight
        return np.asarray(values - zeros @ (zeros.T @ values))

    tried = [np.array([offset, 0.0]) for offset in np.arange(-WIDEST, WIDEST + COARSE / 2, COARSE)]
    theta = min(tried, key=lambda one: float((residual(one) ** 2).sum()))
    steps = np.diag([STEP, 2.0 * STEP / length])
    for _ in range(ROUNDS):
        slopes = np.stack(
            [(residual(theta + s) - residual(theta - s)) / (2.0 * s.sum()) for s in steps], axis=1
        )
        theta = theta - np.linalg.lstsq(slopes, residual(theta), rcond=None)[0]
    remaining = residual(theta)
    dof = float(len(remaining) - zeros.shape[1] - 2)
    excess = max(1.0, float(remaining @ remaining) / dof)
    sd = np.sqrt(np.diag(np.linalg.pinv(slopes.T @ slopes)) * excess)
    return Clock(float(theta[0]), float(sd[0]), float(theta[1]), float(sd[1]), dof)
