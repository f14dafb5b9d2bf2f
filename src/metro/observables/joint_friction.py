"""Friction of an arm's joints, from its idle runs: what they tell, and of which joint they cannot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.problem import Refusal
from metro.observables.tip_force import ACTUAL, TORQUE
from metro.robot.friction import Friction, of_idle_runs
from metro.robot.kinematics import arm_of_cell
from metro.robot.motion import Motion
from metro.units import DEG, JSON, Array

Read = Callable[..., pd.DataFrame]
UNITS = {"coulomb": "N m", "viscous": "N m s/rad"}
BINS = 12  # of speed, per direction, in the figure
LEAST_SAMPLES = 100


def observe(batch: Batch, read: Read) -> dict[str, pd.DataFrame] | Refusal:
    """Identify the friction of all idle runs together.

    Tables ``joint_friction`` (a row per joint: Coulomb and viscous friction, N m and N m s/rad, with their
    95 % intervals, blank where ``remark`` says why the runs cannot tell) and ``joint_friction_curve`` (mean
    of the torque less the weight's, by joint and speed).
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal("")  # nothing is missed where there is no arm
    table = read("robot")
    idle = [rows for _, rows in table[table["log"] == "idle"].groupby("run") if len(rows) >= LEAST_SAMPLES]
    if not idle:
        return Refusal("no run has an idle_log")
    runs = [(r["t_s"].to_numpy(), r[ACTUAL].to_numpy() * DEG, r[TORQUE].to_numpy()) for r in idle]
    try:
        friction, log = of_idle_runs(arm.dh, runs)
    except ValueError as error:
        return Refusal(f"idle runs: {error}")
    return {"joint_friction": _table(friction, log), "joint_friction_curve": _curve(friction, log)}


def _table(friction: Friction, log: Motion) -> pd.DataFrame:
    fastest = np.where(log.moving, np.abs(log.rate), 0.0).max(axis=0)
    interval = friction.interval()
    half = 0.5 * np.ptp(interval, axis=-1)
    rows = []
    for j in range(len(fastest)):
        told = friction.value[j].copy()
        # friction that may be more than all that the motor did is not told
        swing = float(np.ptp(log.torque[:, j]))
        told[:2][half[j, :2] * (1.0, fastest[j]) > swing] = np.nan
        row = {"joint": j + 1, "fastest_deg_s": fastest[j] / DEG, "noise_nm": friction.noise[j]}
        for i, name in enumerate(UNITS):
            low, high = interval[j, i] if np.isfinite(told[i]) else (np.nan, np.nan)
            row |= {name: told[i], f"{name}_low": low, f"{name}_high": high}
        rows.append(row | {"remark": _remark(friction, j, told)})
    return pd.DataFrame(rows)


def _remark(friction: Friction, joint: int, told: Array) -> str:
    """Say why the runs do not tell a joint's friction; empty where they do."""
    forward, backward = friction.forward[joint], friction.backward[joint]
    if not (forward or backward):
        return "too slow for the encoder to tell which way"
    if np.isfinite(told[:2]).all():
        return ""
    if not (forward and backward):
        both = "" if np.isfinite(told[1]) else ", and at too few speeds for viscous friction"
        return f"one way only, so that Coulomb friction looks like weight{both}"
    return "speeds that differ too little to part Coulomb from viscous friction"


def _curve(friction: Friction, log: Motion) -> pd.DataFrame:
    """Torque that friction takes, by speed: mean and standard deviation of bins with as many samples each."""
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


def report(found: dict[str, pd.DataFrame] | Refusal) -> JSON:
    """Return the part of the ``arm`` block: six quantities each of ``coulomb`` and ``viscous`` friction.

    A value that the idle runs cannot tell is null, with the reason under ``not_identified``.
    """
    if isinstance(found, Refusal):
        return {"arm": {"not_identified": {"friction": found.reason}}} if found.reason else {}
    table = found["joint_friction"]
    block: JSON = {
        name: [
            {"value": _known(value), "ci95": [_known(low), _known(high)], "unit": unit}
            for value, low, high in table[[name, f"{name}_low", f"{name}_high"]].to_numpy()
        ]
        for name, unit in UNITS.items()
    }
    untold = {f"joint {r['joint']}": str(r["remark"]) for _, r in table.iterrows() if r["remark"]}
    return {"arm": {"friction": {**block, **({"not_identified": untold} if untold else {})}}}


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
