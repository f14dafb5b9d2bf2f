"""The recordings of a batch as parts of canonical tables, converted and checked, one file at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.canonical import Part
from metro.batch.findings import Finding as Problem
from metro.batch.manifest import signed_axes
from metro.formats import FormatError
from metro.formats.registry import ReadFrf, read, read_frfs
from metro.signals import quality
from metro.signals.conversion import driving_point_sign, moved, receptance, response_si, sensor_to_tool
from metro.units import MS, Array

FORCES = ("fx_n", "fy_n", "fz_n")
POINT = ("x_mm", "y_mm", "z_mm")
TORQUES = tuple(f"tau{i}_nm" for i in range(1, 7))

# A cloud this much smaller than the work is in metres: a factor of 1000, and room for a scan of a small part.
METRES = 0.005


@dataclass
class Recordings:
    """Reads the files of a batch folder, and gathers what is wrong with them and how good they are.

    Attributes
    ----------
    advance : called when a file has been read.
    problems : files that could not be read; they give no part.
    findings : rows of the quality table.
    zeros : run → the dynamometer's first time stamp, s: the zero of all clocks of that run.
    """

    folder: Path
    advance: Callable[[], None]
    problems: list[Problem] = field(default_factory=list)
    findings: list[dict[str, object]] = field(default_factory=list)
    zeros: dict[str, float] = field(default_factory=dict)

    def table(self, file: str, kind: str) -> pd.DataFrame | None:
        """Read a file; None, and a problem gathered, where that is impossible."""
        try:
            return read(self.folder / file, kind)
        except FormatError as error:
            self.problems.append(Problem("error", file, error.message))
            return None
        finally:
            self.advance()

    def frfs(self, file: str) -> list[ReadFrf]:
        """Read every FRF of a file; none, and a problem gathered, where that is impossible."""
        try:
            return read_frfs(self.folder / file)
        except FormatError as error:
            self.problems.append(Problem("error", file, error.message))
            return []
        finally:
            self.advance()

    def note(self, file: str, run: str, findings: list[quality.Finding]) -> None:
        """Add findings on a file to the quality table."""
        self.findings += [{"file": file, "run": run, **finding._asdict()} for finding in findings]


def files(batch: Batch, column: str) -> Iterator[tuple[str, str]]:
    """Yield run and file of every run that names one in ``column`` of runs.csv."""
    for run, file in batch.runs[column].items():
        if file:
            yield str(run), str(file)


def force(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each dynamometer record as the force on the tool, work frame, time from the record's start."""
    sensor = batch.instrument("dynamometer")
    axes = signed_axes(sensor.get("axes") or {})
    to_tool = sensor_to_tool(axes, float(sensor.get("rotation_deg", 0.0)), sensor.get("reads", "work"))
    for run, file in files(batch, "dynamometer"):
        table = recordings.table(file, "force")
        if table is None:
            continue
        time, zero = _from_zero(table)
        recordings.zeros[run] = zero
        readings = table[list(FORCES)].to_numpy()
        names = ("Fx", "Fy", "Fz")
        recordings.note(file, run, [_starts_at(zero), *quality.sampling(time, sensor.get("rate_hz"))])
        for name, values in zip(names, readings.T, strict=True):
            checks = [quality.dead(name, values), quality.flat_tops(name, values, sensor.get("range_n"))]
            recordings.note(file, run, checks)
        recordings.note(file, run, quality.air_offset(names, readings))
        part = {"run": run, "t_s": time, **dict(zip(FORCES, to_tool @ readings.T, strict=True))}
        yield part | ({"spindle_deg": table["spindle_deg"]} if "spindle_deg" in table else {})


def robot(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each robot log: ``cut`` on the clock of the run's dynamometer, where there is one, and ``idle``.

    The offset of the two clocks of a cut is something to be found: the cut's log keeps it.
    """
    period_ms = batch.instrument("robot_log").get("period_ms")
    rate = None if period_ms is None else 1.0 / (period_ms * MS)
    for column, log in (("robot_log", "cut"), ("idle_log", "idle")):
        for run, file in files(batch, column):
            table = recordings.table(file, "robot")
            if table is None:
                continue
            time, own = _from_zero(table)
            zero = recordings.zeros.get(run, own) if log == "cut" else own
            recordings.note(file, run, [_starts_at(zero), *quality.sampling(time, rate)])
            recordings.note(file, run, [quality.Finding(*found) for found in table.attrs.get("notes", ())])
            recordings.note(file, run, [quality.dead(name, table[name].to_numpy()) for name in TORQUES])
            angles = {str(name): table[name] for name in table.columns.drop("t_s")}
            yield {"run": run, "log": log, "t_s": time + (own - zero), **angles}


def path(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each programmed path."""
    for run, file in files(batch, "path"):
        table = recordings.table(file, "path")
        if table is not None:
            yield {"run": run, **{str(name): table[name] for name in table}}


def profile(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each stylus trace."""
    for run, file in files(batch, "profile"):
        table = recordings.table(file, "profile")
        if table is not None:
            recordings.note(file, run, [quality.dead("z", table["z_mm"].to_numpy())])
            yield {"run": run, "x_mm": table["x_mm"], "z_mm": table["z_mm"]}


def scan(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each point cloud, in the work frame where ``to_work`` is known."""
    to_work = batch.instrument("scanner").get("to_work")
    size_mm = (batch.manifest.get("work") or {}).get("size_mm")
    for run, file in files(batch, "scan"):
        table = recordings.table(file, "cloud")
        if table is None:
            continue
        problem = _in_metres(table, size_mm)
        if problem:
            recordings.problems.append(Problem("error", file, problem))
            continue
        recordings.note(file, run, [quality.missing_points(table.attrs["dropped"], len(table))])
        columns = [table[name].to_numpy() for name in POINT]
        if to_work is not None:
            columns = list(moved(np.column_stack(columns), np.array(to_work, float)).T)
        yield {"run": run, **dict(zip(POINT, columns, strict=True))}


def hit(batch: Batch, impacts: pd.DataFrame, recordings: Recordings) -> Iterator[Part]:
    """Yield each hammer record, its response in SI."""
    rate = batch.instrument("hammer").get("rate_hz")
    for row in impacts[impacts["kind"] == "record"].to_dict("records"):
        file, unit = str(row["file"]), str(row["response_unit"])
        table = recordings.table(file, "record")
        if table is None:
            continue
        time, zero = _from_zero(table)
        recordings.note(file, "", [_starts_at(zero), *quality.sampling(time, rate)])
        response = response_si(table["response"].to_numpy(), unit)
        for name, values in (("hammer force", table["force_n"].to_numpy()), ("response", response)):
            recordings.note(file, "", [quality.dead(name, values), quality.flat_tops(name, values)])
        si_unit = "m/s2" if unit == "g" else unit
        columns: Part = {"t_s": time, "force_n": table["force_n"], "response_si": response}
        yield {**_place(row), "response_unit": si_unit, **columns}


def frf(impacts: pd.DataFrame, recordings: Recordings) -> Iterator[Part]:
    """Yield each FRF as a receptance; lines that have none (0 Hz of an integrated one) are left out.

    What the file says of its points and units goes before the row of impacts.csv; a row that names a pair
    takes that pair out of a file of many.
    """
    for row in impacts[impacts["kind"] != "record"].to_dict("records"):
        repeats: Counter[tuple[str, str]] = Counter()
        for one in recordings.frfs(str(row["file"])):
            pair = one.reference or str(row["reference"]), one.response or str(row["response"])
            if one.reference and not _asked(row, pair):
                continue
            repeats[pair] += 1
            place = _place(row) | {"reference": pair[0], "response": pair[1]}
            if repeats[pair] > 1:
                place["replicate"] = repeats[pair]
            unit = one.unit or str(row["response_unit"]) or "m"
            driving = pair[0] == pair[1]
            yield place | _receptance(str(row["file"]), one.table, unit, recordings, driving=driving)


def _asked(row: Mapping[Hashable, Any], pair: tuple[str, str]) -> bool:
    return all(row[name] in ("", point) for name, point in zip(("reference", "response"), pair, strict=True))


def _receptance(
    file: str, table: pd.DataFrame, unit: str, recordings: Recordings, *, driving: bool
) -> dict[str, np.ndarray | pd.Series | str | int]:
    """Columns of the canonical table of one FRF; its convention is noted where it is a driving point's."""
    frequency = table["frequency_hz"].to_numpy()
    values = receptance(frequency, table["real"].to_numpy() + 1j * table["imag"].to_numpy(), unit)
    keep = np.isfinite(values)
    if driving:
        sign = driving_point_sign(frequency[keep], values[keep])
        recordings.note(file, "", [quality.conjugated(sign)])
    coherence = {"coherence": table["coherence"].to_numpy()[keep]} if "coherence" in table else {}
    values = values[keep]
    return {"frequency_hz": frequency[keep], "real_m_n": values.real, "imag_m_n": values.imag, **coherence}


def _place(row: Mapping[Hashable, Any]) -> dict[str, np.ndarray | pd.Series | str | int]:
    texts = {name: str(row[name]) for name in ("test", "position", "reference", "response")}
    return {**texts, "replicate": 1 if np.isnan(row["replicate"]) else int(row["replicate"])}


def _from_zero(table: pd.DataFrame) -> tuple[Array, float]:
    """Return the time from the record's start, and the time stamp at its start."""
    time = table["t_s"].to_numpy()
    return time - time[0], float(time[0])


def _starts_at(zero: float) -> quality.Finding:
    message = f"t_s is counted from {zero:.6g} s of the file's clock"
    return quality.Finding("time zero", zero, np.nan, True, message)


def _in_metres(table: pd.DataFrame, size_mm: list[float] | None) -> str:
    """Say so where a cloud's extent is that of the work in metres."""
    extent = max(float(np.ptp(table[name].to_numpy())) for name in POINT)
    if size_mm is None or extent >= METRES * max(size_mm):
        return ""
    found = f"the points span {extent:.4g}, the work is {max(size_mm):g} mm long"
    return f"{found}: coordinates seem to be in metres, expected millimetres"
