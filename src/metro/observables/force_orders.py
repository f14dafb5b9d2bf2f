"""Dynamometer records as order averages: what a run's steady cut repeats with every revolution."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.observables import cutting_force
from metro.observables.arm_give import give_of, giving_arm
from metro.observables.force_coefficients import AXES
from metro.observables.problem import Refusal
from metro.signals import orders, steady
from metro.units import DEG, JSON, MM, RPM, Array

TIME_BLOCKS = 4
BLOCKS_PER_ORBIT = 8  # of helical runs: what changes with the orbit is seen up to twice per orbit
MOST_BLOCKS = 16
REVOLUTIONS_PER_BLOCK, REVOLUTIONS_PER_ORBIT_BLOCK = 16, 8

Read = Callable[..., pd.DataFrame]


def observe(batch: Batch, read: Read, _identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Turn dynamometer records into order averages: tables ``orders`` and ``spindle`` (speed of each run)."""
    runs = recorded(batch)
    if not runs:
        return Refusal("runs.csv names no dynamometer file")
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal):
        return tool
    arm = giving_arm(batch, read)
    results = [_observed(batch, run, read("force", run), tool) for run in runs]
    tables = [result for result in results if not isinstance(result, Refusal)]
    for _, row in tables:
        force = np.array([row[f"mean_{axis}_n"] for axis in AXES])
        row["give_mm"] = give_of(batch, row["run"], read, arm, force) / MM
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
    air = _zeroing(found)
    zero = signal[air].mean(axis=0) if air.any() else np.zeros(3)
    settling = _settling(row, tool) if found.steady.start > 0 else 0.0
    at = {
        "zero_at_s": float(time[air].mean() if air.any() else time[0]),
        "contact_s": float(time[found.steady.start] - 0.5 * settling),
    }
    time, signal = time[found.steady], signal[found.steady] - zero
    orbit = orbit_rate(row) / (2.0 * math.pi)
    signal = with_orbit(time, signal, orbit)
    highest = orders.highest_order(rate, nominal, tool.teeth)
    tacho = record["spindle_deg"].to_numpy()[found.steady]
    angle, speed, deviation = spindle_angle(
        time, signal, tacho, nominal=nominal, orbit=orbit, highest=highest
    )
    averages = orders.order_averages(time, angle, signal, highest, time_blocks(time, nominal, orbit))
    summary = {
        "run": run,
        "spindle_rpm": (speed - orbit) * 60.0,
        "spindle_rpm_sd": deviation * 60.0,
        "steady_from_s": float(time[0]),
        "steady_to_s": float(time[-1]),
        "air_s": float(air.sum() / rate),
        **at,
        **{f"zero_{axis}_n": float(value) for axis, value in zip(AXES, zero, strict=True)},
        **{
            f"mean_{axis}_n": float(value)
            for axis, value in zip(AXES, _whole_mean(angle, signal), strict=True)
        },
    }
    return pd.concat(
        [_long(run, i, average) for i, average in enumerate(averages)], ignore_index=True
    ), summary


def spindle_angle(
    time: Array, signal: Array, tacho: Array, *, nominal: float, orbit: float, highest: int
) -> tuple[Array, float, float]:
    """Angle of the spindle against the feed, (n,) rad, its speed, rev/s, and the deviation of that.

    From the tacho's angle ``tacho`` (n,), degrees, where it is known, else the speed that gathers most of the
    signal at its orders up to the ``highest``; ``nominal`` and ``orbit`` in rev/s.
    """
    if np.isfinite(tacho).all():
        angle = np.unwrap(tacho * DEG) + 2.0 * math.pi * orbit * time
        return angle, *_tacho_speed(time, angle)
    speed, deviation = orders.spindle_speed(time, signal, nominal + orbit, highest)
    return 2.0 * math.pi * speed * time, speed, deviation


def _tacho_speed(time: Array, angle: Array) -> tuple[float, float]:
    """Speed of a tacho's angle, rev/s, and its deviation: either end may be off by what a reading is."""
    slope, start = np.polyfit(time, angle, 1)
    reading = float(np.sqrt(np.mean((angle - slope * time - start) ** 2)))
    turn = 2.0 * math.pi
    return float(slope) / turn, math.sqrt(2.0) * reading / (turn * float(time[-1] - time[0]))


def _zeroing(found: steady.Segments) -> np.ndarray:
    """Where to read the zero, (n,) bool: in the air before the cut, which no discharge of the cut has bent.

    Only where there is none, in the air after it.
    """
    before = found.air.copy()
    before[found.steady.start :] = False
    return before if before.any() else found.air


def time_blocks(time: Array, revolutions_per_s: float, orbit: float) -> int:
    """Return into how many time blocks to cut a record: what changes shows, each has enough revolutions.

    ``orbit``: rev/s of the orbit in helical milling.
    """
    revolutions = float(time[-1] - time[0]) * revolutions_per_s
    if orbit == 0.0:
        return min(TIME_BLOCKS, int(revolutions / REVOLUTIONS_PER_BLOCK))
    wanted = math.ceil(BLOCKS_PER_ORBIT * abs(orbit) * (time[-1] - time[0]))
    most: int = min(wanted, MOST_BLOCKS, int(revolutions / REVOLUTIONS_PER_ORBIT_BLOCK))
    return most


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


def orbit_rate(row: Any) -> float:
    """Orbit speed of a run, rad/s, positive counter-clockwise seen from +z; zero unless helical."""
    return float(row["orbit_rpm"]) * RPM if row["operation"] == "helical" else 0.0


def with_orbit(time: Array, signal: Array, orbit: float) -> Array:
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
