"""The helical cut on which printed cutting coefficients were checked, computed from them over one orbit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.force import COEFFICIENTS
from metro.cutting.helical import BOTTOM_EDGES, helical_signal
from metro.cutting.law import EdgeLaw
from metro.observables.cut import conditions as cutting_force
from metro.observables.force.blocks import helix
from metro.observables.problem import Refusal
from metro.units import N_MM, N_MM2, RPM, Array

COLUMNS = ["t_s", "fx_n", "fy_n", "fz_n"]
POINTS_PER_REVOLUTION = 120
SI = {"N/mm2": N_MM2, "N/mm": N_MM}
EDGE = ("kte", "kre", "kae")


def forces(batch: Batch, published: pd.DataFrame) -> pd.DataFrame:
    """Return the force on the tool over one orbit of the batch's first helical run, work frame.

    The chip is feed times sine of the immersion and the tool is rigid, as in the source of the coefficients.

    Returns
    -------
    ``t_s, fx_n, fy_n, fz_n``; no rows if the table does not hold all eight coefficients, the manifest does
    not describe the tool, or the batch has no helical run.
    """
    nothing = pd.DataFrame(columns=COLUMNS, dtype=float)
    tool, values = cutting_force.cutter(batch), printed_coefficients(published)
    if isinstance(tool, Refusal) or values is None or batch.runs.empty:
        return nothing
    helical = batch.runs.index[batch.runs["operation"] == "helical"]
    if helical.empty or cutting_force.unset(batch, str(helical[0])):
        return nothing
    row: Any = batch.runs.loc[helical[0]]
    path = helix(batch, row)
    if path is None:
        return nothing
    if arc_length(published):
        values = values / np.where(np.isin(COEFFICIENTS + BOTTOM_EDGES, EDGE), math.cos(tool.helix), 1.0)
    speed, orbit = row["spindle_rpm"] * RPM, row["orbit_rpm"] * RPM
    duration = 2.0 * math.pi / abs(orbit)
    time = np.arange(0.0, duration, 2.0 * math.pi / speed / POINTS_PER_REVOLUTION)
    cut = cutting_force.cut(batch, str(helical[0]), tool.radius)
    force = helical_signal(tool, EdgeLaw(), cut, path, values, speed=speed, orbit_speed=orbit, time=time)
    return pd.DataFrame(np.column_stack([time, force]), columns=COLUMNS)


def printed_coefficients(published: pd.DataFrame) -> Array | None:
    """Return the eight coefficients of a published table in SI, (8,); None if it lacks one of them."""
    rows = published[published["quantity"] == "cutting coefficient"]
    printed = {
        str(row).replace("_", "").lower(): float(value) * SI[str(unit)]
        for row, value, unit in zip(rows["row"], rows["measured"], rows["unit"], strict=True)
        if str(unit) in SI
    }
    names = COEFFICIENTS + BOTTOM_EDGES
    return np.array([printed[name] for name in names]) if set(names) <= set(printed) else None


def arc_length(published: pd.DataFrame) -> bool:
    """Whether the print counts the edge terms along the arc of the edge, 1/cos(helix) times its depth."""
    notes = published.loc[published["quantity"] == "cutting coefficient", "note"].fillna("").astype(str)
    return bool(notes.str.contains("arc length").any())
