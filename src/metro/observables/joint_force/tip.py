"""Where the torques of the joints put the tip: their levers about the force depend on it alone."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from metro.observables.joint_force.model import Instruments, JointForceModel, carried
from metro.observables.problem import Block
from metro.robot.kinematics import Arm
from metro.units import Array


def best_tip(model: JointForceModel, blocks: Iterable[Block]) -> tuple[Array, float]:
    """Fit the place of the tip alone to the torques of joints, with all gains as they should be.

    A torque is linear in its lever, so that this has one solution wherever the tip was declared.

    Returns
    -------
    offset : (3,) m, true tip less the declared one, frame of the flange.
    residual : of the torque, relative to it, with the tip there.
    """
    rows, right = [np.zeros((0, 3))], [np.zeros((0, 2))]
    for block in (one for one in blocks if not isinstance(one.setting, Instruments)):
        measured, sigma = (by_joint(each, model).ravel() for each in (block.measured, block.sigma))
        declared, *moved = (
            asked(model.arm.with_tip_moved(offset), model, block).ravel()
            for offset in (np.zeros(3), *np.eye(3))
        )
        rows.append((np.stack(moved, axis=1) - declared[:, None]) / sigma[:, None])
        right.append(np.stack([measured - declared, measured], axis=1) / sigma[:, None])
    matrix, (missed, whole) = np.concatenate(rows), np.concatenate(right).T
    offset = np.linalg.lstsq(matrix, missed)[0]
    left = missed - matrix @ offset
    return offset, math.sqrt(float(left @ left) / max(float(whole @ whole), 1e-300))


def asked(arm: Arm, model: JointForceModel, block: Block) -> Array:
    """Waves (k, m - 1), N m, of the torque of each joint that the dynamometer's force asks for."""
    return by_joint(carried(arm, block.setting, model.offset)[:, 0], model)


def by_joint(values: Array, model: JointForceModel) -> Array:
    """Waves (k, m - 1) without the first one, which holds the friction's change."""
    return np.asarray(values.reshape(len(model.joints), -1)[:, 1:])
