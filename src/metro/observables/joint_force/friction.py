"""Friction of an arm's joints from its idle runs, and the joints for which it cannot be identified."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import Axes
from metro.observables.arm.idle_runs import of_idle_logs
from metro.observables.problem import Refusal
from metro.robot.drives import declared, drives_of_cell
from metro.robot.friction import Friction
from metro.robot.kinematics import Geometry, arm_of_cell
from metro.robot.motion import Motion
from metro.robot.rigid_body import gravity_regressor
from metro.same import Same
from metro.units import DEG, JSON, Array

UNITS = {"coulomb": "N m", "viscous": "N m s/rad"}
LINEAR = "a linear axis, whose drive is not evaluated"
FALLING = "friction falls with the speed here, as it does just above rest: no viscous friction is seen"
BINS = 12  # of speed, per direction, in the figure
CLEAR = 0.2  # of a Coulomb level, the residual of the idle runs below which the state of friction is seen


def observe(batch: Batch, read: Tables) -> dict[str, pd.DataFrame] | Refusal:
    """Tabulate the friction that all idle runs together identify.

    Tables ``joint_friction`` (a row per joint: Coulomb and viscous friction, N m and N m s/rad, with their
    95 % intervals; blank where the runs do not identify it, and ``remark`` gives the reason) and
    ``joint_friction_curve`` (mean of the torque less that of the weight, by joint and speed).
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    found = of_idle_logs(Same(batch), Same(read))
    if arm is None or isinstance(found, Refusal):
        return found if isinstance(found, Refusal) else Refusal("")
    friction, log = found
    drives = drives_of_cell(batch.cell, len(arm.axes))
    relative = drives.relative if declared(batch.cell) else np.zeros(len(arm.axes))
    return {
        "joint_friction": _table(friction, log, relative, arm.axes),
        "joint_friction_curve": _curve(friction, log),
    }


def rubbed(found: tuple[Friction, Motion] | Refusal, dh: Geometry, q: Array, torque: Array) -> Array:
    """Return what friction was in idle torques (m, n), N m, over its Coulomb level.

    NaN for a joint whose level is not identified, or not well above what the identification leaves.
    """
    if isinstance(found, Refusal):
        return np.full(q.shape, np.nan)
    friction = found[0]
    level, _, offset = friction.value.T
    clear = friction.noise < CLEAR * np.nan_to_num(level)
    weight = gravity_regressor(dh, q) @ friction.others
    return np.asarray((torque - weight - np.nan_to_num(offset)) / np.where(clear, level, np.nan))


def _table(friction: Friction, log: Motion, relative: Array, axes: Axes) -> pd.DataFrame:
    """Tabulate the friction; ``relative`` (n,) is the standard uncertainty of the torques, where declared."""
    fastest = np.where(log.moving, np.abs(log.rate), 0.0).max(axis=0)
    drives = np.hypot(friction.sd, relative[:, None] * np.nan_to_num(friction.value))
    interval = replace(friction, sd=drives).interval()
    half = 0.5 * np.ptp(interval, axis=-1)
    rows = []
    for j in range(len(fastest)):
        value = friction.value[j].copy()
        # Friction whose error exceeds the whole range of the motor's torque is not identified.
        swing = float(np.ptp(log.torque[:, j]))
        value[:2][half[j, :2] * (1.0, fastest[j]) > swing] = np.nan
        falling = bool(interval[j, 1, 1] < 0.0)  # no viscous friction does: it is the fall from that at rest
        value[1] = np.nan if falling else value[1]
        row = {"joint": j + 1, "fastest_deg_s": fastest[j] / DEG, "noise_nm": friction.noise[j]}
        for i, name in enumerate(UNITS):
            low, high = interval[j, i] if np.isfinite(value[i]) else (np.nan, np.nan)
            row |= {name: value[i], f"{name}_low": low, f"{name}_high": high}
        remark = LINEAR if axes.linear[j] else FALLING if falling else _remark(friction, j, value)
        rows.append(row | {"remark": remark})
    return pd.DataFrame(rows)


def _remark(friction: Friction, joint: int, value: Array) -> str:
    """Say why the runs do not identify a joint's friction; empty if they do."""
    forward, backward = friction.forward[joint], friction.backward[joint]
    if not (forward or backward):
        return "too slow for the encoder to resolve the direction"
    if np.isfinite(value[:2]).all():
        return ""
    if not (forward and backward):
        both = "" if np.isfinite(value[1]) else ", and at too few speeds for viscous friction"
        return f"one way only, so that Coulomb friction cannot be separated from weight{both}"
    return "speeds that differ too little to separate Coulomb and viscous friction"


def _curve(friction: Friction, log: Motion) -> pd.DataFrame:
    """Friction torque by speed: mean and standard deviation of bins with equal numbers of samples."""
    known = np.nan_to_num(friction.value)
    resists = friction.residual + known[:, 0] * log.direction + known[:, 1] * log.rate
    rows = []
    for j in range(log.rate.shape[1]):
        for sign in (1, -1):
            inside = log.moving[:, j] & (sign * log.rate[:, j] > 0)
            rate, torque = log.rate[inside, j], resists[inside, j]
            for part in np.array_split(np.argsort(rate), min(BINS, len(rate))) if len(rate) else ():
                mean, spread = torque[part].mean(), torque[part].std()
                rows.append((j + 1, rate[part].mean() / DEG, mean, spread))
    return pd.DataFrame(rows, columns=["joint", "speed_deg_s", "friction_nm", "sd_nm"])


def report(observed: dict[str, pd.DataFrame] | Refusal) -> JSON:
    """Return the part of the ``arm`` block: ``coulomb`` and ``viscous`` friction, a quantity per joint.

    A value that the idle runs do not identify is null, with the reason under ``not_identified``.
    """
    if isinstance(observed, Refusal):
        return {"arm": {"not_identified": {"friction": observed.reason}}} if observed.reason else {}
    table = observed["joint_friction"]
    block: JSON = {
        name: [
            {"value": _known(value), "ci95": [_known(low), _known(high)], "unit": unit}
            for value, low, high in table[[name, f"{name}_low", f"{name}_high"]].to_numpy()
        ]
        for name, unit in UNITS.items()
    }
    not_identified = {f"joint {r['joint']}": str(r["remark"]) for _, r in table.iterrows() if r["remark"]}
    return {"arm": {"friction": {**block, **({"not_identified": not_identified} if not_identified else {})}}}


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
