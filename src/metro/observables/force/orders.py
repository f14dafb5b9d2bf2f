"""Dynamometer records as order averages: the part of a steady cut that repeats with every revolution."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.cutting.cutter import Cutter
from metro.observables.arm.give import give_of, giving_arm
from metro.observables.cut import conditions as cutting_force
from metro.observables.cut.long_record import LongRecord, Stretch
from metro.observables.force.coefficients import AXES
from metro.observables.force.held_out_give import PER_NEWTON
from metro.observables.problem import Refusal
from metro.signals import orders, steady
from metro.signals.slope import slope
from metro.signals.wander import followed
from metro.units import DEG, JSON, MM, RPM, Array

TIME_BLOCKS = 4
BLOCKS_PER_ORBIT = 8  # of helical runs: enough for changes up to twice per orbit
MOST_BLOCKS = 16
REVOLUTIONS_PER_BLOCK, REVOLUTIONS_PER_ORBIT_BLOCK = 16, 8


def observe(batch: Batch, read: Tables, _identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Turn dynamometer records into order averages: tables ``orders`` and ``spindle`` (speed of each run)."""
    runs = recorded(batch)
    if not runs:
        return Refusal("runs.csv names no dynamometer file")
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal):
        return tool
    arm = giving_arm(batch, read)
    results = [_observed(batch, run, read, tool) for run in runs]
    tables = [result for result in results if not isinstance(result, Refusal)]
    for _, row in tables:
        force = np.array([row[f"mean_{axis}_n"] for axis in AXES])
        give = give_of(batch, row["run"], read, arm, force)
        row["give_mm"] = float(give.per_newton @ force) / MM if np.isfinite(force).all() else 0.0
        row["give_sd_mm"] = give.sd / MM
        row |= dict(zip(PER_NEWTON, (give.per_newton / MM).tolist(), strict=True))
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


def _observed(batch: Batch, run: str, read: Tables, tool: Cutter) -> tuple[pd.DataFrame, JSON] | Refusal:
    """Order averages of a run's steady cut, and the run's row of the spindle table."""
    if blank := cutting_force.unset(batch, run):
        return Refusal(blank)
    record = LongRecord(read, run)
    row: Any = batch.runs.loc[run]
    nominal, settling = row["spindle_rpm"] / 60.0, _settling(batch, run, tool)
    turns = record.turns(record.rate / nominal)
    if not len(turns.mean):
        seconds = f"{record.end - record.start:.3g} s"
        return Refusal(
            f"run {run}: the record of {seconds} is shorter than a revolution at {60 * nominal:g} rpm"
        )
    try:
        segments = steady.segments(turns, round(record.rate * settling))
    except ValueError as error:
        return Refusal(f"run {run}: {error}")
    air = _zeroing(segments)
    zero = turns.mean[air].mean(axis=0) if air.any() else np.zeros(3)
    when = (np.flatnonzero(air).mean() + 0.5) * turns.length / record.rate if air.any() else 0.0
    orbit = orbit_rate(row) / (2.0 * math.pi)
    highest = orders.highest_order(record.rate, nominal, tool.teeth)
    parts = [
        _part(part, zero, (nominal, orbit), tool.teeth, highest) for part in record.stretches(segments.steady)
    ]
    first, last = parts[0], parts[-1]
    averages = _together(parts, time_blocks(first.time[0], last.time[1], nominal, orbit))
    rate, rate_sd = _slope(turns, segments.steady, record.rate, orbit)
    share = np.array([part.time[1] - part.time[0] for part in parts])
    share /= share.sum()
    mean = share @ np.array([part.mean for part in parts])
    deviation = math.sqrt(sum((w * part.deviation) ** 2 for w, part in zip(share, parts, strict=True)))
    summary = {
        "run": run,
        "spindle_rpm": (float(share @ [part.speed for part in parts]) - orbit) * 60.0,
        "spindle_rpm_sd": deviation * 60.0,
        "steady_from_s": first.time[0],
        "steady_to_s": last.time[1],
        "air_s": float(segments.quiet.sum() * turns.length / record.rate),
        "zero_at_s": record.start + when,
        "contact_s": first.time[0] - (0.5 * settling if segments.steady.start > 0 else 0.0),
        **{f"zero_{axis}_n": float(value) for axis, value in zip(AXES, zero, strict=True)},
        **{f"mean_{axis}_n": float(value) for axis, value in zip(AXES, mean, strict=True)},
        **{f"slope_{axis}_n_s": float(value) for axis, value in zip(AXES, rate, strict=True)},
        **{f"slope_{axis}_n_s_sd": float(value) for axis, value in zip(AXES, rate_sd, strict=True)},
    }
    return pd.concat(
        [_long(run, i, average) for i, average in enumerate(averages)], ignore_index=True
    ), summary


def _slope(turns: steady.Turns, cut: slice, rate: float, orbit: float) -> tuple[Array, Array]:
    """Slope of the means of revolutions along the steady cut, and its deviation, (3,) N/s.

    Not a number in helical milling, where the mean turns with the orbit.
    """
    if orbit:
        return np.full(3, math.nan), np.full(3, math.nan)
    whole = turns.mean[math.ceil(cut.start / turns.length) : cut.stop // turns.length]
    return slope(np.arange(len(whole)) * turns.length / rate, whole)


@dataclass(frozen=True, eq=False)
class _Part:
    """A stretch of the steady cut: its order averages, speed (rev/s) and mean force; ``time``: its ends, s.

    ``known``: whether a tacho measures its angle, so that its waveform is aligned with the other stretches.
    """

    time: tuple[float, float]
    averages: list[orders.OrderAverage]
    speed: float
    deviation: float
    mean: Array
    known: bool


def _part(part: Stretch, zero: Array, revolutions: tuple[float, float], teeth: int, highest: int) -> _Part:
    """Take the order averages of a stretch: as many blocks as if it were the whole cut.

    ``revolutions`` per second of the spindle, nominally, and of the orbit. Where no tacho measures the angle,
    a speed that wanders is followed in the signal.
    """
    nominal, orbit = revolutions
    signal = with_orbit(part.time, part.signal - zero, orbit)
    angle, speed, deviation = spindle_angle(
        part.time, signal, part.tacho, nominal=nominal, orbit=orbit, highest=highest
    )
    known = bool(np.isfinite(part.tacho).all())
    if not known:
        angle = followed(part.time, angle, signal, teeth)
    ends = float(part.time[0]), float(part.time[-1])
    averages = orders.order_averages(part.time, angle, signal, highest, time_blocks(*ends, nominal, orbit))
    return _Part(ends, averages, speed, deviation, _whole_mean(angle, signal), known)


def _together(parts: list[_Part], blocks: int) -> list[orders.OrderAverage]:
    """Return the averages of all stretches in as many blocks as the whole cut has, each of neighbours.

    Without a tacho every stretch has its own angle, and its waveform is aligned with that of the first.
    """
    if len(parts) == 1:
        return parts[0].averages
    first = parts[0].averages[0].value
    every = [
        replace(each, value=each.value if part.known else orders.aligned(each.value, first))
        for part in parts
        for each in part.averages
    ]
    count = min(max(1, blocks), len(every))
    return [
        orders.OrderAverage(
            np.mean([each.value for each in group], axis=0),
            np.mean([each.variance for each in group], axis=0) / len(group),
            float(np.mean([each.middle for each in group])),
        )
        for group in (
            every[a:b] for a, b in pairwise(np.linspace(0, len(every), count + 1).round().astype(int))
        )
    ]


def spindle_angle(
    time: Array, signal: Array, tacho: Array, *, nominal: float, orbit: float, highest: int
) -> tuple[Array, float, float]:
    """Angle of the spindle against the feed, (n,) rad, its speed, rev/s, and the deviation of that.

    The source is the tacho's angle ``tacho`` (n,), degrees, if it is known, else the speed that gathers most
    of the signal at its orders up to the ``highest``; ``nominal`` and ``orbit`` in rev/s.
    """
    if np.isfinite(tacho).all():
        angle = np.unwrap(tacho * DEG) + 2.0 * math.pi * orbit * time
        return angle, *_tacho_speed(time, angle)
    speed, deviation = orders.spindle_speed(time, signal, nominal + orbit, highest)
    return 2.0 * math.pi * speed * time, speed, deviation


def _tacho_speed(time: Array, angle: Array) -> tuple[float, float]:
    """Speed of a tacho's angle, rev/s, and its deviation, from the error of a reading at either end."""
    slope, start = np.polyfit(time, angle, 1)
    reading = float(np.sqrt(np.mean((angle - slope * time - start) ** 2)))
    turn = 2.0 * math.pi
    return float(slope) / turn, math.sqrt(2.0) * reading / (turn * float(time[-1] - time[0]))


def _zeroing(segments: steady.Segments) -> np.ndarray:
    """Revolutions to read the zero from: in the air before the cut, which has no discharge from the cut.

    The air after the cut is used only if there is none before it.
    """
    before = segments.quiet.copy()
    before[segments.steady.start // segments.turns.length :] = False
    return before if before.any() else segments.quiet


def time_blocks(start: float, end: float, revolutions_per_s: float, orbit: float) -> int:
    """Return the number of time blocks for a record from start to end, s.

    The blocks are short enough to show changes, and each has enough revolutions. ``orbit``: rev/s of the
    orbit in helical milling.
    """
    revolutions = (end - start) * revolutions_per_s
    if orbit == 0.0:
        return min(TIME_BLOCKS, int(revolutions / REVOLUTIONS_PER_BLOCK))
    wanted = math.ceil(BLOCKS_PER_ORBIT * abs(orbit) * (end - start))
    most: int = min(wanted, MOST_BLOCKS, int(revolutions / REVOLUTIONS_PER_ORBIT_BLOCK))
    return most


def _whole_mean(angle: Array, signal: Array) -> Array:
    """Mean force over whole revolutions, (3,) N; a last one that lacks less than 2 % counts as whole."""
    turned = angle - angle[0]
    whole = math.floor(turned[-1] / (2.0 * math.pi) * (1.0 + 1.0 / len(angle)) + 0.02)
    mean: Array = signal[turned < 2.0 * math.pi * whole].mean(axis=0)
    return mean


def _settling(batch: Batch, run: str, tool: Cutter) -> float:
    """Time from first contact to full engagement, s: one radius of travel, or one orbit of a helix."""
    row: Any = batch.runs.loc[run]
    if row["operation"] == "helical":
        return 60.0 / abs(float(row["orbit_rpm"]))
    return tool.radius / cutting_force.feed(batch, run)


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
