"""The arm that the tests of this room share: the published KR160 with its tool."""

from __future__ import annotations

import numpy as np

from metro.robot.kinematics import Arm, arm_of_cell

ROWS = [
    [0, 90, 500, 250],
    [90, 0, 0, 610],
    [-180, -90, 0, 70],
    [0, 90, 710, 0],
    [0, -90, 0, 0],
    [0, 0, 215, 0],
]  # theta, alpha (deg), d, a (mm)
DH = np.array(ROWS) * (np.pi / 180, np.pi / 180, 1e-3, 1e-3)
TOOL_MM = [212.5, 0.0, 279.91]


def arm_with_tool(**manifest: object) -> Arm:
    """Return the arm; ``manifest``: ``work_in_base`` (else the base), or another ``tool_in_flange_mm``."""
    arm = arm_of_cell({"cell": "kr160", "arm": {"dh": ROWS}}, {"tool_in_flange_mm": TOOL_MM, **manifest})
    assert arm is not None
    return arm
