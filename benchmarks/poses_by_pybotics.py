"""The UR10's random series by another package: pybotics, which has to be installed beside NumPy and SciPy.

``python benchmarks/poses_by_pybotics.py measurements_random_poses.csv``: a random fifth is left out, the same
as in ``metro.robot.calibration.held_out``; the medians of its distances are printed for the nominal geometry
with base and tool fitted, and for all parameters of modified rows, by the package's own measure of accuracy.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path

import numpy as np
from pybotics.optimization import OptimizationHandler, compute_absolute_errors, optimize_accuracy
from pybotics.robot import Robot
from scipy.optimize import least_squares

# Published by the manufacturer, as in config/cells/ur10.yaml: θ₀, α (rad), d, a (mm), standard rows
ROWS = np.array(
    [
        [0, np.pi / 2, 127.3, 0],
        [0, 0, 0, -612.0],
        [0, 0, 0, -572.3],
        [0, np.pi / 2, 163.941, 0],
        [0, -np.pi / 2, 115.7, 0],
        [0, 0, 92.2, 0],
    ]
)
FIFTH, STEPS = 5, 40


def read(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Return joints (m, 6), rad, and positions (m, 3), mm."""
    with Path(path).open(newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines, delimiter=";"))
    joints = [name for name in rows[0] if name.endswith("_joint")]
    place = [f"measurement_{axis}" for axis in "xyz"]
    return tuple(
        np.array([[float(row[name].replace(",", ".")) for name in names] for row in rows])
        for names in (joints, place)
    )


def main() -> None:
    """Fit, and print the medians of what was left out."""
    q, at = read(sys.argv[1])
    out = np.random.default_rng(0).permutation(len(q)) % FIFTH == 0
    modified = np.column_stack([np.r_[0.0, ROWS[:-1, 1]], np.r_[0.0, ROWS[:-1, 3]], ROWS[:, 0], ROWS[:, 2]])
    robot = Robot.from_parameters(modified)
    robot.world_frame = laid_on(np.array([robot.fk(each)[:3, 3] for each in q[~out]]), at[~out])
    position = [True] * 3 + [False] * 3
    for name, chain in (("nominal", False), ("all parameters", True)):
        started = time.perf_counter()
        handler = OptimizationHandler(
            robot, kinematic_chain_mask=[chain] * 24, tool_mask=position, world_mask=[True] * 6
        )
        first = handler.generate_optimization_vector()
        found = least_squares(
            optimize_accuracy, first, args=(handler, q[~out], at[~out]), x_scale="jac", max_nfev=STEPS
        )
        handler.apply_optimization_vector(found.x)
        robot = handler.robot
        errors = compute_absolute_errors(q[out], at[out], robot)
        seconds = time.perf_counter() - started
        print(
            f"{name}: median {np.median(errors):.3f} mm, 95th percentile {np.percentile(errors, 95):.2f} mm "
            f"of {out.sum()} poses; {seconds:.0f} s, {found.message}"
        )


def laid_on(points: np.ndarray, onto: np.ndarray) -> np.ndarray:
    """Return the motion (4, 4) that lays points on others by least squares."""
    first, second = points.mean(axis=0), onto.mean(axis=0)
    left, _, right = np.linalg.svd((points - first).T @ (onto - second))
    turn = right.T @ np.diag([1, 1, np.linalg.det(right.T @ left.T)]) @ left.T
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, second - turn @ first
    return motion


if __name__ == "__main__":
    main()
