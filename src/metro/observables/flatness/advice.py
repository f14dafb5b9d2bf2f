"""Advice before cutting: X_m of runs that are planned and not cut, from load tests (and impacts) alone.

A run is planned if runs.csv gives the path of a face and no file that a cut leaves. Its face is predicted
like a face that was scanned. The uncertain inputs are drawn: the compliance, the cutting forces, the damping.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness.beliefs import FORM
from metro.observables.flatness.blocks import Pose, face_block
from metro.observables.flatness.path import beside, disc_along, work_size
from metro.observables.flatness.placing import plane_directions
from metro.observables.flatness.scan import POINT_COLUMNS
from metro.observables.flatness.study import configuration, factors_of, levels_of, study
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.surface.footprint import RADIUS
from metro.surface.ranking import posterior_draws, probability_best
from metro.units import JSON, MM, UM, Array

LEFT_BY_A_CUT = ("dynamometer", "robot_log", "idle_log", "scan", "profile", "slopes", "stable", "started_at")
DRAWS = 2000
SEED = 1
MANY = 1000  # points that a disc on the face would hold
NORMAL = 1.959963984540054


@dataclass(frozen=True, eq=False)
class Choice:
    """Runs that are planned with the same settings on the same path; ``block`` is their face.

    ``forces``: the face with one cutting coefficient after another changed by one standard error.
    """

    runs: tuple[str, ...]
    block: Block
    forces: tuple[Block, ...]


@dataclass(frozen=True, eq=False)
class Unknown:
    """Draws of the unknowns that all choices share.

    ``beta`` (draws, p); ``coefficients`` (draws, c) and ``damping`` (draws, d) in standard errors;
    ``place`` (draws,) in 0…1 selects among the nuisances of the cut ``faces``; ``scale`` is the error of the
    force if the errors of the coefficients are not known.
    """

    beta: Array
    coefficients: Array
    damping: Array
    place: Array
    faces: tuple[Array, ...]
    scale: float


def planned_runs(batch: Batch) -> list[str]:
    """Return the runs that would mill a face along a path and have no file of a cut, in cutting order."""
    table = batch.runs.sort_values("order", kind="stable")
    if "path" not in table or "operation" not in table:
        return []
    given = (table["operation"] == "face") & (table["path"].fillna("") != "")
    for column in LEFT_BY_A_CUT:
        given &= table[column].fillna("") == "" if column in table else True
    return [str(run) for run in table.index[given]]


def planned_points(batch: Batch, read: Callable[..., pd.DataFrame]) -> pd.DataFrame:
    """Return the points at which planned faces would be compared: table ``face_planned``.

    They are like those of a scanned face (``face_points`` and, with ``aside``, ``face_beside``), at the
    programmed height.
    """
    tables = [
        _points(batch, run, read("path", run))
        for run in planned_runs(batch)
        if not cutting_force.unset(batch, run)
    ]
    columns = [*POINT_COLUMNS, "aside"]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=columns)


def _points(batch: Batch, run: str, path: pd.DataFrame) -> pd.DataFrame:
    both = pd.concat([path.assign(aside=False), beside(path).assign(aside=True)], ignore_index=True)
    disc = disc_along(path, 0.0)
    place = both[["x_mm", "y_mm"]].to_numpy(dtype=float)
    size = np.array(work_size(batch)) / MM
    low, high = (np.zeros(2), size) if np.isfinite(size).all() else (place.min(axis=0), place.max(axis=0))
    on = np.all((place >= low + RADIUS / MM) & (place <= high - RADIUS / MM), axis=1).reshape(len(place))
    step = np.hypot(*np.diff(place, axis=0).T) * (np.diff(both["pass"].to_numpy()) == 0)
    return both.assign(
        run=run,
        s_mm=np.concatenate([[0.0], np.cumsum(step)]),
        programmed_z_mm=both["z_mm"],
        z_mm=both["z_mm"].where(on),
        sigma_mm=UM / MM,
        k=np.where(on, MANY, 0),
        coverage=on.astype(float),
        disc_along_mm=disc.along / MM,
        disc_across_mm=disc.across / MM,
    )[[*POINT_COLUMNS, "aside"]]


def advice(
    batch: Batch,
    observed: Mapping[str, pd.DataFrame],
    identified: JSON,
    task: Problem | Refusal,
    fit: BaseFit | None,
    *,
    pose_of: Callable[[str], Pose | Refusal],
) -> JSON:
    """Rank the configurations of the planned runs: predicted X_m with interval, probability of being best.

    ``task``, ``fit``: the model and its uncertainty; ``pose_of``: a run → the load tests at its pose. The
    result is empty without planned runs; else ``{"advice": …}``, or the reason under ``not_identified``.
    """
    planned = observed.get("face_planned", pd.DataFrame())
    if planned.empty:
        return {}
    if isinstance(task, Refusal) or fit is None:
        reason = task.reason if isinstance(task, Refusal) else "nothing could be fitted"
        return {"not_identified": {"advice": reason}}
    values = cutting_force.coefficients(batch, identified)
    if isinstance(values, Refusal):
        return {"not_identified": {"advice": values.reason}}
    off = _coefficients_off(batch, identified, values)
    chosen, refused = _choices(batch, planned, pose_of, values, off)
    if not chosen:
        return {"not_identified": {"advice": "; ".join(refused)}}
    scale = task.systematic if not off else 0.0
    heights = predicted_heights(task, fit, chosen, scale)
    xm = np.column_stack([ranges(c.block, drawn) for c, drawn in zip(chosen, heights, strict=True)])
    cut = bool(task.role("identify", "validate"))
    return {
        "advice": {
            "measured": False,
            "statement": _statement(cut, scale, off),
            "configurations": _configurations(batch, chosen, xm),
            "left_out": refused,
        }
    }


def _coefficients_off(
    batch: Batch, identified: JSON, values: Mapping[str, float]
) -> list[Mapping[str, float]]:
    """Return the coefficients, one after another changed by a standard error; none if they are declared."""
    waveform = (identified.get("force") or {}).get("waveform") or {}
    if batch.manifest.get("coefficients") or not waveform:
        return []
    result: list[Mapping[str, float]] = []
    for name in values:
        low, high = (waveform.get(name) or {}).get("ci95") or (None, None)
        if low is not None and high is not None:
            result.append({**values, name: values[name] + (high - low) / (2 * NORMAL)})
    return result


def _choices(
    batch: Batch,
    planned: pd.DataFrame,
    pose_of: Callable[[str], Pose | Refusal],
    values: Mapping[str, float],
    off: Sequence[Mapping[str, float]],
) -> tuple[list[Choice], list[str]]:
    """Return one choice for each condition and path, and the reasons why others cannot be predicted."""
    rows = batch.runs.loc[[str(run) for run in planned["run"].unique()]]
    chosen, refused = [], []
    for _, group in rows.groupby(["condition", "path"], sort=False):
        runs = tuple(str(run) for run in group.index)
        pose = pose_of(runs[0])
        table = planned[planned["run"] == runs[0]].reset_index(drop=True)
        blocks = [
            pose if isinstance(pose, Refusal) else face_block(batch, runs[0], table, pose, each)
            for each in (values, *off)
        ]
        fine = [block[0] for block in blocks if not isinstance(block, Refusal)]
        if len(fine) == len(blocks):
            chosen.append(Choice(runs, fine[0], tuple(fine[1:])))
        else:
            why = next(block.reason for block in blocks if isinstance(block, Refusal))
            refused.append(f"run {runs[0]}: {why}")
    return chosen, refused


def predicted_heights(
    task: Problem, fit: BaseFit, chosen: Sequence[Choice], scale: float = 0.0
) -> list[Array]:
    """Draw the faces of each choice, (draws, n) m.

    All faces share the unknowns: the compliance, the coefficients (or, if they are declared, a common
    ``scale`` of the force), the damping, and the nuisance of a face. The nuisance comes from the faces that
    were cut, else from the whole range of the model.
    """
    rng = np.random.default_rng(SEED)
    directions = [choice.block.unidentified for choice in chosen]
    doubts = max(0 if each is None else each.shape[1] for each in directions)
    unknown = Unknown(
        beta=posterior_draws(fit.beta, fit.covariance, _dof(task, fit), DRAWS, SEED),
        coefficients=rng.standard_normal((DRAWS, max(1, len(chosen[0].forces)))),
        damping=rng.standard_normal((DRAWS, doubts)),
        place=rng.random(DRAWS),
        faces=tuple(fit.nuisance[b.run] for b in task.role("identify", "validate") if b.run in fit.nuisance),
        scale=scale,
    )
    return [_drawn(task, fit, choice, unknown) for choice in chosen]


def _dof(task: Problem, fit: BaseFit) -> float:
    """Degrees of freedom of the compliance: those of the load tests if no face was cut."""
    if task.role("identify", "validate"):
        return fit.dof
    readings = sum(len(block.measured) for block in task.role("calibrate"))
    return float(max(1, readings - len(fit.beta)))


def _drawn(task: Problem, fit: BaseFit, choice: Choice, unknown: Unknown) -> Array:
    starts = task.base.nuisance_starts(choice.block)
    own = [value for value in unknown.faces if len(value) == starts.shape[1]]
    places = np.array(own) if own else starts
    taken = (unknown.place * len(places)).astype(int)
    result = np.empty((len(unknown.beta), len(choice.block.measured)))
    of_the_face = _of_the_face(task)
    for number in np.unique(taken):
        rows = taken == number
        design, offset = task.base.design(choice.block, places[number], fit.beta)
        design = design * of_the_face
        base = offset + design @ fit.beta
        off = [_at(task, fit, block, places[number]) - base for block in choice.forces]
        off = off or [unknown.scale * base]
        result[rows] = base + (unknown.beta[rows] - fit.beta) @ design.T
        result[rows] += unknown.coefficients[rows] @ np.array(off)
    damping = choice.block.unidentified
    return result if damping is None else result + unknown.damping[:, : damping.shape[1]] @ damping.T


def _at(task: Problem, fit: BaseFit, block: Block, nuisance: Array) -> Array:
    design, offset = task.base.design(block, nuisance, fit.beta)
    return np.asarray(offset + design @ (fit.beta * _of_the_face(task)))


def _of_the_face(task: Problem) -> np.ndarray:
    """Return which base parameters shape a face, (p,): not the form of the scanner."""
    return np.array([one.name not in FORM for one in task.base.parameters])


def ranges(block: Block, heights: Array) -> Array:
    """Return X_m of ``heights`` (draws, n) at a block's points: their range about the plane, (draws,) m."""
    basis = np.linalg.qr(plane_directions(block.coordinates["x_mm"], block.coordinates["y_mm"]))[0]
    return np.asarray(np.ptp(heights - (heights @ basis) @ basis.T, axis=1))


def _configurations(batch: Batch, chosen: Sequence[Choice], xm: Array) -> list[JSON]:
    rows = batch.runs.loc[[choice.runs[0] for choice in chosen]]
    factors = factors_of(rows)
    best = probability_best(xm)
    middle, low, high = np.quantile(xm, [0.5, 0.025, 0.975], axis=0) / UM
    return [
        {
            "configuration": configuration(levels_of(factors, i))
            or str(batch.runs.loc[chosen[i].runs[0], "condition"]),
            "levels": levels_of(factors, i),
            "runs": list(chosen[i].runs),
            "xm_predicted": {
                "value": float(middle[i]),
                "ci95": [float(low[i]), float(high[i])],
                "unit": "um",
            },
            "probability_best": float(best[i]),
        }
        for i in map(int, np.argsort(middle))
    ]


def _statement(cut: bool, scale: float, off: Sequence[object]) -> str:
    """Say which evidence the ranking uses, and which errors no prediction contains."""
    rests = (
        "the load tests and the faces that were cut" if cut else "load tests; no face of this batch was cut"
    )
    forces = (
        f"{100 * scale:.0f} % of the force, since the cutting coefficients are declared without errors"
        if not off
        else "those of the cutting coefficients, as the force runs leave them"
    )
    return (
        f"Nothing was measured of these runs: X_m is predicted from {rests}. In the intervals: the error of "
        f"the compliance; {forces}; what is not known of the damping. Not in them: scatter from run to "
        "run, the scanner's noise, and whatever shapes the face beside the force. X_m is that of the points "
        "of the path a radius or more from entry and exit: a scan of the whole face reads more."
    )


def studied(
    batch: Batch,
    observed: Mapping[str, pd.DataFrame],
    predicted: Mapping[str, float],
    advised: JSON,
) -> JSON:
    """Return the block ``study``: the study of the measured faces, and advice on those that were not cut."""
    indices = observed["face_indices"]
    indices = indices[indices["run"].isin(batch.runs.index)]  # several faces of one scan are no runs
    block = study(batch, indices, predicted) if indices["run"].nunique() > 1 else {}
    lacking = {**block.get("not_identified", {}), **advised.get("not_identified", {})}
    whole = {**block, **advised} | ({"not_identified": lacking} if lacking else {})
    return {"study": whole} if whole else {}


def after_loop(reported: JSON) -> JSON:
    """Return the parts of a report with the identified effects that the study adds to the base model's."""
    study_block = reported.get("study") or {}
    kept = {name: study_block[name] for name in ("ranking", "agreement", "advice") if name in study_block}
    return {"study": {"after_loop": kept}} if kept else {}
