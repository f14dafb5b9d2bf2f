"""The robot logs of cuts and idle runs as parts of a canonical table, converted and checked."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from metro.batch.arm import linear_axes, listed
from metro.batch.batch import Batch
from metro.batch.canonical import Part
from metro.joint_columns import Axes, axes_of
from metro.robot.drives import drives_of_cell
from metro.signals import plausible, quality
from metro.stages.reading import Recordings
from metro.stages.recordings import channels, files, from_zero, starts_at
from metro.units import MS, Array

NO_SET_POINTS = quality.Finding(
    "set-points",
    np.nan,
    np.nan,
    True,
    "the log has no set-points: the path is that of the measured angles, how the arm follows is not known",
)


def robot(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each robot log: ``cut`` on the clock of the run's dynamometer, where there is one, and ``idle``.

    The offset of the two clocks of a cut is something to be found: the cut's log keeps it.
    """
    period_ms = batch.instrument("robot_log").get("period_ms")
    rate = None if period_ms is None else 1.0 / (period_ms * MS)
    places: dict[str, Array] = {}
    for column, log in (("robot_log", "cut"), ("idle_log", "idle")):
        for run, file in files(batch, column):
            free = batch.runs["joint_log"][run] == file  # which need not have all that the log of a cut has
            if free and not recordings.holds(file, "robot"):
                recordings.left_out.append((run, column))
                continue
            table = recordings.table(file, "robot")
            if table is None:
                continue
            time, own = from_zero(table)
            axes = axes_of(table)
            followed = axes.commanded[0] in table
            goes = table[axes.commanded if followed else axes.positions].to_numpy()
            lacking = _with_torques(batch, table, axes)
            if free and lacking:
                recordings.left_out.append((run, column))
                continue
            doubt = plausible.clock(time, rate) or joint_doubt(batch, table) or lacking
            if log == "idle" and run in places:
                doubt = doubt or plausible.same_place(places[run], goes)
            if recordings.doubt(file, doubt):
                continue
            places |= {run: goes} if log == "cut" else {}
            zero = recordings.zeros.get(run, own) if log == "cut" else own
            recordings.note(file, run, [starts_at(zero), *quality.sampling(time, rate)])
            recordings.note_read(file, run, table)
            recordings.note(file, run, [] if followed else [NO_SET_POINTS])
            torques = table[axes.torques].to_numpy()
            checks = [quality.motion(goes), *channels(tuple(axes.torques), torques, None)]
            if not recordings.fit(file, run, column, checks):
                continue
            names = [*axes.commanded, *axes.positions, *axes.torques]
            angles = {name: table[name] for name in names if name in table}
            yield {"run": run, "log": log, "t_s": time + (own - zero), **angles}


def joint_doubt(batch: Batch, table: pd.DataFrame) -> str:
    """Check that a log's angles are degrees and follow their set-points, and that the axes are the arm's."""
    axes = axes_of(table)
    turning = [(axes.commanded[k], axes.positions[k]) for k in axes.turning]
    names = [name for pair in turning for name in pair if name in table]
    doubt = plausible.angles(names, table[names].to_numpy()) if names else ""
    pairs = [pair for pair in turning if pair[0] in table]
    if not doubt and pairs:
        commanded, actual = (table[list(each)].to_numpy() for each in zip(*pairs, strict=True))
        doubt = plausible.following(commanded, actual)
    linear = linear_axes(batch.cell)
    if not doubt and linear and axes.linear != linear:
        expected = f"expected {listed(Axes(linear).positions)} as the arm of the cell has"
        doubt = f"has the positions of {len(axes)} axes, {listed(axes.positions)}, {expected}"
    return doubt


def _with_torques(batch: Batch, table: pd.DataFrame, axes: Axes) -> str:
    """Add the torques of a log of currents, by the constants of the cell; say what is missing for that."""
    if all(name in table for name in axes.torques):
        return ""
    constant = drives_of_cell(batch.cell, len(axes)).constant
    if not np.isfinite(constant[axes.turning]).all():
        fault = "has currents (current1_a …) and no torques (tau1_nm …)"
        return f"{fault}, expected drives.torque_per_ampere_nm_a in the cell, to turn them into torques"
    for place, name in zip(axes.turning, axes.torques, strict=True):
        if name not in table:
            table[name] = table[f"current{place + 1}_a"] * constant[place]
    return ""
