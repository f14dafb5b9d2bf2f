"""The recordings of a batch as parts of canonical tables, converted and checked, one file at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.arm import linear_axes, listed
from metro.batch.axes import signed_axes
from metro.batch.batch import Batch
from metro.batch.canonical import Part
from metro.dynamics.driving import turning
from metro.dynamics.hits import Hit, fault
from metro.joint_columns import Axes, axes_in, positions
from metro.signals import plausible, quality
from metro.signals.conversion import driving_point_sign, receptance, response_si, sensor_to_tool
from metro.signals.record_quality import RecordQuality
from metro.stages.reading import Recordings
from metro.units import Array

FORCES = ("fx_n", "fy_n", "fz_n")
POINT = ("x_mm", "y_mm", "z_mm")
ORIENTATION = (("rx_deg", "ry_deg", "rz_deg"), ("q1", "q2", "q3", "q4"))
PIECE = 1 << 19  # samples of a force record in memory at a time


def files(batch: Batch, column: str) -> Iterator[tuple[str, str]]:
    """Yield run and file of every run that names one in ``column`` of runs.csv."""
    for run, file in batch.runs[column].items():
        if file:
            yield str(run), str(file)


def force(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each dynamometer record as the force on the tool, work frame, time from the record's start.

    A record of more than ``PIECE`` samples is read twice, piece by piece: it is written once it is known to
    be fit for use.
    """
    sensor = batch.instrument("dynamometer")
    axes = signed_axes(sensor.get("axes") or {})
    to_tool = sensor_to_tool(axes, float(sensor.get("rotation_deg", 0.0)), sensor.get("reads", "work"))
    for run, file in files(batch, "dynamometer"):
        record = RecordQuality(("Fx", "Fy", "Fz"), sensor.get("range_n"))
        count, table = 0, pd.DataFrame()
        faults = len(recordings.problems)
        for table in recordings.pieces(file, "force", PIECE):
            if len(table):
                record.add(table["t_s"].to_numpy(), table[list(FORCES)].to_numpy())
                recordings.note_read(file, run, table)
                count += 1
        if len(recordings.problems) > faults or not _fit_force(batch, recordings, run, file, record):
            continue
        again = [table] if count == 1 else recordings.pieces(file, "force", PIECE, again=True)
        for some in again:
            tool = to_tool @ some[list(FORCES)].to_numpy().T
            part = {"run": run, "t_s": some["t_s"].to_numpy() - record.zero}
            part |= dict(zip(FORCES, tool, strict=True))
            yield part | ({"spindle_deg": some["spindle_deg"]} if "spindle_deg" in some else {})


def _fit_force(batch: Batch, recordings: Recordings, run: str, file: str, record: RecordQuality) -> bool:
    """Gather what there is to say of a force record; return whether it can be used."""
    rate = batch.instrument("dynamometer").get("rate_hz")
    recordings.zeros[run] = record.zero
    unit = plausible.clock_of(record.step, rate) or _force_unit(batch, run, record.largest)
    if recordings.doubt(file, unit):
        return False
    recordings.note(file, run, [starts_at(record.zero), *record.sampling(rate), *record.air_offset()])
    return recordings.fit(file, run, "dynamometer", record.channels())


def path(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each programmed path."""
    for run, file in files(batch, "path"):
        table = recordings.table(file, "path")
        if table is not None:
            size = (batch.manifest.get("work") or {}).get("size_mm")
            if size is not None:
                recordings.doubt(
                    file, plausible.tip_path(table[list(POINT)].to_numpy(), np.array(size, float))
                )
            recordings.paths[run] = np.asarray(np.ptp(table[["x_mm", "y_mm"]].to_numpy(), axis=0))
            yield {"run": run, **{str(name): table[name] for name in table}}


def profile(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each stylus trace."""
    for run, file in files(batch, "profile"):
        table = recordings.table(file, "profile")
        if table is not None:
            x, z = table["x_mm"].to_numpy(), table["z_mm"].to_numpy()
            cut = float(batch.runs["cut_length_mm"][run])
            recordings.doubt(file, plausible.trace(x, z, None if np.isnan(cut) else cut))
            recordings.note(file, run, [quality.sampling(x)[-1]])
            if recordings.fit(file, run, "profile", channels(("z",), z[:, None], None)):
                yield {"run": run, "x_mm": x, "z_mm": z}


def slopes(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield the readings of each level or autocollimator; without lines, all are of one."""
    for run, file in files(batch, "slopes"):
        table = recordings.table(file, "slopes")
        if table is None:
            continue
        feet = table[["x1_mm", "y1_mm", "x2_mm", "y2_mm"]].to_numpy()
        line = table["line"].to_numpy() if "line" in table else np.zeros(len(table), np.int64)
        if not recordings.doubt(file, plausible.slopes(feet, table["slope_urad"].to_numpy(), line)):
            yield {"run": run, **{str(name): table[name] for name in table}, "line": line}


def poses(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield the measured poses of each series, in the order in which they were taken."""
    for run, file in files(batch, "poses"):
        table = recordings.table(file, "poses")
        if table is None:
            continue
        measured = list(POINT) if set(POINT) <= set(table) else ["distance_mm"]
        wrong = (
            _joints_at_odds(batch, table)
            or _half_turned(table)
            or plausible.positions(table[measured].to_numpy(), ", ".join(measured))
        )
        if not recordings.doubt(file, wrong):
            recordings.note_read(file, run, table)
            yield {"run": run, **{str(name): table[name].astype(float) for name in table}}


def targets(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield the targets of each table of them, in the order in which they are approached.

    Joints are what is commanded: where a table has them, places of the tip beside them are left out.
    """
    for run, file in files(batch, "targets"):
        table = recordings.table(file, "targets")
        if table is None:
            continue
        joints = positions([str(name) for name in table])
        if not joints or not recordings.doubt(file, _joints_at_odds(batch, table)):
            yield {"run": run, **{str(name): table[name].astype(float) for name in joints or table}}


def _half_turned(table: pd.DataFrame) -> str:
    """Say that an orientation is not whole, or stated twice; "" where it is once or not at all."""
    stated = [[name for name in names if name in table] for names in ORIENTATION]
    whole = [len(own) == len(names) for own, names in zip(stated, ORIENTATION, strict=True)]
    if not any(stated) or (sum(whole) == 1 and sum(map(bool, stated)) == 1):
        return ""
    found = ", ".join(name for own in stated for name in own)
    return f"has {found}, expected an orientation once: rx_deg, ry_deg and rz_deg, or q1 to q4"


def _joints_at_odds(batch: Batch, table: pd.DataFrame) -> str:
    """Say that a table's joints are not those of the arm, or not in degrees; "" where they are."""
    arm, own = Axes(linear_axes(batch.cell)), axes_in([str(name) for name in table])
    if len(arm) and own != arm:
        return (
            f"has {listed(own.positions)}, expected {listed(arm.positions)}: one for each joint of the "
            "arm that moves"
        )
    turns = [name for name, linear in zip(own.positions, own.linear, strict=True) if not linear]
    return plausible.turns(turns, table[turns].to_numpy())


def hit(batch: Batch, impacts: pd.DataFrame, recordings: Recordings) -> Iterator[Part]:
    """Yield each hammer record, its response in SI."""
    rate = batch.instrument("hammer").get("rate_hz")
    for row in impacts[impacts["kind"] == "record"].to_dict("records"):
        file, unit = str(row["file"]), str(row["response_unit"])
        table = recordings.table(file, "record")
        if table is None or recordings.doubt(file, _unit_at_odds(table, unit)):
            continue
        time, zero = from_zero(table)
        recordings.note(file, "", [starts_at(zero), *quality.sampling(time, rate)])
        force_n = table["force_n"].to_numpy()
        if recordings.doubt(file, plausible.clock(time, rate) or plausible.hammer_force(force_n)):
            continue
        response = response_si(table["response"].to_numpy(), unit)
        blow = (row["test"], row["position"], row["reference"], row["replicate"])
        channels = (("force_n", force_n), ("response", table["response"].to_numpy()))
        if any(recordings.copied(file, name, values, blow) for name, values in channels):
            continue
        clean = _hit(Hit(force_n, response, 1.0 / float(np.mean(np.diff(time)))))
        recordings.note(file, "", [clean])
        recordings.usable |= {file} if clean.ok else set()
        for name, values in (("hammer force", force_n), ("response", response)):
            recordings.note(file, "", [quality.dead(name, values), quality.flat_tops(name, values)])
        si_unit = "m/s2" if unit == "g" else unit
        columns: Part = {"t_s": time, "force_n": table["force_n"], "response_si": response}
        yield {**_place(row), "response_unit": si_unit, **columns}


def _unit_at_odds(table: pd.DataFrame, unit: str) -> str:
    """Say that a record's own unit of the response is not that of impacts.csv; "" where they agree."""
    own = table.attrs.get("response_unit") or unit
    mismatch = f"column response: found the unit {own!r} in the file, expected {unit!r} as impacts.csv says"
    return "" if own == unit else f"{mismatch}: correct the one that is wrong"


def frf(impacts: pd.DataFrame, recordings: Recordings) -> Iterator[Part]:
    """Yield each FRF as a receptance; lines that have none (0 Hz of an integrated one) are left out.

    What the file says of its points and units goes before the row of impacts.csv; a row that names a pair
    takes that pair out of a file of many.
    """
    for row in impacts[impacts["kind"] != "record"].to_dict("records"):
        repeats: Counter[tuple[str, str]] = Counter()
        others: list[str] = []
        for one in recordings.frfs(str(row["file"])):
            pair = one.reference or str(row["reference"]), one.response or str(row["response"])
            if one.reference and not _asked(row, pair):
                others.append(f"{pair[0]} to {pair[1]}")
                continue
            repeats[pair] += 1
            place = _place(row) | {"reference": pair[0], "response": pair[1]}
            if repeats[pair] > 1:
                place["replicate"] = repeats[pair]
            unit = one.unit or str(row["response_unit"]) or "m"
            driving = pair[0] == pair[1]
            part = _receptance(str(row["file"]), one.table, unit, recordings, driving=driving)
            if part is not None:
                recordings.usable.add(str(row["file"]))
                yield place | part
        if others and not repeats:
            asked = f"{row['reference'] or 'any'} to {row['response'] or 'any'}"
            message = f"found FRFs of {', '.join(dict.fromkeys(others))}, expected {asked}"
            recordings.doubt(str(row["file"]), f"{message} as impacts.csv says")


def _asked(row: Mapping[Hashable, Any], pair: tuple[str, str]) -> bool:
    return all(row[name] in ("", point) for name, point in zip(("reference", "response"), pair, strict=True))


def _receptance(
    file: str, table: pd.DataFrame, unit: str, recordings: Recordings, *, driving: bool
) -> dict[str, np.ndarray | pd.Series | str | int] | None:
    """Columns of the canonical table of one FRF; None where it is not fit for use.

    The sign of its imaginary part is checked where it is a driving point's.
    """
    frequency = table["frequency_hz"].to_numpy()
    values = receptance(frequency, table["real"].to_numpy() + 1j * table["imag"].to_numpy(), unit)
    keep = np.isfinite(values)
    if recordings.doubt(file, plausible.frf(frequency[keep], values[keep])):
        return None
    typical, mass = plausible.softness(frequency[keep], values[keep])
    size = quality.light(mass, plausible.LIGHT_KG, soft=typical > plausible.RECEPTANCE)
    checks = [quality.dead("the FRF", np.abs(values[keep])), size]
    if driving:
        sign = driving_point_sign(frequency[keep], values[keep])
        checks.append(quality.conjugated(sign, turning(values[keep])))
    if not recordings.fit(file, "", "file", checks):
        return None
    coherence = {"coherence": table["coherence"].to_numpy()[keep]} if "coherence" in table else {}
    values = values[keep]
    return {"frequency_hz": frequency[keep], "real_m_n": values.real, "imag_m_n": values.imag, **coherence}


def _place(row: Mapping[Hashable, Any]) -> dict[str, np.ndarray | pd.Series | str | int]:
    texts = {name: str(row[name]) for name in ("test", "position", "reference", "response")}
    return {**texts, "replicate": 1 if np.isnan(row["replicate"]) else int(row["replicate"])}


def channels(names: tuple[str, ...], values: Array, full_scale: float | None) -> list[quality.Finding]:
    """Check channels (n, k): each moves, none is clipped, and no two are the same."""
    columns = list(zip(names, values.T, strict=True))
    checks = [
        check
        for name, v in columns
        for check in (quality.dead(name, v), quality.flat_tops(name, v, full_scale))
    ]
    return [*checks, quality.alike(names, values)]


def _force_unit(batch: Batch, run: str, largest: float) -> str:
    chip = float(batch.runs["axial_depth_mm"][run]) * float(batch.runs["feed_per_tooth_mm"][run])
    return plausible.cutting_force(largest, chip, batch.manifest["coefficients"].get("ktc_n_mm2"))


def _hit(hit: Hit) -> quality.Finding:
    reason = fault(hit)
    message = f"{reason}: the hit is left out; hit again" if reason else "one clean hit"
    return quality.Finding("hit", np.nan, np.nan, not reason, message)


def from_zero(table: pd.DataFrame) -> tuple[Array, float]:
    """Return the time from the record's start, and the time stamp at its start."""
    time = table["t_s"].to_numpy()
    return time - time[0], float(time[0])


def starts_at(zero: float) -> quality.Finding:
    """Note where on the file's clock a record starts."""
    message = f"t_s is counted from {zero:.6g} s of the file's clock"
    return quality.Finding("time zero", zero, np.nan, True, message)
