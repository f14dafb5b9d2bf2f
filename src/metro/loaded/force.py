"""Cutting force over a revolution at settings that a user asks about, with its 95 % interval."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.cutting.force import mean_basis
from metro.cutting.law import EdgeLaw
from metro.loaded.found import COVERAGE, Found, found
from metro.loaded.settings import ASKED, COLUMNS, asked_for, wrong
from metro.observables.cut import conditions
from metro.observables.force.blocks import helix
from metro.observables.force.dynamometer import Dynamometer, Recording
from metro.observables.force.held_out_give import ITERATIONS, PER_NEWTON
from metro.observables.force.model import ForceModel, ForceSetting
from metro.observables.force.orders import orbit_rate
from metro.observables.problem import Block, Refusal
from metro.signals.orders import order_matrix
from metro.units import DEG, JSON, MM, N_MM, N_MM2, Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AXES = ("x", "y", "z")
HIGHEST = 179  # order up to which a force is predicted: what steps of 1° can show
STEP_DEG = 1.0
DRAWS = 60  # of the parameters of effects: an interval's end is known to a tenth of its half width


@dataclass(frozen=True, eq=False)
class ForcePrediction:
    """The force on the tool over one revolution.

    Attributes
    ----------
    settings : of the cut, by column of ``runs.csv``.
    table : ``angle_deg`` (of tooth 0, from an arbitrary zero), and of each axis of the work frame ``f*_n``
        with its 95 % interval ``f*_lo_n``, ``f*_hi_n``. Helical cuts: in the frame that turns with the orbit.
    effects : names of the effects that are included.
    notes : effects left out, and what the interval does not contain.
    """

    settings: Mapping[str, Any]
    table: pd.DataFrame
    effects: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def mean_n(self) -> dict[str, float]:
        """Mean over the revolution by axis, N."""
        return {axis: float(self.table[f"f{axis}_n"].mean()) for axis in AXES}

    @property
    def peak_n(self) -> float:
        """Largest force in the plane of the feed, N."""
        return float(np.hypot(self.table["fx_n"], self.table["fy_n"]).max())

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the three components with their intervals; return the axes."""
        from metro.loaded.plots import force_axes

        return force_axes(self, axes)


def predict_force(
    batch: Batch,
    model: ForceModel | Refusal | None,
    identified: JSON,
    *,
    entry: JSON,
    run: str | None,
    spindle: pd.DataFrame,
    **settings: Any,
) -> ForcePrediction:
    """Predict the force of a cut with the identified coefficients and the effects that the verdict names.

    The interval holds the errors of the coefficients with their correlation, those of the effects' parameters
    (taken as independent of them), and the error that held-out runs showed.

    Parameters
    ----------
    model : the base model as it was posed; None: that of the manifest. entry : of the force in
        ``verdict.json``; empty without a verdict. run, settings : as in :func:`asked_for`. spindle : observed
    table, which holds what the arm gives way in each run.

    Raises
    ------
    ContractError
        The batch has no coefficients or no tool, or there is no such cut.
    """
    asked = asked_for(batch, run, settings)
    base = _model(batch, model)
    beta, covariance = _coefficients(batch, base, identified)
    per_newton = _give_per_newton(spindle, run or str(batch.runs.index[0]))
    setting = _setting(asked, base.cutter, _give(asked, base.cutter, beta, per_newton))
    effects, notes = found(entry, "force")
    basis = _basis(_with(base, effects), setting, beta)
    value = basis @ beta
    variance = np.einsum("nai,ij,naj->na", basis, covariance, basis)
    rng = np.random.default_rng(0)
    if effects:
        drawn = [_basis(_with(base, effects, rng), setting, beta) @ beta for _ in range(DRAWS)]
        variance = variance + np.mean((np.array(drawn) - value) ** 2, axis=0)
    share = (entry.get("after") or {}).get("nrmse")
    if share is None:
        notes.append(
            "no held-out run tested this model: the interval holds the errors of its parameters alone"
        )
    variance = variance + (share or 0.0) ** 2 * float(np.mean(value**2))
    if "arm" in batch.cell and not per_newton.any() and asked.runs.loc[ASKED, "operation"] == "side":
        notes.append("the arm is taken as rigid: no load test says how far it gives way in this cut")
    half = COVERAGE * np.sqrt(variance)
    columns: dict[str, Any] = {"angle_deg": np.arange(0.0, 360.0, STEP_DEG)}
    for i, axis in enumerate(AXES):
        ends = {f"f{axis}_lo_n": value[:, i] - half[:, i], f"f{axis}_hi_n": value[:, i] + half[:, i]}
        columns |= {f"f{axis}_n": value[:, i], **ends}
    names = tuple(each.effect.name for each in effects)
    return ForcePrediction(_shown(asked), pd.DataFrame(columns), names, tuple(notes))


def _model(batch: Batch, posed: ForceModel | Refusal | None) -> ForceModel:
    """Return the base model with a sensor that reads the force as it is."""
    if isinstance(posed, ForceModel):
        return replace(posed, sensor=Dynamometer(axes=posed.sensor.axes))
    tool = conditions.cutter(batch)
    if isinstance(tool, Refusal):
        raise wrong(batch.name, f"its force cannot be predicted: {tool.reason}")
    return ForceModel(tool, EdgeLaw(), end_declared=conditions.end_declared(batch))


def _coefficients(batch: Batch, model: ForceModel, identified: JSON) -> tuple[Array, Array]:
    """Return the coefficients of a model (p,) in SI, and their covariance (p, p); 0 of declared ones."""
    force = identified.get("force") or {}
    waveform = force.get("waveform") or {}
    names = [parameter.name for parameter in model.parameters]
    if not all(name in waveform for name in names):
        declared = conditions.coefficients(batch, {})
        if isinstance(declared, Refusal):
            lacking = ", ".join(name for name in names if name not in waveform)
            raise wrong(
                batch.name, f"its force cannot be predicted: {lacking} were neither identified nor declared"
            )
        values = np.array([declared.get(name, 0.0) for name in names])
        return values * _si(names), np.zeros((len(names), len(names)))
    values = np.array([waveform[name]["value"] for name in names])
    half = [
        0.5 * (ends[1] - ends[0]) if None not in (ends := waveform[name]["ci95"]) else math.nan
        for name in names
    ]
    deviation = np.array(half) / COVERAGE * _si(names)
    correlation = np.eye(len(names))
    stated = force.get("correlation") or {}
    if stated.get("coefficients") == names:
        correlation = np.array(stated["matrix"])
    return values * _si(names), np.outer(deviation, deviation) * correlation


def _si(names: list[str]) -> Array:
    """Size in SI of the units of coefficients: shear per area, edge per length."""
    return np.array([N_MM2 if name.endswith("c") else N_MM for name in names])


def _give_per_newton(spindle: pd.DataFrame, run: str) -> Array:
    """Height by which the wall is proud per newton, (3,) m/N, in the pose of a run; 0 where not known."""
    rows = spindle[spindle["run"] == run] if len(spindle) else spindle
    return rows[PER_NEWTON].to_numpy(float)[0] * MM if len(rows) else np.zeros(3)


def _give(asked: Batch, tool: Cutter, beta: Array, per_newton: Array) -> float:
    """Height by which the wall is proud under the mean force of this cut, m: both solved together."""
    give = 0.0
    for _ in range(ITERATIONS if per_newton.any() else 0):
        basis = mean_basis(tool, EdgeLaw(), _setting(asked, tool, give).cut)
        give = float(per_newton @ conditions.work_from_feed(asked, ASKED) @ basis @ beta[:6])
    return give


def _setting(asked: Batch, tool: Cutter, give: float) -> ForceSetting:
    """Return what the model needs to know of the cut asked for."""
    row: Any = asked.runs.loc[ASKED]
    try:
        cut, path = conditions.cut(asked, ASKED, tool.radius, give), helix(asked, row)
    except ValueError as error:
        raise wrong("settings", str(error)) from None
    orbit = orbit_rate(row)
    curvature = 0.0 if path is None else math.copysign(1.0 / path.radius, orbit)
    speed = float(row["spindle_rpm"]) / 60.0 + orbit / (2.0 * math.pi)
    cut_before = conditions.or_zero(row["cut_before_m"]) + 0.5 * conditions.or_zero(row["cut_length_mm"]) * MM
    return ForceSetting(
        cut=replace(cut, curvature=curvature),
        feed_direction=conditions.or_zero(row["feed_direction_deg"]) * DEG,
        highest=HIGHEST,
        recording=Recording((0.0,), 0.0, speed, orbit),
        cut_length=cut_before,
        helix=path,
        give=give,
    )


def _with(model: ForceModel, effects: list[Found], rng: np.random.Generator | None = None) -> ForceModel:
    """Return a model with effects as they were found, or as they may be."""
    for each in effects:
        model = each.drawn(model, rng) if rng else each.applied(model)
    return model


def _basis(model: ForceModel, setting: ForceSetting, beta: Array) -> Array:
    """Force (angles, 3, p) on the tool per unit of each coefficient, over one revolution."""
    empty = np.zeros(0)
    zeros = np.zeros((3 * (2 * HIGHEST + 1), 0))
    block = Block(ASKED, "", "validate", 0, empty, empty, setting, empty, zeros, empty, {})
    nuisance = np.array([0.0] if setting.helix is None else [0.0, setting.feed_direction])
    matrix, _ = model.design(block, nuisance, beta)
    angle = np.arange(0.0, 360.0, STEP_DEG) * DEG
    orders = matrix.reshape(3, -1, matrix.shape[-1])
    return np.asarray(np.einsum("no,aop->nap", order_matrix(angle, HIGHEST), orders))


def _shown(asked: Batch) -> dict[str, Any]:
    """Return the settings of the cut asked for that are not blank."""
    row: Any = asked.runs.loc[ASKED]
    cells = {name: _plain(row[name]) for name in COLUMNS if name in row}
    return {name: value for name, value in cells.items() if not (pd.isna(value) or value == "")}


def _plain(value: Any) -> Any:
    """Return a cell of the run table as a number or text of Python."""
    return value.item() if isinstance(value, np.generic) else value
