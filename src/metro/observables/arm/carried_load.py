"""The payload by joint logs with and without it: ``loaded`` of runs.csv is yes and no."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.observables.arm.calibration import carried_json
from metro.observables.quantity import quantity
from metro.robot.carried_load import Evidence, Load, carried_load, of_logs, of_pair
from metro.robot.drives import Drives
from metro.robot.kinematics import Arm
from metro.robot.motion import Motion
from metro.robot.rigid_body import PARAMETERS, torque_regressor
from metro.robot.same_motion import Pair, pair_of
from metro.units import JSON

if TYPE_CHECKING:
    from metro.observables.arm.joint_logs import JointLog

NO_CONSTANTS = (
    "the logs hold currents, and the cell states no drives.torque_per_ampere_nm_a: a mass takes newton metres"
)
DRAWN = 400  # places of a course


def payload_of_logs(
    arm: Arm | None, logs: Sequence[JointLog], motions: Mapping[str, Motion], drives: Drives
) -> tuple[JSON, dict[str, pd.DataFrame]]:
    """Return the block ``calibration`` of the payload, and the tables of how the joints show it.

    Tables ``payload_joints`` (of each joint the factor that fits it alone, its error, rms of residuals) and
    ``payload_course`` (difference of the torques of two logs of one motion, measured and of the load).
    """
    if not any(log.loaded == "yes" for log in logs):
        return {}, {}
    bare, loaded = ([log for log in logs if log.loaded == state and log.long] for state in ("no", "yes"))
    missing = _missing(arm, bare, loaded)
    if missing or arm is None:
        return {"calibration": {"not_identified": {"payload": missing}}}, {}
    count = len(drives.constant)
    pairs = [(one, two, pair) for two in loaded for one in bare if (pair := _pair(one, two)) is not None]
    driven = np.all([log.driven for log in (*bare, *loaded)], axis=0)
    evidence: list[list[Evidence]] = [[] for _ in range(count)]
    for joint in np.flatnonzero(driven):
        if pairs:
            evidence[joint] = [part for *_, pair in pairs for part in of_pair(arm.dh, pair, int(joint))]
        else:
            used = [*bare, *loaded]
            moved = [motions[log.run] for log in used]
            evidence[joint] = of_logs(arm.dh, moved, [log.loaded == "yes" for log in used], int(joint))
    try:
        load = carried_load(evidence, drives.covariance)
    except ValueError as reason:
        return {"calibration": {"not_identified": {"payload": str(reason)}}}, {}
    used_pairs = [[one.run, two.run] for one, two, _ in pairs]
    tables = {"payload_joints": _by_joint(load)}
    if pairs:
        tables["payload_course"] = _course(arm, pairs[0][2], load, driven)
    return {"calibration": {"payload": _json(load, drives, used_pairs)}}, tables


def _missing(arm: Arm | None, bare: Sequence[JointLog], loaded: Sequence[JointLog]) -> str:
    if not loaded:
        return "no joint log with the load has enough samples"
    if not bare:
        return "no joint log without the load that has enough samples: a run with loaded: no in runs.csv"
    if arm is None:
        return "the cell has no arm (arm.dh or arm.urdf in cell.yaml): where the joints are is not known"
    if any(log.amperes for log in (*bare, *loaded)):
        return NO_CONSTANTS
    return ""


def _pair(one: JointLog, two: JointLog) -> Pair | None:
    return pair_of((one.time, one.q, one.torque), (two.time, two.q, two.torque))


def _json(load: Load, drives: Drives, pairs: list[list[str]]) -> JSON:
    block = carried_json(load.carried, range(1, len(load.carried.rms) + 1))
    dof = load.carried.dof
    factors = [quantity(value, sd, "1", dof) if np.isfinite(value) else None for value, sd in load.by_joint]
    return block | {
        "mass_by_logs_alone": quantity(load.carried.mass, load.sd_of_logs, "kg", dof),
        "by_joint": factors,
        "scatter_of_drives": load.scatter,
        "drives": drives.source,
        "pairs": pairs,
    }


def _by_joint(load: Load) -> pd.DataFrame:
    columns = {"joint": np.arange(len(load.by_joint)) + 1, "factor": load.by_joint[:, 0]}
    return pd.DataFrame({**columns, "factor_sd": load.by_joint[:, 1], "rms_nm": load.carried.rms})


def _course(arm: Arm, pair: Pair, load: Load, driven: np.ndarray) -> pd.DataFrame:
    """Difference of the torques of a pair, and the load's, along the motion."""
    keep = np.unique(np.linspace(0, len(pair.angle) - 1, DRAWN).astype(int))
    links = torque_regressor(arm.dh, pair.angle[keep], pair.rate[keep], pair.acceleration[keep])
    own = links[..., -PARAMETERS:][..., : len(load.values)] @ load.values
    parts = []
    for joint in np.flatnonzero(driven):
        measured = (pair.second - pair.first)[keep, joint]
        columns = {"joint": joint + 1, "place": keep / (len(pair.angle) - 1)}
        parts.append(pd.DataFrame({**columns, "measured_nm": measured, "load_nm": own[:, joint]}))
    return pd.concat(parts, ignore_index=True)
