"""Flatness: scans of milled faces at the points of the path, and the tip compliance that predicts them."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.batch.writing import writing
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness import NAME, TABLES
from metro.observables.flatness.advice import advice, after_loop, planned_points, studied
from metro.observables.flatness.beliefs import FORM_SD, believed_block
from metro.observables.flatness.beside import Beside
from metro.observables.flatness.blocks import LOADS, Pose, face_block, pose_of_loads
from metro.observables.flatness.dynamics import tip_block
from metro.observables.flatness.held import held_back
from metro.observables.flatness.model import FlatnessModel
from metro.observables.flatness.noise import without_what_repeats
from metro.observables.flatness.pairing import paired
from metro.observables.flatness.repeats import cloud_of, noise_by_repeats, scanned_again
from metro.observables.flatness.scan import FACE_TABLES, measured_run
from metro.observables.flatness.scenes import faces_of
from metro.observables.observable import Observable
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.surface.face_noise import Noise
from metro.surface.tip_damping import Rayleigh
from metro.units import JSON, MM

SCATTER = 0.02
# rms over a face of three curvatures that are each off by the scanner's form: that of u² and of u v is 0.3.
UNRESOLVED = FORM_SD * math.sqrt(2.0 * 4.0 / 45.0 + 1.0 / 9.0)
SYSTEMATIC = 0.02  # of the mean force, which the coefficients and the load cells share among all runs


def observe(batch: Batch, read: Tables, _identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Measure each scanned face: indices, deviation map, heights at the path points; and keep the load tests.

    Tables ``face_indices``, ``face_map``, ``face_points``, ``face_beside``, ``face_loads``, ``face_mass``,
    ``face_planned``, ``face_refused``.
    """
    runs, planned = scanned(batch), planned_points(batch, read)
    if not runs and planned.empty:
        return Refusal("runs.csv names no scan", moot=bool(batch.with_files("slopes")))
    parts: dict[str, list[pd.DataFrame]] = {name: [] for name in FACE_TABLES}
    refused = []
    repeated = noise_by_repeats(batch, read)
    for run in runs:
        noise = repeated(run)
        path = read("path", run)
        # another scan of a face is no second piece of evidence on how it was cut
        path = path.iloc[:0] if scanned_again(batch, run) else path
        repeats = noise if isinstance(noise, Noise) else None
        with writing(Path(tempfile.gettempdir()) / "points"):  # of a cloud that does not fit in memory
            for name, cloud in faces_of(batch, read, run, cloud_of(read, run)):
                of_path = path if name == run else path.iloc[:0]  # which of several faces it cut is not known
                tables, reason = measured_run(batch, name, cloud, of_path, repeats)
                for kind, table in tables.items():
                    parts[kind].append(table)
                refused += [(name, reason)] if isinstance(reason, str) else []
        refused += [(run, noise)] if isinstance(noise, str) else []
    if not parts["face_indices"] and planned.empty:
        return Refusal("; ".join(f"run {run}: {reason}" for run, reason in refused))
    joined = {
        name: pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=[*FACE_TABLES[name]])
        for name, tables in parts.items()
    }
    return joined | {
        "face_loads": _placed(read("loads")[["pose", "point", *LOADS]]),
        "face_mass": _placed(read("mass")),
        "face_planned": planned,
        "face_refused": pd.DataFrame(refused, columns=["run", "reason"], dtype=str),
    }


def _placed(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that say where on the face they were measured."""
    return table[table[["x_mm", "y_mm"]].notna().all(axis=1)]


def scanned(batch: Batch) -> list[str]:
    """Return the runs with a scan, in the order of cutting."""
    table = batch.runs.sort_values("order", kind="stable")
    return [str(run) for run, file in table["scan"].items() if isinstance(file, str) and file]


def problem(batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON) -> Problem | Refusal:
    """Return blocks of load tests (calibrate) and faces (identify, validate), and the compliance model."""
    coefficients = _what_it_needs(batch, observed, identified)
    if isinstance(coefficients, Refusal):
        return coefficients
    notes = [f"Run {row.run} is left out: {row.reason}." for row in observed["face_refused"].itertuples()]
    points = observed["face_points"].assign(aside=False)
    if len(observed["face_beside"]):  # an empty table has no types, and would take those of the other
        points = pd.concat([points, observed["face_beside"].assign(aside=True)])
    faces = {str(run): table for run, table in points.groupby("run", sort=False)}
    poses, blocks = {}, []
    for run, table in faces.items():
        name = _pose_name(batch, run, observed["face_loads"])
        if name not in poses:
            poses[name] = _pose(name, observed)
        pose = poses[name]
        result = pose if isinstance(pose, Refusal) else face_block(batch, run, table, pose, coefficients)
        if isinstance(result, Refusal):
            notes.append(f"Run {run} is left out: {result.reason}.")
        else:
            blocks.append(result[0])
            notes += result[1]
    planned = observed["face_planned"]["run"].unique()
    for name in dict.fromkeys(_pose_name(batch, run, observed["face_loads"]) for run in planned):
        poses[name] = poses.get(name) or _pose(name, observed)
    known = [pose for pose in poses.values() if isinstance(pose, Pose)]
    if not blocks and not (known and len(planned)):
        return Refusal(
            " ".join([*notes, *(pose.reason for pose in poses.values() if isinstance(pose, Refusal))])
        )
    remarks = observed["face_placed"][["run", "remark"]].to_numpy(dtype=object).tolist()
    notes += [f"Run {run}: {remark}." for run, remark in remarks if remark]
    notes += [note for pose in known for note in pose.notes] + _limits(batch)
    placed = "to_work" in batch.instrument("scanner")
    rung = tuple(pose.field.pose for pose in known if pose.dynamics is not None)
    ringing = {block.setting.pose for block in blocks if block.setting.ringing is not None}
    beside = tuple(
        Beside(pose.field.pose, pose.dynamics.beside)
        for pose in known
        if pose.dynamics is not None and pose.dynamics.beside and pose.field.pose in ringing
    )
    fields = tuple(pose.field for pose in known)
    model = FlatnessModel(fields, placed=placed, ringing=rung, beside=beside)
    scatter = np.array([0.0 if one in model.believed else SCATTER for one in model.parameters])
    evidence = (
        believed_block(model.believed, beside, _held(known, blocks)),
        *(pose.block for pose in known),
        *without_what_repeats(blocks),
    )
    said = tuple(dict.fromkeys(notes))
    return Problem(NAME, "mm", MM, model, evidence, scatter, SYSTEMATIC, said, unresolved=UNRESOLVED)


def _held(poses: Sequence[Pose], faces: Sequence[Block]) -> float:
    """Return what the arm may hold back of a load, over the force of a cut; 0 where no face was cut."""
    forces = [float(np.linalg.norm(face.setting.force)) for face in faces]
    held = [held_back(one.field, one.block.setting.rows, float(one.block.sigma[0])) for one in poses]
    return max(held) / float(np.median(forces)) if forces else 0.0


def _what_it_needs(
    batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON
) -> dict[str, float] | Refusal:
    """Return the cutting coefficients, or which of the things that a prediction takes are lacking."""
    if "face_points" not in observed:
        return Refusal("no face was measured")
    if observed["face_points"].empty and observed["face_planned"].empty:
        reasons = observed["face_refused"].itertuples()
        return Refusal("; ".join(f"run {row.run}: {row.reason}" for row in reasons))
    if observed["face_loads"].empty:
        return Refusal(
            "no load test with x_mm and y_mm (loads.csv): the compliance of the arm at the tip is not known"
        )
    tool = cutting_force.cutter(batch)
    return tool if isinstance(tool, Refusal) else cutting_force.coefficients(batch, identified)


def _pose_name(batch: Batch, run: str, loads: pd.DataFrame) -> str:
    """Pose of a run; where only one pose was loaded, blank means that one."""
    named = batch.runs.loc[run, "pose"]
    known = loads["pose"].astype(str).unique()
    return str(named) if isinstance(named, str) and named else (str(known[0]) if len(known) == 1 else "")


def _pose(name: str, observed: Mapping[str, pd.DataFrame]) -> Pose | Refusal:
    loads, mass = (
        table[table["pose"].astype(str) == name] for table in (observed["face_loads"], observed["face_mass"])
    )
    if loads.empty:
        return Refusal(f"loads.csv has no tests at its pose {name!r}")
    return pose_of_loads(name, loads, mass, observed.get("modes", pd.DataFrame()))


def _limits(batch: Batch) -> list[str]:
    placed = "to_work" in batch.instrument("scanner")
    return [
        "The face is compared where the cutter is fully engaged (one radius from entry and exit); the "
        "spindle is square to it. Where no impact test at the pose gives the damping of the arm, its modes "
        "share one ratio of 5 %, known to a factor of two.",
        "Scans are placed by the declared scanner-to-work transform. Its height, and its tilts as the height "
        "at the edges, may have an error of 0.1 mm that all scans share, and another of 10 µm in each scan."
        if placed
        else "No scanner-to-work transform is declared: an offset and two tilts are left out of the measured "
        "and of the predicted heights alike, so that only the shape is compared, and what moves or tilts a "
        "whole face cannot be found.",
    ]


def report(
    batch: Batch,
    observed: Mapping[str, pd.DataFrame],
    identified: JSON,
    task: Problem | Refusal,
    fit: BaseFit | None,
) -> JSON:
    """Return each face's indices (as read, and less the bias), X_m as predicted, and the tip's damping."""
    predicted = {} if isinstance(task, Refusal) or fit is None else paired(task, fit)
    faces: JSON = {}
    for run, table in observed["face_indices"].groupby("run", sort=False):
        faces[str(run)] = _face_json(table) | predicted.get(str(run), {})
    blocks: JSON = {"faces": faces} | (
        {} if isinstance(task, Refusal) else tip_block(_damping(task, observed))
    )
    advised = advice(
        *(batch, observed, identified, task, fit),
        pose_of=lambda run: _pose(_pose_name(batch, run, observed["face_loads"]), observed),
    )
    xm = {run: face["xm_predicted"]["value"] for run, face in faces.items() if "xm_predicted" in face}
    return blocks | studied(batch, observed, xm, advised)


def _face_json(table: pd.DataFrame) -> JSON:
    first = table.iloc[0]
    read, corrected, sd = (table[name].to_numpy(dtype=float) for name in ("value_um", "corrected_um", "u_um"))
    names = table["index_name"].astype(str)
    entry: JSON = {n: quantity(v, u, "um") for n, v, u in zip(names, read, sd, strict=True)}
    ends = table[["low_um", "high_um"]].to_numpy(dtype=float)
    entry["noise_corrected"] = {
        # The interval under the noise is not symmetric, and begins at zero for a face that may be flat.
        n: quantity(v, u, "um") | ({"ci95": end.tolist()} if np.isfinite(end).all() else {})
        for n, v, u, end in zip(names, corrected, sd, ends, strict=True)
        if n != "percentile_range"
    }
    entry["sigma"] = quantity(float(first["sigma_um"]), math.nan, "um")
    entry["sigma_source"] = str(first["sigma_source"])
    nesting = float(first["nesting_index_mm"])
    entry["filter"] = (
        {"name": "areal Gaussian (ISO 16610-61)", "nesting_index_mm": nesting}
        if math.isfinite(nesting)
        else None
    )
    return entry | {"points": int(first["points"]), "outliers": int(first["outliers"])}


def _damping(task: Problem, observed: Mapping[str, pd.DataFrame]) -> dict[str, Rayleigh]:
    """Return a0 and a1 of each pose where impacts identified them: of milled faces, and of planned ones."""
    settings = [block.setting for block in task.role("identify", "validate")]
    rung = {each.pose: each.ringing.damping for each in settings if each.ringing is not None}
    return struck_damping(observed) | {n: d for n, d in rung.items() if isinstance(d, Rayleigh)}


def struck_damping(observed: Mapping[str, pd.DataFrame]) -> dict[str, Rayleigh]:
    """Return a0 and a1 of each pose of the load tests for which impacts identified them."""
    poses = {str(name): _pose(str(name), observed) for name in observed["face_loads"]["pose"].unique()}
    known = {n: p.dynamics for n, p in poses.items() if isinstance(p, Pose) and p.dynamics is not None}
    return {n: tip.damping for n, tip in known.items() if tip.damping is not None}


def ranked_again(
    batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON, problem: Problem, fit: BaseFit
) -> JSON:
    """Rank the configurations of faces again, as the model with the effects found predicts them."""
    return after_loop(report(batch, observed, identified, problem, fit))


OBSERVABLE = Observable(NAME, TABLES, observe, problem, report, after_loop=ranked_again)
