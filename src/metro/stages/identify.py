"""Identify: raw tables become compact observed tables, and those the base models with their intervals."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from metro import __version__
from metro.batch.batch import Batch
from metro.batch.layout import OBSERVED
from metro.batch.processed import Processed, read_batch, write_json, write_table
from metro.loop.candidate import Candidate
from metro.loop.fit import fit
from metro.loop.noise import first_noise
from metro.loop.verdict import identified_fit
from metro.observables import joint_friction, published
from metro.observables.printed_study import printed_study
from metro.observables.problem import BaseFit, Problem, Refusal
from metro.observables.yielding_table import yielding_table
from metro.stages.observed import MODULES, merged, task_of
from metro.units import JSON


def identify(processed: Path, settings: JSON, code: str) -> None:
    """Write the observed tables of a batch and ``identified.json``: the base models, without any effect.

    ``settings``: ``model_form_budget``.
    """
    batch = read_batch(processed)
    read = Processed(processed)
    identified: JSON = {"format": 1, "batch": batch.name, "metro": __version__}
    lacking: JSON = {}
    observed: dict[str, pd.DataFrame] = {}
    for module in MODULES:
        found = module.observe(batch, read, identified)
        if isinstance(found, Refusal):
            lacking[module.OBSERVABLE] = found.reason
            continue
        observed |= found
        task = task_of(module, batch, found, identified)
        fitted = base_fit(task, settings["model_form_budget"]) if isinstance(task, Problem) else None
        identified = merged(identified, module.report(batch, found, identified, task, fitted))
        if isinstance(task, Refusal):
            lacking[module.OBSERVABLE] = task.reason
    friction = joint_friction.observe(batch, read)
    observed |= {} if isinstance(friction, Refusal) else friction
    identified = merged(identified, joint_friction.report(friction))
    printed = published.observe(batch, read, identified)
    observed |= {} if isinstance(printed, Refusal) else printed
    identified = merged(identified, printed_study(batch, observed))
    feedback = yielding_table(batch, read, identified)
    observed |= {} if isinstance(feedback, Refusal) else {"yielding": feedback}
    _write(processed, batch, observed, {"code": code, "settings": json.dumps(settings, sort_keys=True)})
    write_json(processed / "identified.json", {**identified, "not_identified": lacking})


def base_fit(task: Problem, budget: float) -> BaseFit | None:
    """Fit the base model on the identification runs and the load tests; None where there are none."""
    blocks = task.role("identify", "calibrate")
    if not blocks:
        return None
    return identified_fit(task, fit(Candidate(task.base), blocks, first_noise(budget, task.scatter, blocks)))


def _write(
    processed: Path, batch: Batch, observed: dict[str, pd.DataFrame], provenance: dict[str, str]
) -> None:
    unknown = set(observed) - set(OBSERVED)
    if unknown:
        raise KeyError(f"{batch.name}: observed tables that batch.layout does not name: {sorted(unknown)}")
    for name in OBSERVED:
        write_table(processed / f"{name}.parquet", observed.get(name, pd.DataFrame()), provenance)
