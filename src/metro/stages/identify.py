"""Identify: raw tables become compact observed tables, and those the base models with their intervals."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from metro import __version__
from metro.batch.batch import Batch
from metro.batch.layout import OBSERVED
from metro.batch.processed import read_batch, read_table, write_json, write_table
from metro.loop.fit import Candidate, fit
from metro.loop.noise import first_noise
from metro.loop.verdict import identified_fit
from metro.observables import published
from metro.observables.problem import BaseFit, Problem, Refusal
from metro.stages.observed import MODULES
from metro.units import JSON


def identify(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write the observed tables and ``identified.json`` of a batch.

    ``settings``: ``model_form_budget``.
    """
    batch = read_batch(processed)

    def read(name: str, run: str | None = None) -> pd.DataFrame:
        return read_table(processed / f"{name}.parquet", run)

    identified: JSON = {"format": 1, "batch": batch.name, "metro": __version__}
    lacking: JSON = {}
    observed: dict[str, pd.DataFrame] = {}
    for module in (*MODULES, published):
        found = module.observe(batch, read, identified)
        name = getattr(module, "OBSERVABLE", "published")
        if isinstance(found, Refusal):
            if name != "published":
                lacking[name] = found.reason
            continue
        observed |= found
        if name != "published":
            task = module.problem(batch, found, identified)
            fitted = base_fit(task, settings["model_form_budget"]) if isinstance(task, Problem) else None
            _merge(identified, module.report(batch, found, identified, task, fitted))
            if isinstance(task, Refusal):
                lacking[name] = task.reason
    identified["not_identified"] = lacking
    _write(processed, batch, observed, code)
    write_json(reports / "identified.json", identified)


def base_fit(task: Problem, budget: float) -> BaseFit | None:
    """Fit the base model on the identification runs and the load tests; None where there are none."""
    blocks = task.role("identify", "calibrate")
    if not blocks:
        return None
    return identified_fit(task, fit(Candidate(task.base), blocks, first_noise(budget, task.scatter, blocks)))


def _merge(identified: JSON, blocks: JSON) -> None:
    for name, block in blocks.items():
        if isinstance(block, dict) and isinstance(identified.get(name), dict):
            identified[name] |= block
        else:
            identified[name] = block


def _write(processed: Path, batch: Batch, observed: dict[str, pd.DataFrame], code: str) -> None:
    unknown = set(observed) - set(OBSERVED)
    if unknown:
        raise KeyError(f"{batch.name}: observed tables that batch.layout does not name: {sorted(unknown)}")
    for name in OBSERVED:
        write_table(processed / f"{name}.parquet", observed.get(name, pd.DataFrame()), {"code": code})
