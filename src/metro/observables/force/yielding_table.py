"""The effect of a tabulated machine's stiffness on the cutting force of each run: table ``yielding``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.cutting.force import COEFFICIENTS, Cut
from metro.cutting.law import EdgeLaw
from metro.observables.arm.station_table import entries, stations_of
from metro.observables.cut import conditions as cutting_force
from metro.observables.force.orders import recorded
from metro.observables.force.yielding import ANGLES, NotConvergedError, ratios, yielding_force
from metro.observables.problem import Refusal
from metro.robot.kinematics import rotation
from metro.robot.stations import EndStiffness, Stations, leave_one_out, stiffness_at
from metro.units import DEG, JSON, MM, N_UM, Array

AXES = ("x", "y", "z")
PLANE = ("plane_xx_n_um", "plane_xy_n_um", "plane_yx_n_um", "plane_yy_n_um")
HELIX_DIRECTIONS_DEG = (
    0.0,
    45.0,
    90.0,
    135.0,
)  # of the feed, which turns; a spring repeats after half a turn

Read = Callable[..., pd.DataFrame]


def yielding_table(batch: Batch, read: Read, identified: JSON) -> pd.DataFrame | Refusal:
    """Solve the deflection feedback of every run with a dynamometer record, else of every run.

    A run is cut at the station that its ``pose`` names; if it names none, at the middle of the work's face,
    which ``work_in_base`` places. The stiffness, with that across the axes where it is tabulated, is of the
    base frame; the tip yields in the plane of cutting to the force of the peripheral edges ([T] eq. 10).
    Helical runs are slots in four directions of feed; the one with the largest difference after entry is
    used.

    Returns
    -------
    A row per run: ``position`` (the station, blank between stations), x_mm … z_mm, kxx_n_um … kzz_n_um
    (base frame), ``method``, the leave-one-out error of interpolation per axis, plane_xx_n_um … plane_yy_n_um
    (stiffness of a tip that is free along the spindle, work frame), the ratios of
    :func:`metro.observables.force.yielding.ratios`, ``iterations_newton``, ``iterations_fixed_point``
    ("diverges" where it does), the largest difference to the rigid tool's force in the first and in the last
    of the revolutions, in N and in % of the largest rigid force, and ``refused``: the reason if a row has no
    figures.
    """
    machine = _machine(batch, read, identified)
    if isinstance(machine, Refusal):
        return machine
    tool, si, stations, names = machine
    errors = np.diagonal(leave_one_out(stations))
    error = {f"leave_one_out_{a}_percent": 100.0 * e for a, e in zip(AXES, errors, strict=True)}
    rows = []
    for run in recorded(batch) or [str(run) for run in batch.runs.index]:
        try:
            row, stiffness = _end_stiffness(batch, run, stations, names)
            row |= _worst(batch, run, tool, si, stiffness)
        except (ValueError, NotConvergedError) as refusal:
            row = {"run": run, "refused": str(refusal)}
        rows.append(row | error)
    return pd.DataFrame(rows)


def gains(batch: Batch, read: Read, identified: JSON) -> pd.DataFrame | Refusal:
    """Return ``run, gain``: by what the plain iteration multiplies an error of the force, at worst.

    The runs are those of :func:`yielding_table`, less those that it refuses; nothing is solved.
    """
    machine = _machine(batch, read, identified)
    if isinstance(machine, Refusal):
        return machine
    tool, si, stations, names = machine
    known: dict[tuple[Any, ...], float] = {}
    rows = []
    for run in recorded(batch) or [str(run) for run in batch.runs.index]:
        try:
            _, stiffness = _end_stiffness(batch, run, stations, names)
            cut = cutting_force.cut(batch, run, tool.radius)
        except ValueError:
            continue
        directions = _directions(batch.runs.loc[run])
        key = cut, tuple(stiffness.ravel()), tuple(directions)  # repeats are solved once
        if key not in known:
            springs = _springs(_compliance(batch, stiffness), directions)
            known[key] = max(ratios(tool, EdgeLaw(), cut, si, spring)[0] for spring in springs)
        rows.append({"run": run, "gain": known[key]})
    return pd.DataFrame(rows, columns=["run", "gain"])


def _machine(
    batch: Batch, read: Read, identified: JSON
) -> tuple[Cutter, Array, Stations, tuple[str, ...]] | Refusal:
    """Return tool, coefficients (6,) SI, stations and their names."""
    table = read("stations")
    if table.empty:
        return Refusal("cell.yaml names no stations: the machine's end stiffness is not tabulated")
    tool, values = cutting_force.cutter(batch), cutting_force.coefficients(batch, identified)
    if isinstance(tool, Refusal):
        return tool
    if isinstance(values, Refusal):
        return values
    si = np.array([values[name] for name in COEFFICIENTS]) * cutting_force.TO_SI
    return tool, si, stations_of(table), tuple(str(name) for name in table["position"])


def _end_stiffness(batch: Batch, run: str, stations: Stations, names: tuple[str, ...]) -> tuple[JSON, Array]:
    """First columns of a run's row: its position and the machine's stiffness there, (3, 3) N/m as well."""
    pose = str(batch.runs.loc[run, "pose"])
    if pose in names:
        position, place = pose, stations.place[names.index(pose)]
        end = EndStiffness(stations.stiffness[names.index(pose)], "as tabulated", 0.0)
    else:
        size = np.asarray((batch.manifest.get("work") or {}).get("size_mm", (0.0, 0.0, 0.0)), dtype=float)
        corner = np.asarray(batch.manifest["work_in_base"]["xyz_mm"], dtype=float)
        position, place = "", (corner + _base_from_work(batch) @ (size * (0.5, 0.5, 0.0))) * MM
        end = stiffness_at(stations, place)
    row: JSON = {"run": run, "position": position, "method": end.method, "refused": ""}
    row |= {f"{axis}_mm": x / MM for axis, x in zip(AXES, place, strict=True)}
    return row | entries(end.value), end.value


def _base_from_work(batch: Batch) -> Array:
    return rotation(*(np.asarray(batch.manifest["work_in_base"]["rpy_deg"], dtype=float) * DEG))


def _worst(batch: Batch, run: str, tool: Cutter, coefficients: Array, stiffness: Array) -> JSON:
    """Solve one run in its directions of feed; ``stiffness`` (3, 3) N/m, base frame."""
    cut, compliance = cutting_force.cut(batch, run, tool.radius), _compliance(batch, stiffness)
    plane = _in_plane(compliance, 0.0) / N_UM
    springs = _springs(compliance, _directions(batch.runs.loc[run]))
    rows = [_feedback(tool, cut, coefficients, spring) for spring in springs]
    worst = max(rows, key=lambda row: float(row["difference_n"]))
    return worst | dict(zip(PLANE, plane.ravel().tolist(), strict=True))


def _compliance(batch: Batch, stiffness: Array) -> Array:
    """Compliance (3, 3) m/N in the work frame; ``stiffness`` (3, 3) N/m, base frame."""
    turn = _base_from_work(batch)
    return np.asarray(turn.T @ np.linalg.inv(stiffness) @ turn)


def _springs(compliance: Array, directions: list[float]) -> list[Array]:
    """Stiffness (2, 2) in the plane, in the frames of some directions of feed, rad."""
    return [_in_plane(compliance, angle) for angle in directions]


def _directions(row: Any) -> list[float]:
    """Directions of feed, rad, in the work frame."""
    if row["operation"] == "helical":
        return [angle * DEG for angle in HELIX_DIRECTIONS_DEG]
    return [cutting_force.or_zero(row["feed_direction_deg"]) * DEG]


def _in_plane(compliance: Array, angle: float) -> Array:
    """Stiffness (2, 2) of a tip that is free to yield in x and y, in the feed frame turned by ``angle``."""
    turn = cutting_force.turn_about_z(angle)
    return np.asarray(np.linalg.inv((turn.T @ compliance @ turn)[:2, :2]))


def _feedback(tool: Cutter, cut: Cut, coefficients: Array, stiffness: Array) -> JSON:
    """Solve one cut by both schemes, and compare it with that of a rigid tool."""
    cut_solved = yielding_force(tool, EdgeLaw(), cut, coefficients, stiffness)
    try:
        plain = yielding_force(tool, EdgeLaw(), cut, coefficients, stiffness, scheme="fixed_point")
        fixed_point = str(plain.iterations)
    except NotConvergedError:
        fixed_point = "diverges"
    difference, largest = np.abs(cut_solved.force - cut_solved.rigid), float(np.abs(cut_solved.rigid).max())
    entry, after = float(difference[:ANGLES].max()), float(difference[-ANGLES:].max())
    scheme_ratio, settling_ratio = ratios(tool, EdgeLaw(), cut, coefficients, stiffness)
    return {
        "fixed_point_ratio": scheme_ratio,
        "settling_ratio": settling_ratio,
        "iterations_newton": cut_solved.iterations,
        "iterations_fixed_point": fixed_point,
        "entry_difference_n": entry,
        "entry_difference_percent": 100.0 * entry / largest,
        "difference_n": after,
        "difference_percent": 100.0 * after / largest,
    }
