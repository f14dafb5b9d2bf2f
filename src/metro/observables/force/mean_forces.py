"""Mean force of each straight cut, measured and from the coefficients of the mean forces ([T] §4.1)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.force.coefficients import AXES, mean_design
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem
from metro.observables.task import Task
from metro.units import JSON

SET = "mean_all_runs"


def mean_forces(
    batch: Batch, spindle: pd.DataFrame, identified: JSON, task: Task | None
) -> dict[str, pd.DataFrame]:
    """Return ``mean_forces``: ``run, axis, role, measured_n, fitted_n`` and the settings of the run.

    None where the coefficients could not be identified from the means of all runs.

    Parameters
    ----------
    spindle : the observed table of that name. task : that of the cutting force, where the batch has one.
    """
    coefficients: JSON = (identified.get("force") or {}).get(SET) or {}
    if not isinstance(task, Problem) or not coefficients or not isinstance(task.base, ForceModel):
        return {}
    model = task.base
    beta = np.array([coefficients[p.name]["value"] * p.si for p in model.parameters[:6]])
    means = spindle.set_index("run")[[f"mean_{axis}_n" for axis in AXES]]
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
