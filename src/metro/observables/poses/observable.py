"""The arm of a batch calibrated by each series of measured poses."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import Axes, axes_of
from metro.observables.poses import TABLES
from metro.observables.quantity import quantity
from metro.robot.calibration.fit import Fit
from metro.robot.calibration.held_out import HeldOut, median
from metro.robot.calibration.model import names
from metro.robot.calibration.next_poses import next_poses
from metro.robot.calibration.performance import repeated
from metro.robot.calibration.poses import Poses, approached
from metro.robot.calibration.study import FEWEST, STAGES, Calibration, calibrated, left_out, sizes
from metro.robot.kinematics import geometry_of_cell
from metro.units import DEG, JSON, MM, Array

MRAD = 1e-3
CURVE_STEP = 0.5 * DEG  # between the points of a curve that is drawn
SHIFT_STEP = 0.002  # m, of a joint that shifts
NO_ARM = "the cell has no arm (arm.dh or arm.urdf in cell.yaml)"


def observe(batch: Batch, read: Tables) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return the tables, and the block ``pose`` of ``identified.json``; empty without poses."""
    geometry = geometry_of_cell(batch.cell)
    block: JSON = {}
    reasons: JSON = {}
    tables: dict[str, list[pd.DataFrame]] = {name: [] for name in TABLES}
    for run in batch.with_files("poses"):
        if geometry is None:
            reasons[run] = NO_ARM
            continue
        poses = poses_of(read("poses", run))
        if len(poses) < FEWEST:
            reasons[run] = f"found {len(poses)} poses, expected at least {FEWEST}"
            continue
        try:
            found, held = calibrated(poses, geometry), left_out(poses, geometry)
        except ValueError as error:
            reasons[run] = str(error)
            continue
        block[run] = _block(found, held, poses) | _repeats(found, poses, read("poses", run))
        tables["pose_errors"].append(_errors(run, poses, held))
        tables["pose_next"].append(_next(run, found.final, poses, axes_of(read("poses", run))))
        tables["pose_curves"] += _curves(run, found.final, poses)
    block |= {"not_identified": reasons} if reasons else {}
    written = {name: pd.concat(parts, ignore_index=True) for name, parts in tables.items() if parts}
    return written, {"pose": block} if block else {}


def poses_of(rows: pd.DataFrame) -> Poses:
    """Return the poses of a canonical table in SI; a pose without a time has its number."""
    axes = axes_of(rows)
    q = rows[axes.positions].to_numpy(dtype=float) * axes.units
    at = rows[["x_mm", "y_mm", "z_mm"]].to_numpy(dtype=float) * MM
    time = rows["t_s"].to_numpy(dtype=float)
    time = time if np.isfinite(time).all() else np.arange(len(rows), dtype=float)
    sigma = np.nan_to_num(rows["sigma_mm"].to_numpy(dtype=float)) * MM
    return Poses(q, at, sigma, time, rows["temperature_c"].to_numpy(dtype=float), approached(q))


def _block(found: Calibration, held: tuple[HeldOut, ...], poses: Poses) -> JSON:
    final, known = found.final, found.determined
    start = found.fits[0].state
    labels = names(start)
    free = np.flatnonzero(final.free)
    sd = np.sqrt(np.diag(final.covariance))[: len(free)]
    values = _parameters(final)
    change = (final.state.rows - start.rows).ravel()
    corrections = {
        labels[place]: _corrected(labels[place], float(change[place - 9]), float(sd[at]))
        for at, place in enumerate(free)
        if place >= 9
    }
    tool = {
        axis: quantity(float(values[6 + k]) / MM, float(sd[6 + k]) / MM, "mm") for k, axis in enumerate("xyz")
    }
    return {
        "poses": len(poses),
        "scatter": {"value": final.scale / MM, "unit": "mm"},
        "condition": known.condition,
        "observability": known.o1 / MM,
        "redundant": [labels[place] for place in range(9, len(labels)) if not known.kept[place]],
        "tool": tool,
        "corrections": corrections,
        "effects": [
            {
                "effect": size.effect.code,
                "title": size.effect.label,
                **({"joint": size.effect.joint + 1} if size.effect.joint >= 0 else {}),
                "moves": _least_zero(quantity(size.moves / MM, size.sd / MM, "mm")),
                "parameters": _of_effect(final, at),
            }
            for at, size in enumerate(sizes(final, poses))
        ],
        "tried": [
            {"effect": one.label, "gain": one.gain, "error": one.error, "kept": one.kept}
            for one in found.trials
        ],
        "errors": {one.kind: _of_held_out(one) for one in held},
    }


def _repeats(found: Calibration, poses: Poses, rows: pd.DataFrame) -> JSON:
    """Return the block of poses that were taken several times; empty without any."""
    figures = repeated(poses, rows["target"].to_numpy(dtype=float), found.fits)
    entries = []
    for one in figures:
        rp, low, high = (each / MM for each in one.repeatability)
        entry: JSON = {"target": one.target, "repeats": one.count}
        entry |= {
            f"ap_{stage}": _least_zero(quantity(value / MM, one.accuracy_sd / MM, "mm"))
            for stage, value in zip(STAGES, one.accuracy, strict=True)
        }
        entry["rp"] = {"value": rp, "ci95": [low, high], "unit": "mm"}
        entry["vap"] = {
            "value": one.directional / MM if math.isfinite(one.directional) else None,
            "unit": "mm",
        }
        entries.append(entry)
    return {"repeats": entries} if entries else {}


def _parameters(fit: Fit) -> Array:
    """Return base (turn left out) and tool as numbers, m, in the order of the parameters."""
    return np.concatenate([fit.state.base[:3, 3], np.zeros(3), fit.state.tool])


def _corrected(label: str, change: float, sd: float) -> JSON:
    length = label.endswith(("length", "link offset"))
    unit, name = (MM, "mm") if length else (MRAD, "mrad")
    return quantity(change / unit, sd / unit, name)


def _least_zero(size: JSON) -> JSON:
    return size | {"ci95": [None if end is None else max(0.0, end) for end in size["ci95"]]}


def _of_effect(fit: Fit, at: int) -> JSON:
    """Return the named parameters of an effect; mm where it moves the point or shifts a joint, else mrad."""
    effect, place = fit.effects[at], fit.place(at)
    shifts = effect.joint < 0 or bool(fit.state.prismatic[effect.joint])
    unit, name = (MM, "mm") if shifts else (MRAD, "mrad")
    sd = np.sqrt(np.diag(fit.covariance))[place]
    own = zip(effect.names, fit.values[at], sd, strict=False)
    return {label: quantity(float(value) / unit, float(each) / unit, name) for label, value, each in own}


def _of_held_out(one: HeldOut) -> JSON:
    found: JSON = {"poses": len(one.which)}
    for stage, distances in zip(STAGES, one.distances, strict=True):
        value, low, high = (each / MM for each in median(distances))
        found[stage] = {
            "median": {"value": value, "ci95": [low, high], "unit": "mm"},
            "p95": {"value": float(np.percentile(distances, 95)) / MM, "unit": "mm"},
        }
    return found


def _errors(run: str, poses: Poses, held: tuple[HeldOut, ...]) -> pd.DataFrame:
    """Return the held-out errors: measured position, and measured less predicted by each fit, mm."""
    parts = []
    for one in held:
        x, y, z = poses.at[one.which].T / MM
        part = {"run": run, "kind": one.kind, "pose": one.which + 1, "x_mm": x, "y_mm": y, "z_mm": z}
        for stage, errors in zip(STAGES, one.errors, strict=True):
            part |= {f"{stage}_{axis}_mm": errors[:, k] / MM for k, axis in enumerate("xyz")}
        parts.append(pd.DataFrame(part))
    return pd.concat(parts, ignore_index=True)


def _next(run: str, fit: Fit, poses: Poses, axes: Axes) -> pd.DataFrame:
    """Return the poses to measure next, in the columns of the contract, and what standard errors are left."""
    q, left = next_poses(fit, poses)
    table = pd.DataFrame(q / axes.units, columns=axes.positions)
    return table.assign(run=run, order=np.arange(1, len(q) + 1), left=left)


def _curves(run: str, fit: Fit, poses: Poses) -> list[pd.DataFrame]:
    """Return what each effect that is a curve turns its joint by, where the joint was, about its mean."""
    found = []
    for at, effect in enumerate(fit.effects):
        if not effect.late:
            continue
        shifts = bool(fit.state.prismatic[effect.joint])
        step, unit, name = (SHIFT_STEP, MM, "mm") if shifts else (CURVE_STEP, MRAD, "mrad")
        reading = poses.q[:, effect.joint]
        reading = reading if shifts else np.mod(reading, 2.0 * math.pi)
        place = np.unique(np.round(reading / step)) * step
        q = np.zeros((len(place), poses.q.shape[1]))
        q[:, effect.joint] = place
        blank = np.full(len(place), np.nan)
        where = Poses(q, np.zeros((len(q), 3)), blank, blank, blank, q)
        basis = effect.basis(where, fit.state)
        basis = basis - basis.mean(axis=0)
        own = fit.covariance[fit.place(at), fit.place(at)]
        sd = np.sqrt(np.einsum("mk,kl,ml->m", basis, own, basis))
        column = {"run": run, "joint": effect.joint + 1, "unit": name}
        column |= {"reading": place / (MM if shifts else DEG)}
        found.append(pd.DataFrame({**column, "error": basis @ fit.values[at] / unit, "sigma": sd / unit}))
    return found
