"""Blocks of evidence on the cutting force: the order averages of a run, and what its model needs."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.cutting.helical import Helix
from metro.observables.cut import conditions as cutting_force
from metro.observables.force.coefficients import AXES
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceSetting
from metro.observables.force.orders import orbit_rate
from metro.observables.problem import Block
from metro.signals import orders
from metro.units import DEG, MM, Array

ANGLES = 120
ZERO_SHARE = 0.003  # standard error of a zero that was read in the air, as a share of the run's rms
UNZEROED_SHARE = 0.01  # the same for a record without air, at least
ENOUGH_ZEROS = 3  # records that were read in the air, to say how far from nought a zero may be


def block_of(batch: Batch, run: str, table: pd.DataFrame, tool: Cutter, spindles: pd.DataFrame) -> Block:
    """Return the block of a run from its order averages ``table`` and the spindle table of all runs."""
    spindle: Any = spindles.loc[run]
    row: Any = batch.runs.loc[run]
    middles = tuple(float(t) for t in table.groupby("block")["t_s"].first())
    highest = int(table["order"].max())
    values = table["force_n"].to_numpy()
    path = helix(batch, row)
    cut = cutting_force.cut(batch, run, tool.radius, spindle["give_mm"] * MM)
    if path is not None:
        curvature = math.copysign(1.0 / path.radius, row["orbit_rpm"])
        cut = replace(cut, curvature=curvature, pitch=path.pitch)
    setting = ForceSetting(
        cut=cut,
        feed_direction=cutting_force.or_zero(row["feed_direction_deg"]) * DEG,
        highest=highest,
        recording=_recording(row, middles, spindle),
        cut_length=float(row["cut_before_m"]) + 0.5 * cutting_force.or_zero(row["cut_length_mm"]) * MM,
        helix=path,
        feed_ratio=float(row["spindle_rpm"]) / float(spindle["spindle_rpm"]),
        give=float(spindle["give_mm"]) * MM,
        give_sd=float(spindle.get("give_sd_mm", 0.0)) * MM,
    )
    axis = table["axis"].to_numpy().astype(str)
    mean = (table["part"] == "mean").to_numpy()
    directions = zeros(axis, mean, table["t_s"].to_numpy(), setting.recording)
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
        zeros=directions,
        zero_sd=np.full(3, ZERO_SHARE * rms)
        if spindle["air_s"] > 0.0
        else np.maximum(UNZEROED_SHARE * rms, read_zeros(spindles)),
        coordinates=_coordinates(middles),
        synthesis=_synthesis(len(middles), highest),
        scale=_scale(table, turning=path is not None),
        repeats=len(middles),
        symmetries=_tooth_shifts(tool, 1 if setting.helix is None else 2),
        labels=np.where(mean, "mean", "order " + table["order"].astype(str)).astype(str),
        slow=_slow(setting.recording),
    )


def read_zeros(spindles: pd.DataFrame) -> Array:
    """Rms (3,) of the zeros, N, that the other records of the session show in the air; 0 if these are few.

    A record without air has a zero of that size, which nobody has read: the charge may have drifted for as
    long since the amplifier was reset.
    """
    read = spindles[spindles["air_s"] > 0.0]
    if len(read) < ENOUGH_ZEROS:
        return np.zeros(3)
    columns = read[[f"zero_{axis}_n" for axis in AXES]].to_numpy()
    return np.asarray(np.sqrt(np.mean(columns**2, axis=0)))


def _recording(row: Any, middles: tuple[float, ...], spindle: Any) -> Recording:
    orbit = orbit_rate(row)
    return Recording(
        middles,
        span=(spindle["steady_to_s"] - spindle["steady_from_s"]) / len(middles),
        speed=float(spindle["spindle_rpm"]) / 60.0 + orbit / (2.0 * math.pi),
        orbit=orbit,
        zero_at=float(spindle["zero_at_s"]),
        contact=float(spindle["contact_s"]),
        slope=_read(spindle, "slope_{}_n_s"),
        slope_sd=_read(spindle, "slope_{}_n_s_sd"),
    )


def _read(spindle: Any, column: str) -> tuple[float, float, float] | None:
    """Values of three axes of a row of the spindle table; None where they were not read."""
    x, y, z = (float(spindle.get(column.format(axis), math.nan)) for axis in AXES)
    return (x, y, z) if math.isfinite(x + y + z) else None


def _slow(recording: Recording) -> dict[str, Array]:
    """Return the slow changes that a run may show: with the time, and in helical milling with the orbit."""
    time = np.array(recording.middles)
    slow = {"along the run": (time - time.mean())[:, None]}
    angle = recording.orbit * time
    if recording.orbit and len(time) * abs(recording.orbit) * recording.span > math.pi:
        slow |= {
            name: np.column_stack([np.cos(count * angle), np.sin(count * angle)])
            for count, name in ((1, "once per orbit"), (2, "twice per orbit"))
        }
    return slow


def zeros(axis: np.ndarray, mean: np.ndarray, time: Array, recording: Recording) -> Array:
    """Return directions (n, 3) of a zero offset of the dynamometer along x, y, z.

    In helical milling the frame of the comparison turns with the orbit: zeros in x and y turn the other way.
    """
    along = {name: (axis == name) & mean for name in AXES}
    c, s = (recording.attenuation * wave(recording.orbit * time) for wave in (np.cos, np.sin))
    x = along["x"] * c - along["y"] * s
    y = along["x"] * s + along["y"] * c
    return np.column_stack([x, y, along["z"].astype(float)])


def helix(batch: Batch, row: pd.Series) -> Helix | None:
    """Return the path of a helical run's tool; None for any other run."""
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


def _scale(table: pd.DataFrame, *, turning: bool) -> Array:
    """Signal around each element: half from its own order, half spread evenly over its axis's orders.

    x and y of a frame that is ``turning`` share one scale, because the direction of feed at the start of the
    record decides which of them has the force.
    """
    power, axis = table["force_n"] ** 2, table["axis"]
    if turning:
        axis = axis.replace("y", "x")
    own = power.groupby([table["block"], axis, table["order"]]).transform("mean")
    whole = power.groupby([table["block"], axis]).transform("mean")
    return np.asarray(np.sqrt(0.5 * (own + whole)))


@lru_cache
def _synthesis(blocks: int, highest: int) -> Array:
    """Map from (block, axis, order element) to (block, axis, angle); read-only, shared by equal runs."""
    angle = 2.0 * math.pi * np.arange(ANGLES) / ANGLES
    matrix = np.asarray(np.kron(np.eye(blocks * len(AXES)), orders.order_matrix(angle, highest)), dtype=float)
    matrix.flags.writeable = False
    return matrix


def _coordinates(middles: tuple[float, ...]) -> dict[str, np.ndarray]:
    blocks = len(middles)
    return {
        "axis": np.tile(np.repeat(AXES, ANGLES), blocks),
        "t_s": np.repeat(middles, len(AXES) * ANGLES),
        "angle_deg": np.tile(np.arange(ANGLES) * 360.0 / ANGLES, len(AXES) * blocks),
    }
