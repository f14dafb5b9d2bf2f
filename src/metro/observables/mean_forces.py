"""Mean force of each straight cut beside what the coefficients of the mean forces make of it ([T] §4.1)."""

from __future__ import annotations

from typing import cast

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables import force
from metro.observables.force_coefficients import AXES, mean_design
from metro.observables.force_model import ForceModel
from metro.observables.problem import Problem
from metro.units import JSON

SET = "mean_all_runs"


def mean_forces(batch: Batch, observed: dict[str, pd.DataFrame], identified: JSON) -> dict[str, pd.DataFrame]:
    """Return ``mean_forces``: ``run, axis, role, measured_n, fitted_n`` and the settings of the run.

    None where the means of all runs did not tell the coefficients.
    """
    told: JSON = (identified.get("force") or {}).get(SET) or {}
    task = force.problem(batch, observed, identified) if told and len(observed["orders"]) else None
    if not isinstance(task, Problem):
        return {}
    model = cast("ForceModel", task.base)
    beta = np.array([told[p.name]["value"] * p.si for p in model.parameters[:6]])
    means = observed["spindle"].set_index("run")[[f"mean_{axis}_n" for axis in AXES]]
    straight = [block for block in task.blocks if block.setting.helix is None]
    rows = [
        pd.DataFrame(
            {
                "run": block.run,
                "axis": AXES,
                "role": block.role,
                "measured_n": means.loc[block.run].to_numpy(float),
                "fitted_n": mean_design(model, block, true_path=False) @ beta,
            }
        )
        for block in straight
    ]
    settings = batch.runs.drop(columns="role")
    return {"mean_forces": pd.concat(rows, ignore_index=True).join(settings, on="run")} if rows else {}
