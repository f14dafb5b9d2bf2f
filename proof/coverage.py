"""Coverage: how often the 95 % intervals of the cutting coefficients hold the truth, on simulated batches.

The batches hide no effect: it is the intervals of the base model that are put to the test, as
``identified.json`` writes them. Every batch has a tool, a metal, a sensor and settings of its own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from metro.batch.batch import Batch
from metro.batch.processed import read_batch
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from metro.units import JSON
from metro.workflow import Plan
from proof.progress import tracked
from proof.run import CHECKOUT
from proof.statistics import Demand, share
from proof.tables import Table, tabulated
from virtual_cell.recipes import force

WAYS = {"waveform": "by waveform", "mean": "by mean forces"}
# Those by mean forces hold a bound on what the published model leaves out as well, so they may be too wide.
DEMANDS = {"waveform": Demand(0.93, 0.97), "mean": Demand(0.93)}


@dataclass(frozen=True)
class Interval:
    """An identified coefficient against its true value.

    ``way`` is its block in identified.json. ``half`` is half the interval's width and ``error`` the value
    less the truth, both relative to the truth.
    """

    way: str
    name: str
    error: float
    half: float

    @property
    def covers(self) -> bool:
        """Whether the interval holds the truth."""
        return abs(self.error) <= self.half


def coverage(batches: int, seed: int, style: str, jobs: int) -> list[Interval]:
    """Make batches of the seeds ``seed``, ``seed + 1``, …, identify each, and return every interval."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(jobs, get_context("spawn"), max_tasks_per_child=20) as pool:
        waiting = [pool.submit(identified, seed + i, style) for i in range(batches)]
        return [one for future in tracked(waiting, "identifying") for one in future.result()]


def identified(seed: int, style: str) -> list[Interval]:
    """Make one batch, identify it as the pipeline does, and return its intervals."""
    with TemporaryDirectory() as place:
        folder, out = Path(place) / f"coverage-{seed}", Path(place) / "processed"
        coefficients = force.make(folder, {}, seed, style)["coefficients"]
        plan = Plan.read(CHECKOUT, {"raw_roots": [place]})
        ingest(folder, Path(plan.cells), out, json.loads(plan.settings("ingest")), "")
        identify(out, json.loads(plan.settings("identify")), "")
        block = json.loads((out / "identified.json").read_text())["force"]
        return intervals(block, identifiable(read_batch(out), coefficients))


def identifiable(batch: Batch, coefficients: JSON) -> dict[str, float]:
    """Return the truth of the identifiable coefficients of a batch, by the names of identified.json.

    Its helical identification runs have one axial feed, so kfae contains the whole thrust of the bottom
    edges at that feed: K_Fae + K_Fac × axial feed per tooth.
    """
    truth = {key.split("_")[0]: float(value) for key, value in coefficients.items()}
    runs = batch.runs
    hole = runs[(runs["operation"] == "helical") & (runs["role"] == "identify")].iloc[0]
    passings = batch.manifest["tool"]["teeth"] * hole["spindle_rpm"] / hole["orbit_rpm"]
    thrust = truth["kfae"] + truth.pop("kfac") * float(hole["axial_depth_mm"] / passings)
    return {**truth, "kfae": thrust}


def intervals(block: JSON, truth: dict[str, float]) -> list[Interval]:
    """Compare the coefficients of identified.json's force block with the truth (N/mm², N/mm).

    A coefficient without an interval (null: the batch does not identify it) is left out.
    """
    return [
        Interval(way, name, entry["value"] / truth[name] - 1.0, 0.5 * (high - low) / truth[name])
        for way in WAYS
        for name, entry in block.get(way, {}).items()
        for low, high in [entry["ci95"]]
        if low is not None
    ]


def table(stated: Sequence[Interval], way: str) -> Table:
    """Share of the intervals that hold the truth, of all and by coefficient; and how wide they are."""
    mine = [one for one in stated if one.way == way]
    groups = {"all": mine}
    for one in mine:
        groups.setdefault(one.name, []).append(one)
    shares = [
        share(name, [one.covers for one in group], DEMANDS[way] if group is mine else None)
        for name, group in groups.items()
    ]
    plain = tabulated(f"95 % intervals of the coefficients {WAYS[way]}", shares, "")
    rows = [
        (*row[:4], *_sizes(group), *row[4:]) for row, group in zip(plain.rows, groups.values(), strict=True)
    ]
    return replace(
        plain, header=(*plain.header[:4], "error, rms", "half width, median", *plain.header[4:]), rows=rows
    )


def _sizes(stated: Sequence[Interval]) -> tuple[str, str]:
    """Return error and half width, relative to the truth."""
    error = np.sqrt(np.mean([one.error**2 for one in stated]))
    half = np.median([one.half for one in stated])
    return f"{100 * error:.2f} %", f"{100 * half:.2f} %"
