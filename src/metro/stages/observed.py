"""What identify, predict and loop share: the observables in their order, and what identify wrote."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.layout import OBSERVED
from metro.effects import told_of, untold
from metro.observables import deformation, flatness, force, joint_force, lobes, published, waviness
from metro.observables.lobes import LabelProblem
from metro.observables.problem import Problem, Refusal
from metro.units import JSON

# Force first: the others may need its coefficients.
MODULES: tuple[ModuleType, ...] = (force, joint_force, deformation, waviness, flatness, lobes)
# Those whose observed tables depend on the cutting coefficients.
OBSERVED_WITH_COEFFICIENTS: tuple[ModuleType, ...] = (deformation, waviness, lobes)

Task = Problem | LabelProblem | Refusal


def read_observed(processed: Path) -> dict[str, pd.DataFrame]:
    """Read the observed tables that the batch has."""
    tables = {name: pd.read_parquet(processed / f"{name}.parquet") for name in OBSERVED}
    return {name: table for name, table in tables.items() if len(table.columns)}


def read_json(path: Path) -> JSON:
    """Read a JSON file that a stage wrote."""
    content: JSON = json.loads(path.read_text(encoding="utf-8"))
    return content


def problems(batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON) -> dict[str, Task]:
    """Return the problem of each observable, or why the batch has none."""
    if "published_errors" in observed:
        return {task.observable: task for task in published.problems(batch, observed, identified)}
    return {module.OBSERVABLE: task_of(module, batch, observed, identified) for module in MODULES}


def task_of(module: ModuleType, batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON) -> Task:
    """Return the problem of an observable, its base model told of what the manifest declares as known."""
    task: Task = module.problem(batch, observed, identified)
    known = batch.manifest.get("known") or {}
    if isinstance(task, LabelProblem):
        return replace(task, notes=(*task.notes, *untold(task.observable, known)))
    return told_of(task, known) if known and isinstance(task, Problem) else task


def merged(identified: JSON, blocks: JSON) -> JSON:
    """Return identified.json's content with an observable's blocks put in, block by block."""
    result = dict(identified)
    for name, block in blocks.items():
        known = result.get(name)
        if not (isinstance(block, dict) and isinstance(known, dict)):
            result[name] = block
            continue
        lacking = {**known.get("not_identified", {}), **block.get("not_identified", {})}
        result[name] = {**known, **block} | ({"not_identified": lacking} if lacking else {})
    return result
