"""How the stages pose problems, and how what is identified is put together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.effects.library import not_modelled, with_declared
from metro.observables.labelled import Labelled
from metro.observables.observable import Observable
from metro.observables.problem import Problem, Refusal
from metro.observables.task import Task
from metro.units import JSON


@dataclass(frozen=True)
class _Declared:
    """Handler: the base model with what the manifest declares as known."""

    known: Mapping[str, Mapping[str, Any]]

    def sampled(self, problem: Problem) -> Task:
        if fault := without_weight(problem):
            return Refusal(fault)
        return with_declared(problem, self.known) if self.known else problem

    def labelled(self, problem: Labelled) -> Task:
        return problem.with_notes(not_modelled(problem.observable, self.known))

    def refused(self, refusal: Refusal) -> Task:
        return refusal


def pose(
    observable: Observable[Any], batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON
) -> Task:
    """Pose the problem of an observable, its base model with what the manifest declares as known."""
    task: Task = observable.problem(batch, observed, identified)
    return task.handled_by(_Declared(batch.manifest.get("known") or {}))


def without_weight(problem: Problem) -> str:
    """Say which run has an element that no fit can weigh; "" where there is none.

    A standard error that is not finite, or whose square is not, would end a fit far from where it was made.
    """
    for block in problem.blocks:
        with np.errstate(over="ignore", divide="ignore"):
            weight = 1.0 / block.sigma**2
        usable = np.isfinite(block.measured) & np.isfinite(weight) & (weight > 0.0)
        if not usable.all():
            where = int(np.argmin(usable))
            count = f"{len(usable) - int(usable.sum())} of {len(usable)} values"
            return (
                f"run {block.run}: {block.axis[where]} is {block.measured[where]:.3g} (SI) with a standard "
                f"error of {block.sigma[where]:.3g}: {count} cannot be compared with a model"
            )
    return ""


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
