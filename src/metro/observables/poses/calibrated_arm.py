"""The calibrated arm in the place of the declared one, for all that a batch of a machining robot computes.

The corrected rows become a chain, which can have the tilt of nearly parallel axes that four numbers of a row
cannot. Base and flange stay where the cell declares them: where the instrument stood says nothing of either.
Effects on the joints are not in it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.batch.batch import Batch
from metro.robot.calibration.fit import Fit
from metro.robot.calibration.rows import standard_rows
from metro.robot.chain import FIXED, PRISMATIC, REVOLUTE, screw
from metro.robot.kinematics import Geometry, forward
from metro.units import JSON, Array

RECORDS = ("robot_log", "idle_log", "joint_log", "path", "profile", "scan")  # what an arm's geometry serves
Z = [0.0, 0.0, 1.0]


def calibrated_chain(fit: Fit, geometry: Geometry) -> list[JSON]:
    """Return the calibrated arm as the entry ``chain`` of a cell's arm, in m.

    ``geometry``: the declared arm, whose flange the last frame of the rows is held against.
    """
    rows, place, prismatic = standard_rows(geometry)
    nominal = place.copy()
    chain: list[JSON] = [_fixed(place)]
    for declared, corrected, shifts in zip(rows, fit.state.rows, prismatic, strict=True):
        nominal = nominal @ _row(np.append(declared, 0.0))
        chain.append({"kind": PRISMATIC if shifts else REVOLUTE, "origin": np.eye(4).tolist(), "axis": Z})
        chain.append(_fixed(_row(corrected)))
    flange = forward(geometry, np.zeros(len(rows)))
    return [*chain, _fixed(np.linalg.inv(nominal) @ flange)]


def with_calibrated_arm(batch: Batch, identified: JSON) -> Batch:
    """Return a batch whose arm is the one that its last series of poses has found, if any has."""
    found = [one["arm"] for run, one in (identified.get("pose") or {}).items() if run != "not_identified"]
    if not found:
        return batch
    kept = {key: value for key, value in batch.cell["arm"].items() if key not in ("dh", "base", "joints")}
    arm = {**kept, "chain": found[-1]}
    return replace(batch, cell={**batch.cell, "arm": arm})


def serves(batch: Batch) -> bool:
    """Whether anything beside the poses is computed with the geometry of the arm."""
    return bool(batch.with_files(*RECORDS, any_of=True))


def _row(row: Array) -> Array:
    """Return Rz(θ) Tz(d) Tx(a) Rx(α) Ry(β) of a row θ, α, d, a, β."""
    theta, alpha, d, a, beta = row
    return np.asarray(screw(2, theta, d) @ screw(0, alpha, a) @ screw(1, beta, 0.0))


def _fixed(place: Array) -> JSON:
    return {"kind": FIXED, "origin": place.tolist(), "axis": Z}
