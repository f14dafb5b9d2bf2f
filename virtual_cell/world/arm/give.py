"""Effects of the contract's library in what gives way: another tool, gaps, preload, springs that harden.

See :mod:`virtual_cell.world.arm.effects`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from virtual_cell.hidden import JOINT, Parameters, drawn_signed, drawn_size
from virtual_cell.units import DEG, MM, Array
from virtual_cell.world.arm.cause import During
from virtual_cell.world.arm.made import Made, Translated, drawn_joint, leading, put
from virtual_cell.world.arm.robot import Robot
from virtual_cell.world.draws import digits

_MDEG = 1e-3 * DEG


def _other_tool(rng: np.random.Generator, _: Robot) -> Parameters:
    """Draw the row of another tool: another length along the flange's x, in a holder that is turned."""
    length = drawn_signed(rng, 155.0, 390.0)
    lateral = rng.uniform(-0.45, 0.45, 2) * length
    d = (length, lateral[0], lateral[1])
    return {name: float(round(v, 2)) for name, v in zip(("dx_mm", "dy_mm", "dz_mm"), d, strict=True)}


def _elsewhere(robot: Robot, p: Parameters) -> Robot:
    return replace(robot, tip_offset=tuple(p[f"d{axis}_mm"] * MM for axis in "xyz"))


def _gap(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = drawn_joint(rng, robot.moves.swaying or (0,))
    return {"joint": joint, "angle_mdeg": drawn_size(rng, 9.5, 33.0)}


def _worn(robot: Robot, p: Parameters) -> Robot:
    gap = put(robot.springs.gap, p["joint"], p["angle_mdeg"] * _MDEG)
    return replace(robot, springs=replace(robot.springs, gap=gap))


def _preload(rng: np.random.Generator, robot: Robot) -> Parameters:
    """Draw a loss (or a gain) of preload, of every joint or of one that gives way along the walls."""
    every = rng.uniform() < 0.6
    size = drawn_signed(rng, 0.235, 0.7) if every else drawn_signed(rng, 0.55, 1.15)
    return {
        "factor": float(round(math.exp(size), 3)),
        "joint": "all" if every else drawn_joint(rng, leading(_gives(robot))),
        "uneven": round(float(rng.uniform(-0.15, 0.15)), 3),
    }


def _gives(robot: Robot) -> Array:
    """How far each joint lets the tip go out of the walls under the cuts, (6,) m."""
    return np.array(robot.moves.give)


def _eased(robot: Robot, p: Parameters) -> Robot:
    """Let bearings carry with one row less (or more) than in the load tests: it depends on the torque a bit.

    Two springs side by side, one of which the preload holds: below some torque the stiffness is another than
    beyond it.
    """
    joint = p.get("joint", "all")
    eased = np.array(robot.springs.eased)
    uneven = p.get("uneven", 0.0)
    eased[slice(None) if joint == "all" else joint - 1] = p["factor"] * np.array([1.0 - uneven, 1.0 + uneven])
    return replace(robot, springs=replace(robot.springs, eased=eased))


def _ease_read(robot: Robot, cuts: Sequence[During], p: Parameters) -> Translated:
    """Factor by which walls would give way more (one joint: the joint) by the springs of the load tests."""
    joint = p.get("joint", "all")
    some = np.arange(6) if joint == "all" else np.array([joint - 1])
    factors, weights = [], []
    for run in cuts:
        full = run.engaged > 0.9
        held = -np.array([robot.arm.gravity(q) for q in run.q[full][:: max(full.sum() // 8, 1)]])
        torque = run.torque[full][:: max(full.sum() // 8, 1)]
        turns = np.einsum("nai,a->ni", run.jacobian[full][:: max(full.sum() // 8, 1)], run.normal)
        tested = robot.springs.elastic(held + torque) - robot.springs.elastic(held)
        cut = robot.springs.in_cut(held + torque) - robot.springs.in_cut(held)
        soft, softer = ((turns * one)[:, some].sum() for one in (tested, cut))
        factors.append(float(soft / softer))
        weights.append(float(softer**2))
    mean = float(np.average(factors, weights=weights))
    spread = float(np.sqrt(np.average((np.array(factors) - mean) ** 2, weights=weights)))
    return {**p, "factor": round(mean, 4)}, {"factor": round(spread, 4)}


def _hard(rng: np.random.Generator, robot: Robot) -> Parameters:
    """Draw how much stiffer a spring is in its last pieces, by the cubic that lies closest to it."""
    joint = drawn_joint(rng, leading(_gives(robot)))
    torque = 600.0 * robot.moves.lever[joint - 1]
    k = float(robot.springs.stiffness[joint - 1])
    return {"joint": joint, "cubic": drawn_size(rng, 18.5, 65.0) * k**3 / torque**2}


def _hardened(robot: Robot, p: Parameters) -> Robot:
    """Let a flexspline come to bear in three pieces that follow the cubic over the loads of the tests."""
    joint = p["joint"] - 1
    k, most = float(robot.springs.stiffness[joint]), 600.0 * robot.moves.lever[joint]
    x = np.linspace(0.0, 1.0, 200) * most / k
    torque = k * x + p["cubic"] * x**3
    x, torque = x[torque <= 1.3 * most], torque[torque <= 1.3 * most]
    ends = [0, len(x) // 3, 2 * len(x) // 3, len(x) - 1]
    slopes = [float(np.polyfit(x[a : b + 1], torque[a : b + 1], 1)[0]) for a, b in pairwise(ends)]
    springs = replace(
        robot.springs,
        stiffness=put(robot.springs.stiffness, p["joint"], slopes[1]),
        knees=put(robot.springs.knees, p["joint"], torque[[ends[1], ends[2]]]),
        ratio=put(robot.springs.ratio, p["joint"], np.array([slopes[0], slopes[2]]) / slopes[1]),
    )
    return replace(robot, springs=springs)


def _hard_read(robot: Robot, _: Sequence[During], p: Parameters) -> Translated:
    """T = k x + c x³ closest to the three pieces; its error: how far c goes with the range of torque."""
    joint = p["joint"] - 1
    found = []
    for share in (0.8, 1.0, 1.25):
        torque = np.linspace(0.0, share * 600.0 * robot.moves.lever[joint], 100)
        x = robot.springs.elastic(np.outer(torque, np.eye(6)[joint]))[:, joint]
        found.append(float(np.linalg.lstsq(np.stack([x, x**3], axis=1), torque, rcond=None)[0][1]))
    return {**p, "cubic": digits(found[1])}, {"cubic": digits(float(np.ptp(found)) / 2.0)}


GIVE: Mapping[str, Made] = {
    "tool_offset_error": Made("dx_mm dy_mm dz_mm", _other_tool, _elsewhere),
    "joint_backlash": Made(f"{JOINT} angle_mdeg", _gap, _worn),
    "stiffness_scale": Made(f"factor {JOINT}|all? uneven?", _preload, _eased, _ease_read),
    "stiffness_hardening": Made(f"{JOINT} cubic", _hard, _hardened, _hard_read),
}
