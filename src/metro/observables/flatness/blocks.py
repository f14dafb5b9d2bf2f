"""Evidence on flatness: load tests of the arm as calibration, and faces at the points of their path."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness.doubt import damping_doubt
from metro.observables.flatness.dynamics import TipDynamics, tip_dynamics
from metro.observables.flatness.face_setting import ACROSS, AHEAD, FaceSetting
from metro.observables.flatness.noise import LAG, bin_sigma
from metro.observables.flatness.path import (
    NARROW,
    Path,
    make_pace,
    make_path,
    narrow_passes,
    passages,
    turn_from_declared,
    work_size,
)
from metro.observables.flatness.patterns import patterns
from metro.observables.flatness.placing import plane_directions
from metro.observables.flatness.pose_field import LoadSetting, PoseField
from metro.observables.flatness.ringing import Ringing, make_ringing
from metro.observables.problem import Block, Refusal
from metro.observables.waviness.model import PHASES
from metro.surface.footprint import Window
from metro.surface.tip_stiffness import (
    choose_basis,
    fit_z_row,
    nonlinearity,
    visible_entries,
    z_rows,
)
from metro.units import DEG, MM, UM, Array

REGISTERED_SD = 10 * UM  # of the place of one scan about that of all
GAUGE_SD = 0.1 * UM
MOST_POINTS = 1200
LEAST_COVERAGE, SECTORS = 0.75, 8
LOADS = ("x_mm", "y_mm", "z_mm", "fx_n", "fy_n", "fz_n", "dx_mm", "dy_mm", "dz_mm")


@dataclass(frozen=True)
class Pose:
    """The arm at one pose, from the load tests.

    ``field``: the variation of the compliance's z row; ``loaded``: its coefficients from the loads alone;
    ``block``: the loads as evidence; ``dynamics`` of the tip, None if not known; ``notes`` for the report.
    """

    field: PoseField
    loaded: Array
    block: Block
    dynamics: TipDynamics | None
    notes: tuple[str, ...]


def load_arrays(loads: pd.DataFrame) -> tuple[Array, Array, Array]:
    """Return positions, forces, displacements (n, 3) in SI."""
    values = loads[list(LOADS)].to_numpy(dtype=float)
    return values[:, :3] * MM, values[:, 3:6], values[:, 6:] * MM


def pose_of_loads(pose: str, loads: pd.DataFrame, mass: pd.DataFrame, modes: pd.DataFrame) -> Pose | Refusal:
    """Gather the load tests and the reduced mass of one pose; ``modes``: those of all impacts."""
    position, force, displacement = arrays = load_arrays(loads)
    rows = z_rows(position[:, 0], position[:, 1], force, displacement)
    entries = visible_entries(rows)
    if not entries.any():
        return Refusal(f"the load tests at pose {pose} do not determine the compliance of the tip along z")
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
    dynamics, said = tip_dynamics(pose, basis, arrays, mass, modes)
    return Pose(field, loaded, block, dynamics, (*notes, *said))


def _linearity(pose: str, loads: pd.DataFrame) -> list[str]:
    """State the change of the compliance from the least to the greatest load if it exceeds 2 %."""
    changes = [
        change
        for _, point in loads.groupby("point", sort=False)
        for change in nonlinearity(*load_arrays(point)[1:])
    ]
    if not changes:
        return [f"Pose {pose}: every direction was loaded with one force only, so linearity is not checked."]
    change = float(np.mean([np.nansum(each.relative * each.direction) for each in changes]))
    if abs(change) < 0.02:
        return []
    low, high = changes[0].loads
    return [
        f"Pose {pose}: the compliance along the load changes by {100 * change:+.1f} % from {low:.0f} to "
        f"{high:.0f} N (mean of {len(changes)} tests); the model takes the line through both."
    ]


def face_block(
    batch: Batch, run: str, table: pd.DataFrame, pose: Pose, values: Mapping[str, float]
) -> tuple[Block, list[str]] | Refusal:
    """Return the heights of a face at its path points and beside them, and notes on them for the report.

    ``table``: rows of face_points, then those of face_beside; ``aside`` distinguishes them.
    """
    if blank := cutting_force.unset(batch, run):
        return Refusal(blank)
    path = make_path(table[~table["aside"]])
    if path.spread > 45 * DEG:
        return Refusal("its passes run in different directions; the force model knows one-way passes only")
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal):
        return tool
    along, across = (float(table[f"disc_{way}_mm"].iloc[0]) * MM for way in ("along", "across"))
    disc = Window(along, across, path.direction)
    bin_number = _bins(table, disc)
    narrow = narrow_passes(batch, run, path, tool.radius)
    compared = _compared(table, path, tool.radius) & ~_reached(table, path, narrow, tool.radius)
    table, bin_number = table[compared], bin_number[compared]
    if len(table) < 4:
        return Refusal(
            "fewer than four path points lie on the scanned face, a radius away from entry and exit"
        )
    x, y = _places(table, disc)
    turn = turn_from_declared(batch, run, path)
    force = cutting_force.turn_about_z(turn) @ cutting_force.mean_force_on_tool(batch, run, values)
    ringing = make_ringing(batch, run, path, pose.dynamics, values, full=force, disc=disc.along)
    setting = FaceSetting(
        pose=pose.field.pose,
        x=x,
        y=y,
        disc=disc.along,
        first=np.flatnonzero(np.diff(bin_number, prepend=-1)),
        passages=passages(path, x, y, tool.radius),
        pace=make_pace(batch, run, path, tool),
        size=work_size(batch),
        force=force,
        loaded=pose.loaded,
        ringing=ringing,
    )
    block = _block(batch, run, table, setting, path)
    doubt = damping_doubt(pose.field, setting)
    doubt = None if doubt is None else block.setting.shape(doubt)
    return replace(block, unidentified=doubt), [*_said(run, turn, ringing), *_said_of_narrow(run, narrow)]


def _places(table: pd.DataFrame, disc: Window) -> tuple[Array, Array]:
    """Return the places (4 n,) that represent the discs of the points of a table, m."""
    about = (disc.along * AHEAD + 1j * disc.across * ACROSS) * disc.direction
    x = table["x_mm"].to_numpy()[:, None] * MM + about.real
    y = table["y_mm"].to_numpy()[:, None] * MM + about.imag
    return x.ravel(), y.ravel()


def _block(batch: Batch, run: str, table: pd.DataFrame, setting: FaceSetting, path: Path) -> Block:
    row = batch.runs.loc[run]
    deviation = (table["z_mm"] - table["programmed_z_mm"]).to_numpy() * MM
    x, y = setting.mean(setting.x), setting.mean(setting.y)
    measured = setting.binned(deviation)
    sigma = bin_sigma(measured, table, setting)
    placed = "to_work" in batch.instrument("scanner")
    zeros = plane_directions(x, y)
    if not placed:
        setting = replace(setting, unplaced=np.linalg.qr(zeros)[0])
        measured = setting.shape(measured)
    return Block(
        run=run,
        condition=str(row["condition"]),
        role="validate" if row["role"] == "validate" else "identify",
        order=int(batch.runs["order"].astype(int)[run]),
        measured=measured,
        sigma=sigma,
        setting=setting,
        axis=np.full(len(x), "z"),
        zeros=zeros,
        zero_sd=np.full(3, REGISTERED_SD if placed else 0.0),
        coordinates={
            "axis": np.full(len(x), "z"),
            "s_mm": setting.binned(table["s_mm"].to_numpy()),
            "x_mm": x / MM,
            "y_mm": y / MM,
        },
        patterns=patterns(x, y, table["pass"].to_numpy()[setting.first], path.along(x, y)),
        symmetries=np.array(PHASES)[:, None],
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
    elif ringing.teeth is not None:
        notes.append(
            f"Run {run}: the teeth pass at less than ten times the highest mode of the arm, so that the tip "
            "moves at their rhythm, too; it is in the prediction."
        )
    return notes


def _compared(table: pd.DataFrame, path: Path, radius: float) -> np.ndarray:
    """Mask of the points that the scan shows well, a radius or more from entry and exit.

    A disc over an edge is half empty: it holds fewer points than the others, and these points lie in fewer of
    its sectors than the same number of random points would.
    """
    count, coverage = table["k"].to_numpy(dtype=float), table["coverage"].to_numpy()
    expected = 1.0 - (1.0 - 1.0 / SECTORS) ** count
    seen = np.isfinite(table["z_mm"].to_numpy()) & (coverage >= LEAST_COVERAGE * expected)
    if not seen.any():
        return np.asarray(seen)
    seen &= count >= LEAST_COVERAGE * np.median(count[seen])
    along = path.along(table["x_mm"].to_numpy() * MM, table["y_mm"].to_numpy() * MM)
    return np.asarray(seen & (along >= along[seen].min() + radius) & (along <= along[seen].max() - radius))


def _reached(table: pd.DataFrame, path: Path, passes: np.ndarray, radius: float) -> np.ndarray:
    """Mask of the points that the cutter reaches in one of some ``passes``."""
    across = path.aside(table["x_mm"].to_numpy() * MM, table["y_mm"].to_numpy() * MM)
    away = np.abs(across[:, None] - path.aside(*path.start[passes].T))
    return np.asarray((away < radius).any(axis=1))


def _said_of_narrow(run: str, narrow: np.ndarray) -> list[str]:
    if not narrow.any():
        return []
    passes = ", ".join(str(i + 1) for i in np.flatnonzero(narrow))
    return [
        f"Run {run}: pass {passes} finds less than {NARROW:.0%} of the declared width left to cut, so that "
        "its force is another one; what the cutter reaches there is not compared."
    ]


def _bins(table: pd.DataFrame, disc: Window) -> np.ndarray:
    """Return the number of each point's bin: neighbours within a pass, about ``MOST_POINTS`` bins at most.

    Discs of one bin and of the next but one do not overlap.
    """
    number = table["pass"].to_numpy()
    steps = np.hypot(*np.diff(table[["x_mm", "y_mm"]].to_numpy(dtype=float), axis=0).T) * MM
    within = steps[np.diff(number) == 0]
    step = float(np.median(within)) if within.size else math.inf
    apart = 2.0 * disc.along / (LAG * step) if step > 0.0 else 1.0
    width = math.ceil(max(len(number) / MOST_POINTS, apart))
    begins = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
    within = np.arange(len(number)) - np.repeat(begins, np.diff(np.append(begins, len(number))))
    return np.cumsum(within % width == 0)
