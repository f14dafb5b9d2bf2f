"""Detection of chatter in the record of each cut, and the roughness of the surface that it left."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.cut.long_record import LongRecord
from metro.observables.force.orders import orbit_rate, spindle_angle, with_orbit
from metro.signals import orders, steady
from metro.signals.asynchronous import whole_spectrum
from metro.signals.chatter import UNDECIDED, Detection, detect
from metro.signals.chatter_signs import at_a_robot_mode
from metro.signals.wander import followed
from metro.surface.roughness import roughness
from metro.units import JSON, MM, UM, Array

COLUMNS = (
    *("run", "rpm", "depth_mm", "probability", "chatter_hz", "chatter_sd_hz", "kind", "separable"),
    *("energy_ratio", "signs", "labelled", "ra_um", "rz_um", "note"),
)
RECORD_COLUMNS = ("run", "part", "x", "value", "on_order")
TURNS_SHOWN = 12  # of a record, in its picture
LABELS = {"no": 1, "yes": 0}  # of the operator, in the column ``stable``: 1 is unstable


def observe_chatter(batch: Batch, read: Tables, modes: pd.DataFrame) -> pd.DataFrame:
    """Test every run with a dynamometer record for chatter, and measure the roughness of every trace.

    Returns
    -------
    DataFrame
        A row per run that has a depth and a record or a trace, columns :data:`COLUMNS`. Without a result
        ``probability`` is NaN, and ``note`` gives the reason. ``energy_ratio`` is the median over windows;
        ``labelled`` is the operator's judgement: 1 unstable, 0 stable, −1 none.
    """
    runs = batch.runs[(batch.runs["axial_depth_mm"] > 0) & (batch.runs["spindle_rpm"] > 0)]
    rows = [row for run in runs.index if (row := _observed(batch, str(run), read))]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    known = modes[modes["used"].astype(bool)]
    columns = [table["chatter_hz"], table["rpm"], known["frequency_hz"], known["damping"]]
    low = at_a_robot_mode(*(column.to_numpy(float) for column in columns))
    return table.assign(kind=table["kind"].mask(low, "low_frequency"))


def measured(chatter: pd.DataFrame) -> pd.DataFrame:
    """Return the runs, by name, whose record decides whether they chattered; ``unstable`` is 1 or 0."""
    decided = chatter[chatter["probability"].notna() & (chatter["probability"] != UNDECIDED)].set_index("run")
    return decided.assign(unstable=(decided["probability"] > 0.5).astype(int))


def _observed(batch: Batch, run: str, read: Tables) -> JSON:
    """Row of a run; empty if it has neither record nor trace."""
    row: Any = batch.runs.loc[run]
    files = {name: isinstance(row.get(name), str) and bool(row[name]) for name in ("dynamometer", "profile")}
    if not any(files.values()):
        return {}
    detection, note = _detection(batch, run, read) if files["dynamometer"] else (None, "")
    columns: JSON = {"kind": "", "separable": None, "signs": ""}
    if detection is not None:
        columns = {name: getattr(detection, name) for name in COLUMNS if hasattr(detection, name)}
        columns |= {
            "energy_ratio": float(np.median(detection.energy_ratio)),
            "signs": ", ".join(detection.signs),
        }
    rough = _roughness(read("profile", run)) if files["profile"] else {}
    return {
        "run": run,
        "rpm": float(row["spindle_rpm"]),
        "depth_mm": float(row["axial_depth_mm"]),
        "labelled": LABELS.get(str(row["stable"]), -1),
        **columns,
        **rough,
        "note": note,
    }


def _detection(batch: Batch, run: str, read: Tables) -> tuple[Detection | None, str]:
    """Return the detection in a run's record, of a long one in its worst stretch, or the reason for none."""
    teeth = (batch.manifest.get("tool") or {}).get("teeth")
    if not teeth:
        return None, "without tool.teeth in batch.yaml no frequency is known to be that of the teeth"
    try:
        detections = [_detected(cut, int(teeth)) for cut in _steady_cuts(batch, run, read)]
    except ValueError as error:
        return None, str(error)
    return max(detections, key=lambda one: one[0].probability)


def _detected(cut: _Cut, teeth: int) -> tuple[Detection, str]:
    detection = detect(cut.time, cut.angle, cut.signal, teeth)
    if detection.probability <= UNDECIDED or cut.known:
        return detection, ""
    wandering = detect(cut.time, followed(cut.time, cut.angle, cut.signal, teeth), cut.signal, teeth)
    if wandering.probability > UNDECIDED:
        return detection, ""
    # Chatter near an order and a wandering speed cannot be distinguished here.
    left_open = replace(
        detection,
        probability=UNDECIDED,
        chatter_hz=math.nan,
        chatter_sd_hz=math.nan,
        kind="unknown",
        separable=False,
    )
    return left_open, "without a tacho a speed that wanders would look the same"


@dataclass(frozen=True, eq=False)
class _Cut:
    """A stretch of a steady cut: ``time`` (n,) s, ``angle`` of the spindle (n,) rad, ``signal`` (n, 3) N.

    ``known``: whether a tacho measured the angle.
    """

    time: Array
    angle: Array
    signal: Array
    known: bool


def _steady_cuts(batch: Batch, run: str, read: Tables) -> Iterator[_Cut]:
    """Yield the steady cut of a run in stretches.

    Raises
    ------
    ValueError
        If there is none.
    """
    row: Any = batch.runs.loc[run]
    record = LongRecord(read, run)
    nominal = float(row["spindle_rpm"]) / 60.0
    teeth, orbit = int(batch.manifest["tool"]["teeth"]), orbit_rate(row) / (2.0 * math.pi)
    # A cut may chatter while it is still entering, so only one turn of settling is omitted.
    segments = steady.segments(record.turns(record.rate / nominal), round(record.rate / nominal))
    highest = orders.highest_order(record.rate, nominal, teeth)
    for part in record.stretches(segments.steady):
        signal = with_orbit(part.time, part.signal, orbit)
        angle, _, _ = spindle_angle(
            part.time, signal, part.tacho, nominal=nominal, orbit=orbit, highest=highest
        )
        yield _Cut(part.time, angle, signal, bool(np.isfinite(part.tacho).all()))


def observe_records(batch: Batch, read: Tables, chatter: pd.DataFrame) -> pd.DataFrame:
    """Return the spectrum and the last turns of a cut that chattered, and of a similar one that did not.

    They are the two that are nearest to each other in speed, and among those in depth.

    Returns
    -------
    DataFrame
        Columns :data:`RECORD_COLUMNS`: ``part`` is "spectrum" (``x`` in Hz, ``value`` the amplitude of a
        sine, all directions together, N) or "force" (``x`` in s, ``value`` the strongest direction less its
        mean, N); ``on_order`` whether a line of the spectrum cannot be distinguished from an order.
    """
    decided = measured(chatter)
    unstable, stable = (decided[decided["unstable"] == kind] for kind in (1, 0))
    runs = [str(run) for run in (*unstable.index[:1], *stable.index[:1])]
    if len(runs) == 2:
        pairs = unstable.reset_index().merge(stable.reset_index(), how="cross", suffixes=("", "_stable"))
        apart = {
            name: np.abs(np.log(pairs[name].to_numpy(float) / pairs[f"{name}_stable"].to_numpy(float)))
            for name in ("rpm", "depth_mm")
        }
        nearest = pairs.assign(**apart).sort_values(["rpm", "depth_mm"], kind="stable").iloc[0]
        runs = [str(nearest["run"]), str(nearest["run_stable"])]
    parts = [_record(batch, run, read) for run in runs]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(RECORD_COLUMNS))


def _record(batch: Batch, run: str, read: Tables) -> pd.DataFrame:
    """Spectrum and last turns of the steady cut of one run; a long cut is represented by its last stretch."""
    (cut,) = deque(_steady_cuts(batch, run, read), maxlen=1)
    frequency, amplitude, on_order = whole_spectrum(cut.time, cut.angle, cut.signal)
    few = cut.angle > cut.angle[-1] - 2.0 * math.pi * TURNS_SHOWN
    centred = cut.signal - cut.signal.mean(axis=0)
    trace = centred[few, int(np.argmax(centred.std(axis=0)))]
    parts = [
        {"part": "spectrum", "x": frequency, "value": amplitude, "on_order": on_order},
        {"part": "force", "x": cut.time[few], "value": trace, "on_order": False},
    ]
    table = pd.concat([pd.DataFrame(part) for part in parts], ignore_index=True)
    return table.assign(run=run)[list(RECORD_COLUMNS)]


def _roughness(trace: pd.DataFrame) -> JSON:
    """Columns of the roughness; none if the trace is too short or too coarse for it."""
    try:
        rough = roughness(*(trace[name].to_numpy(float) * MM for name in ("x_mm", "z_mm")))
    except ValueError:
        return {}
    return {"ra_um": rough.ra / UM, "rz_um": rough.rz / UM}
