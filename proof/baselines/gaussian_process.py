"""A Gaussian process on the residual of the base model: it corrects, and names nothing.

The residual is a smooth function of the settings of a run and of the place in it (angle, way, point of the
face), plus an error that a run shares, plus white noise. Where each condition is told by the others, beyond
chance, it says that something is unexplained.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.loop.fitting.fit import Fit
from metro.observables.labelled import Labelled
from metro.observables.problem import Block, Problem, Refusal
from metro.observables.stability.problem import LabelProblem
from metro.units import JSON, Array
from proof.baselines.kriging import Points, agreement, by_chance, fitted
from proof.baselines.program import TOO_FEW, Given, held_out_rows, said

SETTINGS = (
    *("spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm"),
    *("feed_direction_deg", "orbit_rpm", "order"),
)
PLACES = ("s_mm", "x_mm", "y_mm", "t_s")
MOST_POINTS, BINS = 600, 12  # of all runs and of one run: means over neighbouring rows
SIGNIFICANT = 0.01
LEAST_SPEEDS = 3


@dataclass(frozen=True)
class GaussianProcess:
    """Handler: the answer of a program that learns the residual."""

    given: Given

    def sampled(self, problem: Problem) -> JSON:
        """Learn the residual of the identification runs, axis by axis, and correct the held-out ones."""
        base = self.given.base
        if base is None:
            return TOO_FEW
        rows = held_out_rows(problem, base)
        learnt = _rows(problem, problem.role("identify"), base)
        seen = pd.concat([learnt, rows], ignore_index=True)
        settings = self._settings(seen["run"], learnt["run"])
        places = _places(seen)
        axes = seen["axis"].fillna("").astype(str).to_numpy()
        known = np.arange(len(seen)) < len(learnt)
        after = rows["before"].to_numpy(float).copy()
        runs = [block.run for block in problem.role("identify")]
        conditions = [block.condition for block in problem.role("identify")]
        alike = np.zeros((len(runs), len(runs)))
        for axis in np.unique(axes[known]):
            here, there = known & (axes == axis), ~known & (axes == axis)
            binned = _binned(seen[here], settings[here], places[here])
            alike += agreement(binned, runs, conditions)
            after[there[~known]] += fitted(binned).mean(settings[there], places[there])
        return _answer(rows.assign(after=after), by_chance(alike, self.given.seed))

    def labelled(self, problem: Labelled) -> JSON:
        """Learn by how much labels differ from their predicted probability, over speed and depth."""
        assert isinstance(problem, LabelProblem)
        roles = np.array(problem.roles)
        mine, held = roles == "identify", roles == "validate"
        rows = problem.comparison()
        if len(np.unique(problem.rpm[mine])) < LEAST_SPEEDS:
            return TOO_FEW
        settings = np.log(np.column_stack([problem.rpm, problem.depth]))
        settings = (settings - settings[mine].mean(axis=0)) / np.maximum(settings[mine].std(axis=0), 1e-9)
        left = problem.unstable.astype(float) - problem.probability_unstable
        nowhere = np.zeros((len(left), 0))
        speed = problem.rpm.astype(str)  # what is wrong of a speed is wrong of all its tests
        points = Points(settings[mine], nowhere[mine], speed[mine], left[mine])
        after = rows["before"].to_numpy(float) + fitted(points).mean(settings[held], nowhere[held])
        speeds = np.unique(speed[mine]).tolist()
        p_value = by_chance(agreement(points, speeds, speeds), self.given.seed)
        return _answer(rows.assign(after=np.clip(after, 0.0, 1.0)), p_value)

    def refused(self, _refusal: Refusal) -> JSON:
        """Say that there is nothing to tell from."""
        return TOO_FEW

    def _settings(self, runs: pd.Series[str], learnt: pd.Series[str]) -> Array:
        """Return the settings (n, k) of the run of each row that differ between runs, in deviations."""
        table = self.given.runs.reindex(columns=list(SETTINGS)).astype(float).fillna(0.0)
        known = table.loc[learnt.unique()]
        differing = [name for name in SETTINGS if known[name].std(ddof=0) > 0.0]
        scaled = (table[differing] - known[differing].mean()) / known[differing].std(ddof=0)
        return np.asarray(scaled.loc[runs.to_list()].to_numpy(float))


def _rows(problem: Problem, blocks: Sequence[Block], base: Fit) -> pd.DataFrame:
    """Return what was measured and predicted of the runs of the fit, as the comparison has it."""
    parts = []
    for block in blocks:
        measured = block.compared(block.measured) / problem.si
        predicted = block.compared(base.predict(block)) / problem.si
        rows = {"run": block.run, "axis": "", **block.coordinates, "measured": measured, "before": predicted}
        parts.append(pd.DataFrame(rows, index=range(len(measured))))
    return pd.concat(parts, ignore_index=True)


def _places(rows: pd.DataFrame) -> Array:
    """Return the place (n, k) of each row in its run; angles count from the largest predicted value."""
    if "angle_deg" in rows and rows["angle_deg"].notna().all():
        first = rows.groupby(["run", "axis"], dropna=False)["before"].transform("idxmax")
        angle = np.deg2rad(rows["angle_deg"].to_numpy(float) - rows["angle_deg"][first].to_numpy(float))
        return np.column_stack([np.cos(angle), np.sin(angle)])
    there = [name for name in PLACES if name in rows and rows[name].notna().all()]
    values = rows[there].to_numpy(float)
    return np.asarray((values - values.mean(axis=0)) / np.maximum(values.std(axis=0), 1e-9))


def _binned(rows: pd.DataFrame, settings: Array, places: Array) -> Points:
    """Return means over neighbouring rows of each run, so that no more than so many points are left."""
    runs = rows["run"].to_numpy(str)
    left = (rows["measured"] - rows["before"]).to_numpy(float)
    each = max(1, min(BINS, MOST_POINTS // len(np.unique(runs))))
    groups: list[np.ndarray] = []
    for run in np.unique(runs):
        groups += _neighbours(np.flatnonzero(runs == run), places, each)
    return Points(
        np.array([settings[group[0]] for group in groups]),
        np.array([places[group].mean(axis=0) for group in groups]),
        np.array([runs[group[0]] for group in groups]),
        np.array([left[group].mean() for group in groups]),
    )


def _neighbours(rows: np.ndarray, places: Array, each: int) -> list[np.ndarray]:
    """Halve the rows of a run along the place in which they are spread most, again and again."""
    if each < 2 or len(rows) < 2 or not places.shape[1]:
        return [rows]
    along = int(np.argmax(np.ptp(places[rows], axis=0)))
    ordered = rows[np.argsort(places[rows, along], kind="stable")]
    middle = len(ordered) // 2
    return [
        *_neighbours(ordered[:middle], places, each // 2),
        *_neighbours(ordered[middle:], places, each - each // 2),
    ]


def _answer(rows: pd.DataFrame, p_value: float) -> JSON:
    """Say whether conditions agree on what is left, beyond chance."""
    left = {"signature": "conditions agree on what is left over"} if p_value < SIGNIFICANT else None
    return said("unexplained" if left else "clean", rows, unexplained=left, p_value=p_value)
