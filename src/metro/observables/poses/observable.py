"""The arm of a batch calibrated by each series of measured poses."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import Axes, axes_of
from metro.observables.poses import TABLES
from metro.observables.poses.block import MRAD, series_block
from metro.observables.poses.calibrated_arm import calibrated_chain, serves
from metro.observables.poses.rows import euler_of, misread, poses_of
from metro.observables.poses.targets import corrected_targets
from metro.robot.calibration.fit import HALVINGS, Fit
from metro.robot.calibration.held_out import HeldOut
from metro.robot.calibration.next_poses import next_poses
from metro.robot.calibration.poses import Poses
from metro.robot.calibration.start import placed
from metro.robot.calibration.study import FEWEST, STAGES, calibrated, left_out
from metro.robot.inverse import OutOfReachError
from metro.robot.kinematics import geometry_of_cell
from metro.units import DEG, JSON, MM, Array

CURVE_STEP = 0.5 * DEG  # between the points of a curve that is drawn
SHIFT_STEP = 0.002  # m, of a joint that shifts
NO_FRAME = "distances do not show where the arm's base is: measure positions to correct targets"
NO_ARM = "the cell has no arm (arm.dh or arm.urdf in cell.yaml)"


def observe(batch: Batch, read: Tables) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return the tables, and the block ``pose`` of ``identified.json``; empty without poses."""
    geometry = geometry_of_cell(batch.cell)
    block: JSON = {}
    reasons: JSON = {}
    tables: dict[str, list[pd.DataFrame]] = {name: [] for name in TABLES}
    targets = read("targets")
    served = _served(batch)
    for run in batch.with_files("poses"):
        if geometry is None:
            reasons[run] = NO_ARM
            continue
        rows = read("poses", run)
        poses, target = poses_of(rows, euler_of(batch))
        poses = placed(poses, geometry)
        if (count := len(np.unique(poses.pose))) < FEWEST:
            reasons[run] = f"found {count} poses, expected at least {FEWEST}"
            continue
        try:
            if wrong := misread(rows, euler_of(batch), geometry):
                reasons[run] = wrong
                continue
            found, held = calibrated(poses, geometry), left_out(poses, geometry)
        except ValueError as error:
            reasons[run] = str(error)
            continue
        block[run] = series_block(found, held, poses, target)
        block[run] |= {"arm": calibrated_chain(found.final, geometry), "serves": serves(batch)}
        tables["pose_errors"].append(_errors(run, poses, held))
        tables["pose_next"].append(_next(run, found.final, poses, axes_of(rows)))
        tables["pose_curves"] += _curves(run, found.final, poses)
        for other in served.get(run, ()):
            asked = targets[targets["run"] == other]
            if poses.by_distance:
                reasons[f"targets of {other}"] = NO_FRAME
                continue
            try:
                part, summary = corrected_targets(batch, asked, found, poses=poses, held=held)
            except OutOfReachError as error:
                reasons[f"targets of {other}"] = str(error)
                continue
            tables["pose_targets"].append(part)
            block[run].setdefault("targets", {})[other] = summary
    block |= {"not_identified": reasons} if reasons else {}
    written = {name: pd.concat(parts, ignore_index=True) for name, parts in tables.items() if parts}
    return written, {"pose": block} if block else {}


def _served(batch: Batch) -> dict[str, list[str]]:
    """Return by series the runs whose targets it corrects: its own, else those of the series before."""
    served: dict[str, list[str]] = {}
    series, wanting = batch.with_files("poses"), batch.with_files("targets")
    last = ""
    for run in batch.runs.index:
        last = str(run) if run in series else last
        if run in wanting and (last or series):
            served.setdefault(last or series[0], []).append(str(run))
    return served


def _errors(run: str, poses: Poses, held: tuple[HeldOut, ...]) -> pd.DataFrame:
    """Return the held-out errors: measured position, and measured less predicted by each fit, mm.

    ``region``: of the workspace, within which errors are alike. Where distances were measured the place is
    that of the declared flange, and the errors are those of ``distance_mm``.
    """
    parts, region = [], poses.parted(HALVINGS) + 1
    axes = ("distance",) if poses.by_distance else ("x", "y", "z")
    for one in held:
        x, y, z = poses.at[one.which].T / MM
        part = {"run": run, "kind": one.kind, "pose": poses.pose[one.which] + 1, "region": region[one.which]}
        part |= {"x_mm": x, "y_mm": y, "z_mm": z, "sigma_mm": _stated(poses.sigma[one.which] / MM)}
        part |= {"distance_mm": poses.distance[one.which] / MM} if poses.by_distance else {}
        for stage, errors in zip(STAGES, one.errors, strict=True):
            part |= {f"{stage}_{axis}_mm": errors[:, k] / MM for k, axis in enumerate(axes)}
        parts.append(pd.DataFrame(part))
    return pd.concat(parts, ignore_index=True)


def _stated(sigma: Array) -> Array:
    return np.where(sigma > 0.0, sigma, np.nan)


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
