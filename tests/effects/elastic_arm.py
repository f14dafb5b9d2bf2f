"""Cuts and load tests of an arm whose joints do what they are told to: for the tests of the joints' effects.

Nothing of the statics or of the torsion of the models is used: where joints take the tip comes from
differences of the forward kinematics, torques from virtual work, twists from a root finder.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.optimize import brentq

from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.setting import CutWall, LoadTest
from metro.observables.problem import Block, Problem
from metro.robot.kinematics import Arm, arm_of_cell

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
STIFFNESS = np.array([1.8e6, 2.1e6, 1.3e6, 3.1e5, 3.9e5, 2.3e5])
MANIFEST = {
    "tool_in_flange_mm": [212.5, 0.0, 279.91],
    "work_in_base": {"xyz_mm": [1510, -210, 590], "rpy_deg": [0, 0, 30]},
}
ARM = arm_of_cell({"arm": {"dh": DH}}, MANIFEST)
POSES = np.radians(
    [
        (-20.3, -13.9, -4.4, -61.7, 34.9, 56.7),
        (15.0, -25.0, 20.0, 30.0, 45.0, -20.0),
        (-35.0, -5.0, 5.0, -40.0, -50.0, 60.0),
        (5.0, -40.0, 45.0, 70.0, 30.0, 15.0),
        (40.0, 10.0, -20.0, -15.0, 60.0, -75.0),
    ]
)
DOWN, UP = np.array([110.0, 150.0, 40.0]), np.array([-120.0, 70.0, 45.0])  # feed frame
POINTS, SPACING, CUTOFF = 41, 1e-3, 8e-3
FEED = 0.012  # m/s


def moves(arm, q, step=1e-6):
    """Columns ∂x_tip/∂q_i in the work frame, by differences: (..., 3, 6)."""
    return np.stack(
        [(arm.tip(q + step * e) - arm.tip(q - step * e)) / (2 * step) for e in np.eye(6)], axis=-1
    )


def twisted(torque, stiffness, cubic):
    """Twist that balances a torque, by bracketing."""
    if cubic == 0.0:
        return torque / stiffness
    far = abs(torque) / stiffness + 1e-12
    return brentq(lambda x: stiffness * x + cubic * x**3 - torque, -far, far, xtol=1e-15, rtol=1e-13)


def deflection(arm, q, force, truth, *, cutting, rate=(0.0,) * 6):
    """Where the tip goes under a force on it; ``truth``: gap (mdeg), cubic, factor by joint 1 … 6.

    Also friction (N m) on the link side of the springs, against which the joints turn at ``rate``; drag (N m)
    that has to be overcome before a gap is passed; ``springs``: twists (6,) of torques (6,).
    """
    by_joint = moves(arm, q)
    torque = by_joint.T @ force
    twist = np.zeros(6)
    for i in range(6):
        factor = truth.get("factor", {}).get(i + 1, 1.0) if cutting else 1.0
        twist[i] = twisted(torque[i] / factor, STIFFNESS[i], truth.get("cubic", {}).get(i + 1, 0.0))
        if cutting:
            held = truth.get("friction", {}).get(i + 1, 0.0) * np.sign(rate[i])
            twist[i] -= held / factor / STIFFNESS[i]
            passed = abs(torque[i]) > truth.get("drag", {}).get(i + 1, 0.0)
            twist[i] += (
                passed * np.sign(torque[i]) * np.radians(truth.get("gap", {}).get(i + 1, 0.0) * 1e-3) / 2
            )
    if "springs" in truth:
        twist += truth["springs"](torque) - torque / STIFFNESS
    return by_joint @ twist


@cache
def path(pose, degrees):
    """Joint angles (m, 6) along 40 mm of feed through a pose."""
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    q, angles = POSES[pose].copy(), []
    for x in SPACING * np.arange(POINTS):
        for _ in range(3):
            q = q + np.linalg.pinv(moves(ARM, q)) @ (ARM.tip(POSES[pose]) + x * along - ARM.tip(q))
        angles.append(q)
    return np.array(angles)


def cut(order, role, place, size, *, truth, rng):
    """One wall at a place (pose, direction of feed, side); its force is 1 % off what is known of it."""
    pose, degrees, way = place
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    known = turn @ (size * (DOWN if way == "down" else UP))
    normal = turn[:, 1] * (1.0 if way == "down" else -1.0)
    q = path(pose, degrees)
    arm = Arm(ARM.dh, ARM.tool + np.array(truth.get("offset", (0, 0, 0))) * 1e-3, ARM.work)
    force = known + 0.01 * np.linalg.norm(known) * rng.normal(size=3)
    rate = np.gradient(q, SPACING, axis=0) * FEED
    z = [deflection(arm, one, force, truth, cutting=True, rate=v) for one, v in zip(q, rate, strict=True)]
    z = np.array(z) @ normal
    kept = np.arange(4, POINTS - 4, 4)
    setting = CutWall(q, q, rate, np.tile(known, (POINTS, 1)), normal, SPACING, CUTOFF, kept, "dynamometer")
    softness = DeformationModel(ARM).per_newton(setting, 1 / STIFFNESS)
    setting = replace(setting, harder=np.linalg.norm(known) * softness)
    return Block(
        run=f"r{order:02d}",
        condition=f"{role} {pose} {degrees} {way} {size}",
        role=role,
        order=order,
        measured=z[kept] + 1e-6 * rng.normal(size=len(kept)),
        sigma=np.full(len(kept), 1e-6),
        setting=setting,
        axis=np.full(len(kept), "z"),
        zeros=np.ones((len(kept), 1)),
        zero_sd=np.array([2e-6]),
        coordinates={},
        unidentified=0.01 * np.linalg.norm(known) * softness,
    )


def load_tests(pose, truth, rng, sizes=(200.0, 600.0)):
    """Weights pulled along each axis both ways in a pose, read to 5 µm."""
    force = np.vstack([sign * size * np.eye(3) for size in sizes for sign in (1, -1)])
    q = np.tile(POSES[pose], (len(force), 1))
    arm = Arm(ARM.dh, ARM.tool + np.array(truth.get("offset", (0, 0, 0))) * 1e-3, ARM.work)
    moved = np.array([deflection(arm, q[0], one, truth, cutting=False) for one in force])
    moved += 5e-6 * rng.normal(size=moved.shape)
    return Block(
        run=f"load tests {pose}",
        condition=f"load tests {pose}",
        role="calibrate",
        order=0,
        measured=moved.ravel(),
        sigma=np.full(moved.size, 5e-6),
        setting=LoadTest(q, force, np.ones(moved.shape, dtype=bool)),
        axis=np.tile(["load x", "load y", "load z"], len(force)),
        zeros=np.zeros((moved.size, 0)),
        zero_sd=np.zeros(0),
        coordinates={},
    )


EVERY_WAY = tuple(
    (pose, degrees, way) for pose in (0, 1, 2, 3) for degrees in (0, 90) for way in ("down", "up")
)
ONE_WAY = ((0, 0, "down"),)


def problem(truth, seed, *, ways=EVERY_WAY, sizes=(0.5, 1.3), repeats=1, base=None):
    """Cuts in poses and directions of feed, at several depths, load tests in five poses."""
    rng = np.random.default_rng(seed)
    plans = [(way, size) for way in ways for size in sizes for _ in range(repeats)]
    blocks = [load_tests(pose, truth, rng) for pose in range(len(POSES))]
    for order, (place, size) in enumerate(plans, start=1):
        blocks.append(cut(order, "identify", place, size, truth=truth, rng=rng))
    blocks.append(cut(99, "validate", ways[-1], 0.9, truth=truth, rng=rng))
    model = base or DeformationModel(ARM)
    return Problem("deformation", "mm", 1e-3, model, tuple(blocks), np.full(6, 0.005), 0.01)
