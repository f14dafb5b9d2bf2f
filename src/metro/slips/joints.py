"""The torques of the joints against those that the dynamometer's force asks for: signs, order and gain.

Virtual work predicts the torque of each joint from the measured force; a channel that is another joint's, or
has the other sign, fits the prediction of that joint and not its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from metro.observables.joint_force.model import Instruments, JointForceModel
from metro.observables.joint_force.tip import asked, best_tip, by_joint
from metro.observables.problem import Block, Problem
from metro.slips.slip import Slip
from metro.units import Array

OBSERVABLES = ("joint_force", "deformation", "waviness")
CLEAR = 10.0  # signal over noise, rms over all runs, from which on a joint's torque shows whose it is
BETTER = 0.7  # residual over that of the declared order or gain; that of the forces is 0.8
GAINS = (0.5, 2.0)  # of all torques together: a drive's torque constant is known far better than that
DEVIATIONS = 3.0


@dataclass(frozen=True, eq=False)
class _Moments:
    """Sums over all waves of all runs, each channel in units of its noise.

    ``across`` (k, k): channel i with the prediction of joint j; ``own`` (k,): power of each channel;
    ``predicted`` (k, k): power of the prediction of joint j in the noise of channel i; ``count`` of waves.
    """

    across: Array
    own: Array
    predicted: Array
    count: int


def joint_slips(problem: Problem) -> tuple[Slip, ...]:
    """Try every assignment of the torques to joints with either sign, and the gain of all together."""
    from scipy.optimize import linear_sum_assignment

    model = cast("JointForceModel", problem.base)
    blocks = [block for block in problem.blocks if not isinstance(block.setting, Instruments)]
    if not blocks:
        return ()
    sums = _moments(model, blocks)
    strong = np.sqrt(np.diag(sums.predicted) / sums.count) > CLEAR / np.sqrt(sums.count)
    if not strong.any():
        return ()
    sign = np.where(sums.across < 0.0, -1.0, 1.0)
    cost = sums.own[:, None] - 2.0 * np.abs(sums.across) + sums.predicted
    place = linear_sum_assignment(cost)[1]
    declared = sums.own - 2.0 * np.diag(sums.across) + np.diag(sums.predicted)
    joints = np.arange(len(place))
    moved = ((place != joints) | (sign[joints, place] < 0.0)) & (strong | strong[place])
    best = np.where(moved, cost[joints, place], declared)
    before, after = (float(np.sqrt(each.sum() / max(sums.own.sum(), 1e-300))) for each in (declared, best))
    # A tip that is not where it is declared changes order and signs of the torques in the wrist, too.
    if moved.any() and after < BETTER * min(before, best_tip(model, blocks)[1]):
        return (_moved(np.array(model.joints) + 1, place, sign[joints, place], moved, (before, after)),)
    return _gain(sums)


def _moved(
    number: np.ndarray, place: Array, sign: Array, moved: Array, residual: tuple[float, float]
) -> Slip:
    before, after = residual
    found = (
        "the torques of the joints are not those that the dynamometer's force asks for: residual "
        f"{100 * before:.3g} % of the torque as declared, {100 * after:.3g} % otherwise"
    )
    turned = [f"tau{number[i]}_nm" for i in np.flatnonzero(moved) if place[i] == i]
    other = [
        f"tau{number[i]}_nm holds {'minus ' if sign[i] < 0 else ''}the torque of joint {number[place[i]]}"
        for i in np.flatnonzero(moved)
        if place[i] != i
    ]
    if len(turned) >= 2 and moved.sum() == len(turned) and np.all(sign[moved] < 0):
        words = (
            f"Likely in the robot logs: the sign of {', '.join(turned)} is turned, or the dynamometer reads"
        )
        remedy = f"{words} the other body (instruments.dynamometer.reads)"
    else:
        texts = ([f"the sign of {', '.join(turned)} is turned"] if turned else []) + other
        remedy = f"Likely in the robot logs: {'; '.join(texts)}"
    return Slip(OBSERVABLES, found, remedy, "runs.csv", "robot_log")


def _gain(sums: _Moments) -> tuple[Slip, ...]:
    """Judge the one gain of all torques, where they follow the force: a clock that is late lowers it, too."""
    power, across, own = (float(np.trace(each)) for each in (sums.predicted, sums.across, np.diag(sums.own)))
    gain, deviation = across / power, 1.0 / np.sqrt(power)
    low, high = GAINS
    as_declared, with_gain = own - 2.0 * across + power, own - gain * across
    within = low - DEVIATIONS * deviation <= gain <= high + DEVIATIONS * deviation
    if within or with_gain > BETTER**2 * as_declared:
        return ()
    found = (
        f"the torques of the joints are {gain:.3g} ± {1.96 * deviation:.2g} times those that the "
        f"dynamometer's force asks for; a gain beyond {low:g} to {high:g} is none of a drive"
    )
    remedy = "Likely: the unit of tau1_nm … (motor torque before the gear, N mm) or of the force"
    return (Slip(OBSERVABLES, found, remedy, "runs.csv", "robot_log"),)


def _moments(model: JointForceModel, blocks: list[Block]) -> _Moments:
    joints = len(model.joints)
    across, own, predicted = np.zeros((joints, joints)), np.zeros(joints), np.zeros((joints, joints))
    count = 0
    for block in blocks:
        measured, sigma = by_joint(block.measured, model), by_joint(block.sigma, model)
        expected = asked(model.arm, model, block)
        across += (measured / sigma**2) @ expected.T
        own += np.sum((measured / sigma) ** 2, axis=1)
        predicted += (1.0 / sigma**2) @ (expected**2).T
        count += measured.shape[1]
    return _Moments(across, own, predicted, count)
