"""How far an arm gives way in held-out side cuts, as the identification runs predict it.

The radial depth of a side cut is the nominal one less what the arm gives way to the mean force. In the runs
of the identification this force is measured. The force of a held-out run is what is to be predicted: there,
force and give are solved for together, with coefficients of the identification runs.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.cutting.cutter import Cutter
from metro.cutting.force import mean_basis
from metro.cutting.law import EdgeLaw
from metro.observables.cut import conditions as cutting_force
from metro.observables.force.coefficients import AXES
from metro.units import MM, Array

PER_NEWTON = [f"give_{axis}_mm_n" for axis in AXES]
ITERATIONS = 8  # the give is a small part of the depth: each leaves about a tenth of the error


def with_predicted_give(batch: Batch, spindle: pd.DataFrame, tool: Cutter) -> pd.DataFrame:
    """Return the spindle table with ``give_mm`` of held-out runs as predicted; nothing of them is read.

    Parameters
    ----------
    spindle : of :func:`metro.observables.force.orders.observe`: by run its measured mean force, N, and the
        give per newton along x, y, z of the work, mm/N.
    """
    role = batch.runs["role"].reindex(spindle["run"]).to_numpy()
    straight = (batch.runs["operation"].reindex(spindle["run"]) != "helical").to_numpy()
    per_newton = spindle[PER_NEWTON].to_numpy(dtype=float)
    wanted = np.flatnonzero((role == "validate") & per_newton.any(axis=1))
    known = np.flatnonzero((role != "validate") & straight)
    if not len(wanted) or not len(known):
        return spindle
    runs, give = spindle["run"].astype(str).tolist(), spindle["give_mm"].to_numpy(dtype=float).copy()
    rows = np.concatenate([_basis(batch, runs[i], tool, give[i]) for i in known])
    mean = spindle[[f"mean_{axis}_n" for axis in AXES]].to_numpy(dtype=float)[known].ravel()
    size = np.linalg.norm(rows, axis=0)  # coefficients per area and per length differ by many powers of ten
    coefficients = np.linalg.lstsq(rows / size, mean, rcond=None)[0] / size
    for i in wanted:
        give[i] = 0.0
        for _ in range(ITERATIONS):
            give[i] = float(per_newton[i] @ _basis(batch, runs[i], tool, give[i]) @ coefficients)
    return spindle.assign(give_mm=give)


def _basis(batch: Batch, run: str, tool: Cutter, give_mm: float) -> Array:
    """Mean force on the tool per unit of each coefficient, (3, 6), work frame, of a cut with some give."""
    cut = cutting_force.cut(batch, run, tool.radius, give_mm * MM)
    return np.asarray(cutting_force.work_from_feed(batch, run) @ mean_basis(tool, EdgeLaw(), cut))
