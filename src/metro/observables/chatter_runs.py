"""Which cuts chattered, by their own records, and how rough the surface is that they left."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.force_orders import orbit_rate, spindle_angle, with_orbit
from metro.signals import orders, steady
from metro.signals.chatter import UNDECIDED, Detection, detect
from metro.signals.chatter_signs import at_a_robot_mode
from metro.surface.roughness import roughness
from metro.units import JSON, MM, UM

COLUMNS = (
    *("run", "rpm", "depth_mm", "probability", "chatter_hz", "chatter_sd_hz", "kind", "separable"),
    *("energy_ratio", "signs", "labelled", "ra_um", "rz_um", "note"),
)
LABELS = {"no": 1, "yes": 0}  # of the operator, in the column ``stable``: 1 is unstable
AXES = ["fx_n", "fy_n", "fz_n"]

Read = Callable[..., pd.DataFrame]


def observe_chatter(batch: Batch, read: Read, modes: pd.DataFrame) -> pd.DataFrame:
    """Look for chatter in every run with a dynamometer record, and measure every stylus trace.

    Returns
    -------
    DataFrame
        A row per run that has a depth and a record or a trace, columns :data:`COLUMNS`. ``probability`` is
        NaN, and ``note`` says why, where there is no answer; ``energy_ratio`` is the median over windows;
        ``labelled`` is the operator's judgement, 1 unstable, 0 stable, −1 none.
    """
    runs = batch.runs[(batch.runs["axial_depth_mm"] > 0) & (batch.runs["spindle_rpm"] > 0)]
    rows = [row for run in runs.index if (row := _observed(batch, str(run), read))]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    known = modes[modes["used"].astype(bool)]
    columns = [table["chatter_hz"], table["rpm"], known["frequency_hz"], known["damping"]]
    low = at_a_robot_mode(*(column.to_numpy(float) for column in columns))
    return table.assign(kind=table["kind"].mask(low, "low_frequency"))


def measured(chatter: pd.DataFrame) -> pd.DataFrame:
    """Return the runs, by name, whose record told whether they chattered; ``unstable`` 1 or 0."""
    told = chatter[chatter["probability"].notna() & (chatter["probability"] != UNDECIDED)].set_index("run")
    return told.assign(unstable=(told["probability"] > 0.5).astype(int))


def _observed(batch: Batch, run: str, read: Read) -> JSON:
    """Row of a run; empty where it has neither record nor trace."""
    row: Any = batch.runs.loc[run]
    files = {name: isinstance(row.get(name), str) and bool(row[name]) for name in ("dynamometer", "profile")}
    if not any(files.values()):
        return {}
    found, note = _detection(batch, run, read("force", run)) if files["dynamometer"] else (None, "")
    told: JSON = {"kind": "", "separable": None, "signs": ""}
    if found is not None:
        told = {name: getattr(found, name) for name in COLUMNS if hasattr(found, name)}
        told |= {"energy_ratio": float(np.median(found.energy_ratio)), "signs": ", ".join(found.signs)}
    rough = _roughness(read("profile", run)) if files["profile"] else {}
    return {
        "run": run,
        "rpm": float(row["spindle_rpm"]),
        "depth_mm": float(row["axial_depth_mm"]),
        "labelled": LABELS.get(str(row["stable"]), -1),
        **told,
        **rough,
        "note": note,
    }


def _detection(batch: Batch, run: str, record: pd.DataFrame) -> tuple[Detection | None, str]:
    """Return what the record of a run says, or why it says nothing."""
    row: Any = batch.runs.loc[run]
    time, signal = record["t_s"].to_numpy(float), record[AXES].to_numpy(float)
    rate, nominal = (len(time) - 1) / (time[-1] - time[0]), float(row["spindle_rpm"]) / 60.0
    teeth, orbit = int(batch.manifest["tool"]["teeth"]), orbit_rate(row) / (2.0 * math.pi)
    try:
        # a cut that is still entering may chatter already: no settling is left off but a turn
        cut = steady.segments(signal, rate / nominal, round(rate / nominal)).steady
        time, tacho = time[cut], record["spindle_deg"].to_numpy(float)[cut]
        signal = with_orbit(time, signal[cut], orbit)
        highest = orders.highest_order(rate, nominal, teeth)
        angle, _, _ = spindle_angle(time, signal, tacho, nominal=nominal, orbit=orbit, highest=highest)
        return detect(time, angle, signal, teeth), ""
    except ValueError as error:
        return None, str(error)


def _roughness(trace: pd.DataFrame) -> JSON:
    """Columns of the roughness; none where the trace is too short or too coarse for it."""
    try:
        found = roughness(*(trace[name].to_numpy(float) * MM for name in ("x_mm", "z_mm")))
    except ValueError:
        return {}
    return {"ra_um": found.ra / UM, "rz_um": found.rz / UM}
