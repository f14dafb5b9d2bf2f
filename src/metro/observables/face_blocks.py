"""Evidence on flatness: load tests of the arm as calibration, and faces at the points of their path."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables import cutting_force
from metro.observables.face_path import Path, force_over_period, make_path, passages, turn_from_declared
from metro.observables.flatness_model import FaceSetting, LoadSetting, PoseField, Ringing
from metro.observables.problem import Block, Refusal
from metro.surface.footprint import RADIUS
from metro.surface.tip_stiffness import (
    choose_basis,
    fit_z_row,
    interpolate_compliance,
    nonlinearity,
    visible_entries,
    z_rows,
)
from metro.units import DEG, MM, UM, Array

REGISTERED_SD = 10 * UM
UNREGISTERED_SD = 1 * MM
GAUGE_SD = 0.1 * UM
MOST_POINTS = 400
LEAST_COVERAGE = 0.75
LOADS = ("x_mm", "y_mm", "z_mm", "fx_n", "fy_n", "fz_n", "dx_mm", "dy_mm", "dz_mm")


@dataclass(frozen=True)
class Pose:
    """What the load tests say of the arm at one pose.

    ``field``: how the z row of the compliance varies; ``loaded``: its coefficients by the loads alone;
    ``block``: the loads as evidence; ``loads``: positions, forces, displacements (n, 3) SI; ``mass`` (3, 3)
    kg or None; ``notes``.
    """

    field: PoseField
    loaded: Array
    block: Block
    loads: tuple[Array, Array, Array]
    mass: Array | None
    notes: tuple[str, ...]


def load_arrays(loads: pd.DataFrame) -> tuple[Array, Array, Array]:
    """Return positions, forces, displacements (n, 3) in SI."""
    values = loads[list(LOADS)].to_numpy(dtype=float)
    return values[:, :3] * MM, values[:, 3:6], values[:, 6:] * MM


def pose_of_loads(pose: str, loads: pd.DataFrame, mass: pd.DataFrame) -> Pose | Refusal:
    """Gather what the load tests and the reduced mass of one pose say."""
    position, force, displacement = arrays = load_arrays(loads)
    rows = z_rows(position[:, 0], position[:, 1], force, displacement)
    entries = visible_entries(rows)
    if not entries.any():
        return Refusal(f"the load tests at pose {pose} do not tell what moves the tip along z")
    basis, error = choose_basis(rows, entries)
    loaded, residual = fit_z_row(rows, basis, entries)
    notes = _linearity(pose, loads)
    if math.isfinite(error):
        share = 100 * error / float(np.sqrt(np.mean(rows.displacement**2)))
        notes.append(
            f"Pose {pose}: the compliance over the face is a polynomial of {basis.terms} terms; leaving out "
            f"one load point at a time, it predicts the displacements there to {share:.1f} %."
        )
    unseen = [f"C_z{axis}" for axis, seen in zip("xyz", entries, strict=True) if not seen]
    if unseen:
        notes.append(f"Pose {pose}: no load test shows {', '.join(unseen)}; taken as zero.")
    size = len(rows.displacement)
    block = Block(
        run=f"loads {pose}",
        condition=f"loads {pose}",
        role="calibrate",
        order=0,
        measured=rows.displacement,
        sigma=np.full(size, max(residual, GAUGE_SD)),
        setting=LoadSetting(pose, rows),
        axis=np.array(["load x", "load y", "load z"])[rows.axis],
        zeros=np.zeros((size, 0)),
        zero_sd=np.zeros(0),
        coordinates={},
    )
    field = PoseField(pose, basis, tuple(bool(seen) for seen in entries))
    return Pose(field, loaded, block, arrays, _mass(mass), tuple(notes))


def _linearity(pose: str, loads: pd.DataFrame) -> list[str]:
    """State how much the compliance changes from the least to the greatest load, where it is over 2 %."""
    found = [
        change
        for _, point in loads.groupby("point", sort=False)
        for change in nonlinearity(*load_arrays(point)[1:])
    ]
    if not found:
        return [f"Pose {pose}: every direction was loaded with one force only, so linearity is not checked."]
    change = float(np.mean([np.nansum(each.relative * each.direction) for each in found]))
    if abs(change) < 0.02:
        return []
    low, high = found[0].loads
    return [
        f"Pose {pose}: the compliance along the load changes by {100 * change:+.1f} % from {low:.0f} to "
        f"{high:.0f} N (mean of {len(found)} tests); the model takes the line through both."
    ]


def _mass(table: pd.DataFrame) -> Array | None:
    """Mean reduced mass matrix of a pose's rows; None where there are none."""
    if table.empty:
        return None
    xx, xy, xz, yy, yz, zz = table[["mxx", "mxy", "mxz", "myy", "myz", "mzz"]].mean()
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def face_block(
    batch: Batch, run: str, table: pd.DataFrame, pose: Pose, values: Mapping[str, float]
) -> tuple[Block, list[str]] | Refusal:
    """Return the heights of a face at its path points, and what the report should say of them."""
    path = make_path(table)
    if path.spread > 45 * DEG:
        return Refusal("its passes run in different directions; the force model knows one-way passes only")
    radius = batch.manifest["tool"]["diameter_mm"] * MM / 2
    table = table[_compared(table, path, radius)]
    if len(table) < 4:
        return Refusal(
            "fewer than four path points lie on the scanned face, a radius away from entry and exit"
        )
    x, y = table["x_mm"].to_numpy() * MM, table["y_mm"].to_numpy() * MM
    turn = turn_from_declared(batch, run, path)
    force = cutting_force.turn_about_z(turn) @ cutting_force.mean_force_on_tool(batch, run, values)
    ringing = _ringing(batch, run, path, pose, values)
    first = _bins(table["pass"].to_numpy())
    setting = FaceSetting(
        pose.field.pose, x, y, first, passages(path, x, y, radius), force, pose.loaded, ringing
    )
    return _block(batch, run, table, setting), _said(run, turn, ringing)


def _block(batch: Batch, run: str, table: pd.DataFrame, setting: FaceSetting) -> Block:
    row = batch.runs.loc[run]
    deviation = (table["z_mm"] - table["programmed_z_mm"]).to_numpy() * MM
    variance = setting.mean((table["sigma_mm"].to_numpy() * MM) ** 2)
    count = np.diff(np.append(setting.first, len(table)))
    x, y = setting.mean(setting.x), setting.mean(setting.y)
    placed = "to_work" in batch.instrument("scanner")
    return Block(
        run=run,
        condition=str(row["condition"]),
        role="validate" if row["role"] == "validate" else "identify",
        order=int(batch.runs["order"].astype(int)[run]),
        measured=setting.mean(deviation),
        sigma=np.sqrt(variance / count),
        setting=setting,
        axis=np.full(len(x), "z"),
        zeros=plane_directions(x, y),
        zero_sd=np.full(3, REGISTERED_SD if placed else UNREGISTERED_SD),
        coordinates={
            "axis": np.full(len(x), "z"),
            "s_mm": setting.mean(table["s_mm"].to_numpy()),
            "x_mm": x / MM,
            "y_mm": y / MM,
        },
    )


def _said(run: str, turn: float, ringing: Ringing | None) -> list[str]:
    notes = []
    if abs(turn) > 1 * DEG:
        notes.append(
            f"Run {run}: the passes run {turn / DEG:.0f}° off the declared feed; the path is trusted."
        )
    if ringing is None:
        notes.append(
            "Without mass.csv and work.size_mm the tip is taken to follow the force without ringing."
        )
    return notes


def _ringing(batch: Batch, run: str, path: Path, pose: Pose, values: Mapping[str, float]) -> Ringing | None:
    tool = cutting_force.cutter(batch)
    if pose.mass is None or isinstance(tool, Refusal) or "size_mm" not in (batch.manifest.get("work") or {}):
        return None
    middle = path.start + 0.5 * path.length[:, None] * [path.direction.real, path.direction.imag]
    compliance = interpolate_compliance(pose.loads, pose.field.basis, middle[:, 0], middle[:, 1])
    if compliance is None:
        return None
    return Ringing(pose.mass, compliance, *force_over_period(batch, run, values, path, tool), RADIUS)


def _compared(table: pd.DataFrame, path: Path, radius: float) -> np.ndarray:
    """Mask of the path points that the scan shows well, a radius or more from entry and exit."""
    seen = np.isfinite(table["z_mm"].to_numpy()) & (table["coverage"].to_numpy() >= LEAST_COVERAGE)
    if not seen.any():
        return np.asarray(seen)
    along = path.along(table["x_mm"].to_numpy() * MM, table["y_mm"].to_numpy() * MM)
    return np.asarray(seen & (along >= along[seen].min() + radius) & (along <= along[seen].max() - radius))


def _bins(number: np.ndarray) -> np.ndarray:
    """First index of each bin: neighbours within a pass, for at most about ``MOST_POINTS`` bins."""
    width = math.ceil(len(number) / MOST_POINTS)
    begins = np.flatnonzero(np.append(True, np.diff(number) != 0))
    within = np.arange(len(number)) - np.repeat(begins, np.diff(np.append(begins, len(number))))
    return np.flatnonzero(within % width == 0)


def plane_directions(x: Array, y: Array) -> Array:
    """Offset and two tilts, (n, 3), each tilt of ±1 at the rims."""
    across = [(c - (c.min() + c.max()) / 2) / (np.ptp(c) / 2 or 1.0) for c in (x, y)]
    return np.column_stack([np.ones(len(x)), *across])
