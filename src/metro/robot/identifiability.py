"""Which joint compliances the load tests of an arm identify, how well, and which test would add most.

A design of experiments in the joints' compliances: with relative unknowns (each compliance in units of its
own size) the information of tests is the sum of theirs, M = Σ Aᵀ A / σ², and what is known of a joint is the
diagonal of M⁻¹ (Pukelsheim, Optimal Design of Experiments, 2006).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.kinematics import Arm
from metro.robot.statics import joint_contributions
from metro.units import DEG, Array

LEAST_SHARE = 1e-6  # eigenvalue of the information, over the largest, below which it counts as zero
ANYTHING = 1.0  # relative standard deviation of a joint of which nothing is known
TURN, SHIFT = 30.0 * DEG, 0.5  # rad, m: steps of one joint at a time around the poses that were measured


@dataclass(frozen=True, eq=False)
class Identifiability:
    """How well tests identify the compliances of n joints.

    Attributes
    ----------
    relative : (n,) standard deviation of each compliance over its size; infinite where it is not
    identifiable.
    singular : (n,) relative standard deviations of the combinations of joints that are estimated
        independently, best first. directions : (n, n), rows are these combinations.
    unseen : (k, n) those of them that the tests do not identify at all.
    """

    relative: Array
    singular: Array
    directions: Array
    unseen: Array

    @property
    def worst(self) -> int:
        """Index of the joint with the largest relative standard deviation."""
        return int(np.argmax(np.where(np.isfinite(self.relative), self.relative, np.inf)))

    @property
    def condition(self) -> float:
        """Condition number of the design: deviation of the worst over that of the best combination."""
        return float(self.singular[-1] / self.singular[0])


@dataclass(frozen=True, eq=False)
class NextLoad:
    """A load test that could be made next.

    ``joints`` (n,) rad, ``force`` (3,) N, work frame; the joint that it is for, and the relative standard
    deviation of its compliance before and after.
    """

    joints: Array
    force: Array
    joint: int
    before: float
    after: float


def information(contributions: Array, measured: np.ndarray, sigma: Array, size: Array) -> Array:
    """Information matrix (n, n) of tests on relative compliances.

    Parameters
    ----------
    contributions : (m, 3, n) of :func:`metro.robot.statics.joint_contributions`.
    measured : (m, 3) which components were read. sigma : (m, 3) or a number, m, of a reading.
    size : (n,) compliances that relative is meant to, rad/(N m), all above zero.
    """
    weight = np.broadcast_to(sigma, measured.shape)[measured]
    rows = contributions[measured] * size / weight[:, None]
    return np.asarray(rows.T @ rows)


def assess(matrix: Array) -> Identifiability:
    """Return how well tests of an information matrix (n, n) on relative compliances identify the joints."""
    eigenvalue, vector = np.linalg.eigh(matrix)
    eigenvalue, vector = np.maximum(eigenvalue[::-1], 0.0), vector[:, ::-1].T
    seen = eigenvalue > LEAST_SHARE * eigenvalue.max(initial=0.0)
    singular = np.full(len(eigenvalue), np.inf)
    singular[seen] = 1.0 / np.sqrt(eigenvalue[seen])
    relative = np.sqrt((vector[seen] ** 2 / eigenvalue[seen, None]).sum(axis=0))
    relative[(vector[~seen] ** 2).sum(axis=0) > LEAST_SHARE] = np.inf
    return Identifiability(relative, singular, vector, vector[~seen])


def around(poses: Array, linear: np.ndarray) -> Array:
    """Poses (p, n) and those with one joint moved by a step to either side, (p (1 + 2 n), n), rad or m.

    ``linear`` (n,) bool: whether a joint shifts.
    """
    step = np.diag(np.where(linear, SHIFT, TURN))
    turns = [np.zeros((1, poses.shape[1])), -step, step]
    return np.asarray((poses[:, None, :] + np.vstack(turns)).reshape(-1, poses.shape[1]))


def directions() -> Array:
    """Directions (9, 3) in which a load may pull: the axes, and halfway between two of them."""
    axes = np.eye(3)
    between = [axes[i] + sign * axes[j] for i, j in ((0, 1), (1, 2), (0, 2)) for sign in (1.0, -1.0)]
    return np.vstack([axes, np.array(between) / np.sqrt(2.0)])


def next_load(arm: Arm, matrix: Array, poses: Array, *, newton: float, sigma: float, size: Array) -> NextLoad:
    """Return the load test, of every direction in every pose, that best identifies the worst joint.

    Joints of which nothing is known count as known to ±100 %: a joint's variance is then finite, and lower
    after a test that sees it. Of tests that are as good for that joint (within a tenth) the one with the
    largest determinant is taken (D-optimal): it adds most about the others.

    Parameters
    ----------
    matrix : (n, n) of the tests made, of :func:`information`. poses : (p, n) rad, candidates.
    newton, sigma : force of the new test, N, and error of each of its three readings, m. size : (n,).
    """
    way = directions()
    force = newton * np.tile(way, (len(poses), 1))
    joints = np.repeat(poses, len(way), axis=0)
    rows = joint_contributions(arm, joints, force) * size / sigma
    known = matrix + np.eye(len(size)) / ANYTHING**2
    after = np.linalg.inv(known + np.swapaxes(rows, 1, 2) @ rows)
    before = np.sqrt(np.diag(np.linalg.inv(known)))
    worst = int(np.argmax(before))
    variance = after[:, worst, worst]
    near = np.flatnonzero(variance <= 1.1 * variance.min())
    best = int(near[np.argmin(np.linalg.slogdet(after[near])[1])])
    return NextLoad(joints[best], force[best], worst, float(before[worst]), float(np.sqrt(variance[best])))
