"""The model of a finished batch in memory: base model and effects of the verdict, fitted again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.findings import ContractError, Finding
from metro.batch.processed import Processed, read_batch, read_json
from metro.batch.provenance import made_by
from metro.effects.effect import Effect, fitted_to
from metro.effects.library import library
from metro.loop.checks.floor import ABOVE, against_floor
from metro.loop.checks.left_out import scored_unseen, unseen
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.noise import first_noise
from metro.observables.force import NAME, TABLES
from metro.observables.poses.calibrated_arm import with_calibrated_arm
from metro.observables.problem import Block, Problem
from metro.stages.problem_file import FILE, Posed, read_problems
from metro.units import JSON, Array

NEEDED = "identified.json", "verdict.json"  # of the results of a batch


@dataclass(frozen=True, eq=False)
class ForceModel:
    """What predicts the cutting force of a run that is not there yet.

    Attributes
    ----------
    problem : the batch's own runs, and its base model.
    fitted : base model and effects on the identification runs.
    scale : factor on the declared noise by which runs that no fit has seen differed from their prediction.
    """

    problem: Problem
    fitted: Fit
    scale: float


@dataclass(frozen=True, eq=False)
class Finished:
    """A batch that has been through the pipeline.

    Attributes
    ----------
    batch : as it was run. processed : folder of its tables. identified : content of identified.json.
    force : the model of its cutting force. lacking : why there is none, in words; "" where there is.
    """

    batch: Batch
    processed: Path
    identified: JSON
    force: ForceModel | None
    lacking: str

    @cached_property
    def observed(self) -> Mapping[str, pd.DataFrame]:
        """The observed tables of the cutting force that the batch has."""
        tables = {name: pd.read_parquet(self.processed / f"{name}.parquet") for name in TABLES}
        return {name: table for name, table in tables.items() if len(table.columns)}

    @cached_property
    def sources(self) -> Mapping[str, str]:
        """SHA-256 of the files that its tables were made from, by name."""
        import pyarrow.parquet as pq

        metadata = pq.read_schema(self.processed / "runs.parquet").metadata or {}
        sources: dict[str, str] = json.loads(metadata.get(b"metro.sources", b"{}"))
        return sources

    @property
    def read(self) -> Processed:
        """The canonical tables."""
        return Processed(self.processed)


def finished(name: str, processed: Path, reports: Path) -> Finished:
    """Load the results of a batch, and fit its force model with the effects that its verdict names.

    Parameters
    ----------
    processed, reports : the folders of this batch.

    Raises
    ------
    ContractError
        The pipeline has not been through the batch.
    """
    needed = [processed / "batch.json", processed / FILE, *(reports / file for file in NEEDED)]
    for file in needed:
        if not file.is_file():
            message = f"is not there: the batch has no results to compare with; call: metro run {name}"
            raise ContractError([Finding("error", str(file), message)])
    verdict, identified = read_json(reports / "verdict.json"), read_json(reports / "identified.json")
    batch = with_calibrated_arm(read_batch(processed), read_json(processed / "identified.json"))
    posed = read_problems(processed).get(NAME)
    lacking = _lacking(posed)
    force = None
    if posed and not lacking:
        entry = (verdict.get("observables") or {}).get(NAME) or {}
        budget = made_by(processed, "identify")["settings"]["model_form_budget"]
        force = force_model(posed, entry, budget)
    return Finished(batch, processed, identified, force, lacking)


def _lacking(posed: Posed | None) -> str:
    """Say why a batch has no model of the cutting force; "" where it has one."""
    if posed is None:
        return "the batch has no cutting force"
    if isinstance(posed.task, Problem):
        return "" if posed.base else "no run of the batch identifies its force model"
    return str(getattr(posed.task, "reason", "its force is not compared with samples"))


def force_model(posed: Posed, entry: JSON, budget: float) -> ForceModel:
    """Return the force model with the effects of a verdict, and how far unseen runs were from it.

    Parameters
    ----------
    entry : of the force in verdict.json; empty without a verdict. budget : the model-form budget.
    """
    problem, base = posed.task, posed.base
    if not isinstance(problem, Problem) or base is None:
        raise TypeError("no fitted force model")
    prior = first_noise(budget, problem.scatter, base.blocks)
    fitted = with_effects(problem, base, entry.get("effects") or [], budget)
    known = against_floor(unseen(fitted, prior))
    scale = known.scale if known else 1.0
    # A model that is known to miss something misses it in the next run, too: that is no news.
    conditions: dict[str, list[Block]] = {}
    for block in problem.role("validate"):
        conditions.setdefault(block.condition, []).append(block)
    held_out = against_floor([scored_unseen(fitted, blocks) for blocks in conditions.values()], scale)
    beyond = [each.ratio for each in (known, held_out) if each and each.p_value < ABOVE]
    return ForceModel(problem, fitted, scale * max(1.0, *beyond, 1.0))


def with_effects(problem: Problem, base: Fit, effects: list[JSON], budget: float) -> Fit:
    """Return the fit with the effects of a verdict, from the values that it states on.

    An effect that the library no longer has, or of which a parameter was not determined, is left out.
    """
    stated = [pair for each in effects for pair in _stated(problem, each)]
    if not stated:
        return base
    candidate = Candidate(base.candidate.base, tuple(effect for effect, _ in stated))
    theta = np.concatenate([values for _, values in stated])
    # The noise of the base fit holds what the effects explain: that is begun anew, too.
    prior = first_noise(budget, problem.scatter, base.blocks)
    return fit(candidate, base.blocks, prior, replace(base, candidate=candidate, theta=theta, noise=prior))


def _stated(problem: Problem, entry: JSON) -> list[tuple[Effect, Array]]:
    """Return an effect of a verdict in the form that the batch has, and the values of its search."""
    given = entry.get("parameters") or {}
    forms = tuple(each for each in library(problem.observable) if each.name == entry["effect"])
    for effect in fitted_to(forms, problem)[0]:
        named = set(given) == {*effect.names, *effect.where}
        if named and all(given[key] == value for key, value in effect.where.items()):
            values = np.array([_value(part) for name in effect.names for part in _parts(given[name])])
            if len(values) == len(effect.reported) and np.isfinite(values).all():
                return [(effect, np.linalg.lstsq(effect.matrix, values, rcond=None)[0])]
    return []


def _parts(parameter: Any) -> list[Any]:
    return parameter if isinstance(parameter, list) else [parameter]


def _value(quantity: JSON) -> float:
    value = quantity.get("value")
    return float("nan") if value is None else float(value)
