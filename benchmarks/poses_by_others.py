"""The UR10's random series by other packages: pybotics and robotkinecal, which have to be installed.

``python benchmarks/poses_by_others.py measurements_random_poses.csv``: a random fifth is left out, the same
as in ``metro.robot.calibration.held_out``; the medians of its distances are printed, for the nominal geometry
with base and tool fitted, and for what each package calibrates by its own fit.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path

import numpy as np
import roboticstoolbox as rtb
from pybotics.optimization import OptimizationHandler, compute_absolute_errors, optimize_accuracy
from pybotics.robot import Robot
from robotkinecal.calibration import SerialRobotKineCal
from scipy.optimize import least_squares
from spatialmath import SE3

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
    robot = by_pybotics(q, at, out)
    by_robotkinecal(q, at, out, robot)


def by_pybotics(q: np.ndarray, at: np.ndarray, out: np.ndarray) -> Robot:
    """Fit base and tool, then all parameters of modified rows; return the robot with base and tool alone."""
    modified = np.column_stack([np.r_[0.0, ROWS[:-1, 1]], np.r_[0.0, ROWS[:-1, 3]], ROWS[:, 0], ROWS[:, 2]])
    robot = Robot.from_parameters(modified)
    robot.world_frame = laid_on(np.array([robot.fk(each)[:3, 3] for each in q[~out]]), at[~out])
    position = [True] * 3 + [False] * 3
    fitted = []
    for name, chain in (("pybotics, nominal", False), ("pybotics, all parameters", True)):
        started = time.perf_counter()
        handler = OptimizationHandler(
            fitted[-1] if fitted else robot,
            kinematic_chain_mask=[chain] * 24,
            tool_mask=position,
            world_mask=[True] * 6,
        )
        first = handler.generate_optimization_vector()
        found = least_squares(
            optimize_accuracy, first, args=(handler, q[~out], at[~out]), x_scale="jac", max_nfev=STEPS
        )
        handler.apply_optimization_vector(found.x)
        fitted.append(handler.robot)
        said(name, compute_absolute_errors(q[out], at[out], handler.robot), started)
    return fitted[0]


def by_robotkinecal(q: np.ndarray, at: np.ndarray, out: np.ndarray, robot: Robot) -> None:
    """Fit the screws of the joints and the point, which start where ``robot`` has them; lengths in m."""
    started = time.perf_counter()
    base, tool = robot.world_frame.copy(), robot.tool.matrix.copy()
    base[:3, 3] /= 1e3
    tool[:3, 3] /= 1e3
    screws, frame = [], base
    for theta, alpha, d, a in ROWS * (1, 1, 1e-3, 1e-3):
        axis, origin = frame[:3, 2], frame[:3, 3]
        screws.append(rtb.PoERevolute(axis, origin))
        frame = frame @ (SE3.Rz(theta) * SE3.Tz(d) * SE3.Tx(a) * SE3.Rx(alpha)).A
    arm = rtb.PoERobot(screws, SE3(frame @ tool, check=False))
    solver = SerialRobotKineCal(arm)
    solver.N_JOINTS, solver.joint_screw_axis = len(ROWS), solver.joint_screw_axis[1 : len(ROWS) + 1]
    solver.set_observations(list(q[~out]), list(at[~out] / 1e3))
    solver.solve(max_iterations=STEPS)
    seen = np.array([solver.forward_kinematics(len(ROWS) + 1, each).t for each in q[out]])
    said("robotkinecal, screws", np.linalg.norm(1e3 * seen - at[out], axis=1), started)


def said(name: str, errors: np.ndarray, started: float) -> None:
    """Print the errors of the poses that were left out."""
    seconds = time.perf_counter() - started
    print(
        f"{name}: median {np.median(errors):.3f} mm, 95th percentile {np.percentile(errors, 95):.2f} mm "
        f"of {len(errors)} poses; {seconds:.0f} s",
        flush=True,
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
