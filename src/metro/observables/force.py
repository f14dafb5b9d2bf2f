"""Cutting force: dynamometer records as order averages, and the mechanistic model that predicts them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.chip import path_difference
from metro.cutting.cutter import Cutter
from metro.cutting.helical import Helix
from metro.cutting.law import EdgeLaw
from metro.observables import cutting_force
from metro.observables.force_coefficients import AXES, correlation, mean_coefficients, waveform
from metro.observables.force_model import ForceModel, ForceSetting
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.signals import orders, steady
from metro.units import DEG, JSON, MM, RPM, UM, Array

OBSERVABLE = "force"
ANGLES = 120
TIME_BLOCKS = 4
SCATTER = 0.01
ZERO_SHARE = 0.003  # of a run's rms: how far its zero may be off where it was read in the air
LEAST_FEED_RATIO = 1.1  # between axial feeds that part the shear from the edge term of the bottom edges
UNZEROED_SHARE = 0.01  # and where the record has no air

Read = Callable[..., pd.DataFrame]


def observe(batch: Batch, read: Read, _identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Turn dynamometer records into order averages: tables ``orders`` and ``spindle`` (speed of each run)."""
    runs = recorded(batch)
    if not runs:
        return Refusal("runs.csv names no dynamometer file")
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal):
        return tool
    results = [_observed(batch, run, read("force", run), tool) for run in runs]
    tables = [result for result in results if not isinstance(result, Refusal)]
    refused = [result.reason for result in results if isinstance(result, Refusal)]
    if not tables:
        return Refusal("; ".join(refused))
    return {
        "orders": pd.concat([table for table, _ in tables], ignore_index=True),
        "spindle": pd.DataFrame([row for _, row in tables]),
        "force_refused": pd.DataFrame({"reason": refused}, dtype=str),
    }


def recorded(batch: Batch) -> list[str]:
    """Return the runs with a dynamometer record, in the order of cutting."""
    table = batch.runs.sort_values("order", kind="stable")
    return [str(run) for run, file in table["dynamometer"].items() if isinstance(file, str) and file]


def _observed(
    batch: Batch, run: str, record: pd.DataFrame, tool: Cutter
) -> tuple[pd.DataFrame, JSON] | Refusal:
    """Order averages of a run's steady cut, and what was found on the way."""
    time, signal = record["t_s"].to_numpy(), record[["fx_n", "fy_n", "fz_n"]].to_numpy()
    row: Any = batch.runs.loc[run]
    rate = (len(time) - 1) / (time[-1] - time[0])
    nominal = row["spindle_rpm"] / 60.0
    try:
        found = steady.segments(signal, rate / nominal, round(rate * _settling(row, tool)))
    except ValueError as error:
        return Refusal(f"run {run}: {error}")
    zero = signal[found.air].mean(axis=0) if found.air.any() else np.zeros(3)
    time, signal = time[found.steady], signal[found.steady] - zero
    orbit = _orbit_rate(row) / (2.0 * math.pi)
    signal = _with_orbit(time, signal, orbit)
    highest = orders.highest_order(rate, nominal, tool.teeth)
    tacho = record["spindle_deg"].to_numpy()[found.steady]
    if np.isfinite(tacho).all():
        angle = np.unwrap(tacho * DEG) + 2.0 * math.pi * orbit * time
        speed, deviation = (angle[-1] - angle[0]) / (2.0 * math.pi * (time[-1] - time[0])), 0.0
    else:
        speed, deviation = orders.spindle_speed(time, signal, nominal + orbit, highest)
        angle = 2.0 * math.pi * speed * time
    averages = orders.order_averages(time, angle, signal, highest, TIME_BLOCKS)
    summary = {
        "run": run,
        "spindle_rpm": (speed - orbit) * 60.0,
        "spindle_rpm_sd": deviation * 60.0,
        "steady_from_s": float(time[0]),
        "steady_to_s": float(time[-1]),
        "air_s": float(found.air.sum() / rate),
        **{f"zero_{axis}_n": float(value) for axis, value in zip(AXES, zero, strict=True)},
        **{
            f"mean_{axis}_n": float(value)
            for axis, value in zip(AXES, _whole_mean(angle, signal), strict=True)
        },
    }
    return pd.concat(
        [_long(run, i, average) for i, average in enumerate(averages)], ignore_index=True
    ), summary


def _whole_mean(angle: Array, signal: Array) -> Array:
    """Mean force over whole revolutions, (3,) N; a last one that lacks less than 2 % counts as whole."""
    turned = angle - angle[0]
    whole = math.floor(turned[-1] / (2.0 * math.pi) * (1.0 + 1.0 / len(angle)) + 0.02)
    mean: Array = signal[turned < 2.0 * math.pi * whole].mean(axis=0)
    return mean


def _settling(row: pd.Series, tool: Cutter) -> float:
    """Time from first contact to full engagement, s: one radius of travel, or one orbit of a helix."""
    if row["operation"] == "helical":
        return 60.0 / abs(float(row["orbit_rpm"]))
    return tool.radius / (
        float(row["feed_per_tooth_mm"]) * MM * tool.teeth * float(row["spindle_rpm"]) / 60.0
    )


def _orbit_rate(row: pd.Series) -> float:
    """Orbit speed of a run, rad/s, positive counter-clockwise seen from +z; zero unless helical."""
    return float(row["orbit_rpm"]) * RPM if row["operation"] == "helical" else 0.0


def _with_orbit(time: Array, signal: Array, orbit: float) -> Array:
    """Turn the force into a frame that turns with the orbit, where helical milling repeats with the tool."""
    if orbit == 0.0:
        return signal
    c, s = np.cos(2.0 * math.pi * orbit * time), np.sin(2.0 * math.pi * orbit * time)
    x, y = signal[:, 0], signal[:, 1]
    return np.column_stack([c * x + s * y, c * y - s * x, signal[:, 2]])


def _long(run: str, block: int, average: orders.OrderAverage) -> pd.DataFrame:
    """One row per axis and element of the order coefficients."""
    channels, elements = average.value.shape
    return pd.DataFrame(
        {
            "run": run,
            "block": block,
            "t_s": average.middle,
            "axis": np.repeat(AXES, elements),
            "order": np.tile((np.arange(elements) + 1) // 2, channels),
            "part": np.tile(["mean"] + ["cosine", "sine"] * (elements // 2), channels),
            "force_n": average.value.ravel(),
            "variance_n2": average.variance.ravel(),
        }
    )


def problem(batch: Batch, observed: dict[str, pd.DataFrame], _identified: JSON) -> Problem | Refusal:
    """Blocks of evidence from the order averages, and the base model told of what the manifest declares."""
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal) or "orders" not in observed:
        return tool if isinstance(tool, Refusal) else Refusal("no order averages")
    by_run = dict(tuple(observed["orders"].groupby("run", sort=False)))
    spindle = observed["spindle"].set_index("run")
    blocks = tuple(
        _block(batch, run, by_run[run], tool, spindle.loc[run]) for run in recorded(batch) if run in by_run
    )
    helical = any(block.setting.helix is not None for block in blocks)
    model = ForceModel(cutter=tool, law=EdgeLaw(), bottom_edges=_bottom_edges(blocks))
    notes = [
        "The chip thickness is that of the true tooth paths, the force law linear in it; "
        "tool, machine and dynamometer are rigid in the base model.",
        _path_note(tool, blocks),
        f"Forces are compared per revolution up to spindle order {blocks[0].setting.highest}, "
        "in the work frame"
        + (" (helical runs: in the frame that turns with the orbit)." if helical else "."),
        *(f"Left out: {reason}." for reason in observed["force_refused"]["reason"]),
    ]
    scatter = np.full(len(model.parameters), SCATTER)
    return Problem(OBSERVABLE, "N", 1.0, model, blocks, scatter, notes=tuple(notes))


def _path_note(tool: Cutter, blocks: tuple[Block, ...]) -> str:
    """Say how far the true tooth paths are from feed × sine of the immersion, at the largest feed."""
    widest = max((block.setting.cut for block in blocks), key=lambda cut: cut.feed_per_tooth)
    difference = path_difference(tool, widest)
    share = difference.largest / widest.feed_per_tooth
    return (
        f"At {widest.feed_per_tooth / MM:.3g} mm per tooth the true chip differs from feed × sine by up to "
        f"{difference.largest / UM:.2g} µm ({100 * share:.2g} % of the feed), "
        f"{difference.rms / UM:.2g} µm rms."
    )


def _bottom_edges(blocks: tuple[Block, ...]) -> tuple[str, ...]:
    """Coefficients of the bottom edges that the helical runs tell: one axial feed gives their sum alone."""
    feeds = [
        block.setting.helix.axial_feed for block in blocks if block.role == "identify" and block.setting.helix
    ]
    if not feeds:
        return ()
    return ("kfac", "kfae") if max(feeds) > LEAST_FEED_RATIO * min(feeds) else ("kfae",)


def _block(batch: Batch, run: str, table: pd.DataFrame, tool: Cutter, spindle: Any) -> Block:
    row: Any = batch.runs.loc[run]
    middles = tuple(float(t) for t in table.groupby("block")["t_s"].first())
    highest = int(table["order"].max())
    values = table["force_n"].to_numpy()
    setting = ForceSetting(
        cut=cutting_force.cut(batch, run, tool.radius),
        feed_direction=cutting_force.or_zero(row["feed_direction_deg"]) * DEG,
        highest=highest,
        middles=middles,
        cut_length=float(row["cut_before_m"]) + 0.5 * cutting_force.or_zero(row["cut_length_mm"]) * MM,
        helix=helix(batch, row),
        feed_ratio=float(row["spindle_rpm"]) / float(spindle["spindle_rpm"]),
    )
    axis = table["axis"].to_numpy().astype(str)
    mean = (table["part"] == "mean").to_numpy()
    zeros = _zeros(axis, mean, table["t_s"].to_numpy(), _orbit_rate(row))
    rms = math.sqrt(float(np.sum(values**2)) / len(middles))
    return Block(
        run=run,
        condition=str(row["condition"]),
        role="validate" if row["role"] == "validate" else "identify",
        order=int(row["order"]),
        measured=values,
        sigma=np.sqrt(table["variance_n2"].to_numpy()),
        setting=setting,
        axis=axis,
        zeros=zeros,
        zero_sd=np.full(3, (ZERO_SHARE if spindle["air_s"] > 0.0 else UNZEROED_SHARE) * rms),
        coordinates=_coordinates(middles),
        synthesis=_synthesis(len(middles), highest),
        scale=_scale(table),
        repeats=len(middles),
        symmetries=_tooth_shifts(tool, 1 if setting.helix is None else 2),
        labels=np.where(mean, "mean", "order " + table["order"].astype(str)).astype(str),
    )


def _zeros(axis: np.ndarray, mean: np.ndarray, time: Array, orbit: float) -> Array:
    """Directions (n, 3) of a zero offset of the dynamometer along x, y, z.

    In helical milling the frame of the comparison turns with the orbit: zeros in x and y turn the other way.
    """
    along = {name: (axis == name) & mean for name in AXES}
    c, s = np.cos(orbit * time), np.sin(orbit * time)
    x = along["x"] * c - along["y"] * s
    y = along["x"] * s + along["y"] * c
    return np.column_stack([x, y, along["z"].astype(float)])


def helix(batch: Batch, row: pd.Series) -> Helix | None:
    """Return the path of a helical run's tool; None of any other run."""
    if row["operation"] != "helical":
        return None
    tool = batch.manifest["tool"]
    orbits_per_tooth = abs(row["orbit_rpm"]) / (row["spindle_rpm"] * tool["teeth"])
    radius = 0.5 * (batch.manifest["hole_diameter_mm"] - tool["diameter_mm"]) * MM
    return Helix(radius, row["axial_depth_mm"] * MM, row["axial_depth_mm"] * MM * orbits_per_tooth)


def _tooth_shifts(tool: Cutter, unknowns: int) -> Array:
    """Shifts of a run's unknowns, (N, unknowns), that make another tooth the first one."""
    shifts = np.zeros((tool.teeth, unknowns))
    shifts[:, 0] = tool.tooth_angles
    return shifts


def _scale(table: pd.DataFrame) -> Array:
    """Signal around each element: half from its own order, half spread evenly over its axis's orders."""
    power = table["force_n"] ** 2
    own = power.groupby([table["block"], table["axis"], table["order"]]).transform("mean")
    axis = power.groupby([table["block"], table["axis"]]).transform("mean")
    return np.asarray(np.sqrt(0.5 * (own + axis)))


def _synthesis(blocks: int, highest: int) -> Array:
    """Map from (block, axis, order element) to (block, axis, angle)."""
    angle = 2.0 * math.pi * np.arange(ANGLES) / ANGLES
    return np.asarray(np.kron(np.eye(blocks * len(AXES)), orders.order_matrix(angle, highest)), dtype=float)


def _coordinates(middles: tuple[float, ...]) -> dict[str, np.ndarray]:
    blocks = len(middles)
    return {
        "axis": np.tile(np.repeat(AXES, ANGLES), blocks),
        "t_s": np.repeat(middles, len(AXES) * ANGLES),
        "angle_deg": np.tile(np.arange(ANGLES) * 360.0 / ANGLES, len(AXES) * blocks),
    }


def report(
    _batch: Batch, observed: dict[str, pd.DataFrame], _identified: JSON, task: Problem, fit: BaseFit | None
) -> JSON:
    """Return coefficients by means and by waveform, and each run's spindle speed, for identified.json."""
    model = cast("ForceModel", task.base)
    spindle = observed["spindle"]
    runs = zip(spindle["run"], spindle["spindle_rpm"], spindle["spindle_rpm_sd"], strict=True)
    block: JSON = {
        "spindle_rpm": {run: quantity(speed, sd, "rpm") for run, speed, sd in runs},
        "edge_length": "axial",
    }
    found: dict[str, JSON | Refusal] = {
        "mean": mean_coefficients(model, task.role("identify"), spindle),
        "mean_all_runs": mean_coefficients(model, task.blocks, spindle),
        "waveform": waveform(model, fit),
    }
    lacking = {name: value.reason for name, value in found.items() if isinstance(value, Refusal)}
    if model.bottom_edges == ("kfae",):
        lacking["kfac"] = (
            "the helical runs have one axial feed: kfae holds the whole thrust of the bottom edges"
        )
    block |= {name: value for name, value in found.items() if not isinstance(value, Refusal)}
    block |= correlation(model, fit)
    return {"force": {**block, "not_identified": lacking} if lacking else block}
