"""What joint logs of an arm that moves freely say: friction, weight, inertia, and how well it is known.

Tables ``joint_log`` (a row per run and joint), ``joint_log_curve`` (friction by speed), ``joint_log_terms``
(what friction has beyond Coulomb and viscous). A log of currents whose drive constants are not known is
evaluated in amperes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import AXES, positions
from metro.observables.arm.carried_load import payload_of_logs
from metro.observables.quantity import quantity
from metro.robot.drives import Drives, drives_of_cell
from metro.robot.joint_dynamics import JointFit, fit_joints, free_motion
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.motion import Motion
from metro.robot.tracking import tracking_error
from metro.units import DEG, JSON, MM, UM, Array

LEAST_SAMPLES = 200  # some for each of the thirty stretches that the errors are from
BINS = 12  # of speed, per direction, in the figure
NO_ARM = "the cell has no arm (arm.dh or arm.urdf in cell.yaml): weight and friction cannot be separated"
QUANTITIES = ("coulomb", "viscous", "offset", "gravity", "inertia")
UNITS = {
    "coulomb": "N m",
    "viscous": "N m s/rad",
    "offset": "N m",
    "gravity": "N m",
    "inertia": "kg m2",
}
IN_AMPERES = {
    "coulomb": "A",
    "viscous": "A s/rad",
    "offset": "A",
    "gravity": "A",
    "inertia": "A s2/rad",
}


@dataclass(frozen=True, eq=False)
class JointLog:
    """A joint log of n axes: ``time`` (m,) s; ``q`` (m, n) rad (m of a linear axis); ``torque`` (m, n) N m.

    ``commanded`` (m, n) as ``q``, NaN where there are no set-points; ``driven`` (n,) bool, whether a torque
    or a current was logged; ``amperes`` : whether ``torque`` is in amperes; ``warmth``
    (m, n) °C of the joints, NaN where it was not logged; ``loaded`` : yes, no or "".
    """

    run: str
    time: Array
    q: Array
    commanded: Array
    torque: Array
    driven: np.ndarray
    amperes: bool
    warmth: Array
    loaded: str

    @property
    def long(self) -> bool:
        """Whether it has enough samples to be filtered and fitted."""
        return len(self.time) >= LEAST_SAMPLES


def joint_logs(batch: Batch, read: Tables) -> list[JointLog]:
    """Return the joint logs of a batch, in the order of the run table."""
    logs = []
    for run in batch.with_files("joint_log"):
        table = read("joint", run)
        if len(table):
            logs.append(_log(batch, run, table))
    return logs


def _log(batch: Batch, run: str, table: pd.DataFrame) -> JointLog:
    there = [str(name) for name in table.columns[table.notna().any()]]
    names = positions(there)
    units = np.array([DEG if name.endswith("_deg") else MM for name in names])
    columns = [name.replace("_", "_set_") for name in names]
    torque, current = (
        np.column_stack([table[f"{name}{i}_{unit}"].to_numpy(dtype=float) for i in AXES[: len(names)]])
        for name, unit in (("tau", "nm"), ("current", "a"))
    )
    constant = drives_of_cell(batch.cell, len(names)).constant
    by_current = np.isfinite(current).all(axis=0)
    amperes = bool((by_current & ~np.isfinite(constant)).any())
    gain = np.where(by_current, 1.0 if amperes else constant, 1.0)
    drive = np.where(by_current, current * gain, torque)
    # the drive of a linear axis pulls by a force, through a transmission of which the cell says nothing
    driven = np.isfinite(drive).all(axis=0) & np.array([name.endswith("_deg") for name in names])
    return JointLog(
        run,
        table["t_s"].to_numpy(dtype=float),
        table[names].to_numpy(dtype=float) * units,
        table[columns].to_numpy(dtype=float) * units,
        np.where(driven, drive, 0.0),
        driven,
        amperes,
        _warmth(table, len(names)),
        str(batch.runs["loaded"].get(run, "")),
    )


def term_unit(name: str, level: str) -> str:
    """Return the unit of a further term of friction; ``level`` is that of Coulomb friction."""
    per_speed = f"{level} s" if name.startswith("viscous") else level
    by_warmth = "(rad K)" if name.startswith("viscous") else "K"
    if name.endswith("temperature"):
        return f"{per_speed}/{by_warmth}"
    return {"load": "1", "viscous_time": f"{per_speed}/rad"}.get(name, level)


def _warmth(table: pd.DataFrame, count: int) -> Array:
    """Temperature of each joint (m, n), °C: its own, else that of the arm; NaN where neither was logged."""
    own = table[[f"temperature{i}_c" for i in AXES[:count]]].to_numpy(dtype=float)
    return np.where(np.isfinite(own), own, table[["temperature_c"]].to_numpy(dtype=float))


def observe(batch: Batch, read: Tables) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return the tables of the joint logs, and the blocks ``joints`` and ``calibration`` that follow."""
    logs = joint_logs(batch, read)
    if not logs:
        return {}, {}
    arm = arm_of_cell(batch.cell, batch.manifest)
    drives = drives_of_cell(batch.cell, logs[0].q.shape[1])
    rows: list[JSON] = []
    curves, terms = [], []
    block: JSON = {}
    motions: dict[str, Motion] = {}
    for log in logs:
        fits: tuple[JointFit, ...] = ()
        if log.long:
            motions[log.run] = free_motion(log.time, log.q, log.torque)
            # temperatures are filtered and thinned as torques are
            warmth = (
                free_motion(log.time, log.q, log.warmth).torque if np.isfinite(log.warmth).any() else None
            )
            fits = () if arm is None else fit_joints(arm.dh, motions[log.run], log.driven, warmth)
        rows += _rows(log, fits, arm, drives)
        curves += [_curve(fit).assign(run=log.run) for fit in fits]
        level = (IN_AMPERES if log.amperes else UNITS)["coulomb"]
        terms += [
            {"run": log.run, "joint": f.joint + 1, **vars(term), "unit": term_unit(term.name, level)}
            for f in fits
            for term in f.terms
        ]
        block[log.run] = _block(log, fits, drives)
    tables = {"joint_log": pd.DataFrame(rows)}
    tables |= {"joint_log_curve": pd.concat(curves, ignore_index=True)} if curves else {}
    tables |= {"joint_log_terms": pd.DataFrame(terms)} if terms else {}
    carried, more = payload_of_logs(arm, logs, motions, drives)
    about = {"drives": drives.source, **({"not_identified": {"friction": NO_ARM}} if arm is None else {})}
    return tables | more, {"joints": {**about, "runs": block}, **carried}


def with_drives(
    pair: tuple[float, float], log: JointLog, fit: JointFit, drives: Drives
) -> tuple[float, float]:
    """Return a value and its standard error, that of the drive's constant in it; amperes have none."""
    relative = 0.0 if log.amperes else drives.relative[fit.joint]
    return pair[0], float(np.hypot(pair[1], relative * pair[0]))


def _block(log: JointLog, fits: tuple[JointFit, ...], drives: Drives) -> JSON:
    """Return the identified quantities of a run, a list over the joints that move."""
    units, dof = IN_AMPERES if log.amperes else UNITS, 29
    return {
        "joints": [fit.joint + 1 for fit in fits],
        **{
            name: [
                quantity(*with_drives(getattr(fit, name), log, fit, drives), units[name], dof) for fit in fits
            ]
            for name in QUANTITIES
        },
        "beyond": [
            {
                "joint": fit.joint + 1,
                "by": t.name,
                "value": quantity(t.value, t.sd, term_unit(t.name, units["coulomb"]), dof),
                "p": t.p,
            }
            for fit in fits
            for t in fit.terms
        ],
    }


def _rows(log: JointLog, fits: tuple[JointFit, ...], arm: Arm | None, drives: Drives) -> list[JSON]:
    """One row per joint: what it did, how it followed, and what was identified of it."""
    by_joint = {fit.joint: fit for fit in fits}
    rate = np.gradient(log.q, log.time, axis=0)
    tip = np.nan
    if arm is not None and np.isfinite(log.commanded).all():
        tip = float(np.sqrt(np.mean(np.sum(tracking_error(arm, log.q, log.commanded).flange ** 2, axis=1))))
    rows = []
    for j in range(log.q.shape[1]):
        off = log.q[:, j] - log.commanded[:, j]
        row: JSON = {
            "run": log.run,
            "joint": j + 1,
            "loaded": log.loaded,
            "unit": "A" if log.amperes else "N m",
            "low_deg": log.q[:, j].min() / DEG,
            "high_deg": log.q[:, j].max() / DEG,
            "fastest_deg_s": float(np.quantile(np.abs(rate[:, j]), 0.999)) / DEG,
            "torque_rms": float(np.sqrt(np.mean(log.torque[:, j] ** 2))) if log.driven[j] else np.nan,
            "tracking_mdeg": float(np.sqrt(np.mean(off**2))) / DEG * 1e3,
            "flange_um": tip / UM,
        }
        fit = by_joint.get(j)
        row |= _of_fit(log, fit, drives) if fit else {"remark": _unfitted(log, j, arm)}
        rows.append(row)
    return rows


def _unfitted(log: JointLog, joint: int, arm: Arm | None) -> str:
    if not log.driven[joint]:
        return "neither torque nor current was logged, or it is a linear axis"
    if not log.long:
        return f"the log has {len(log.time)} samples, at least {LEAST_SAMPLES} are needed"
    return NO_ARM if arm is None else "too slow for the encoder to resolve the direction"


def _of_fit(log: JointLog, fit: JointFit, drives: Drives) -> JSON:
    row: JSON = {"noise": fit.noise, "determined": fit.determined, "condition": fit.condition}
    lost = [name for name in ("coulomb", "viscous") if not _known(getattr(fit, name), fit)]
    for name in QUANTITIES:
        value, sd = with_drives(getattr(fit, name), log, fit, drives)
        row |= {name: np.nan if name in lost else value, f"{name}_sd": np.nan if name in lost else sd}
    return row | {"remark": _remark(fit, lost)}


def _known(pair: tuple[float, float], fit: JointFit) -> bool:
    """Return whether a friction is known better than the whole range of the joint's torque."""
    return bool(np.isfinite(pair[0]) and 2.0 * pair[1] * min(1.0, fit.fastest) <= fit.swing)


def _remark(fit: JointFit, lost: list[str]) -> str:
    if not lost:
        return ""
    if not all(fit.ways):
        return "turns one way only, so that Coulomb friction looks like weight"
    return f"speeds or poses that differ too little to determine the {' and '.join(lost)} friction"


def _curve(fit: JointFit) -> pd.DataFrame:
    """Friction by speed: mean and standard deviation of bins with equal numbers of samples."""
    rows = []
    for sign in (1, -1):
        inside = sign * fit.speed > 0
        speed, torque = fit.speed[inside], fit.resists[inside]
        parts = np.array_split(np.argsort(speed), min(BINS, len(speed))) if len(speed) else ()
        rows += [(fit.joint + 1, speed[p].mean() / DEG, torque[p].mean(), torque[p].std()) for p in parts]
    return pd.DataFrame(rows, columns=["joint", "speed_deg_s", "friction", "sd"])
