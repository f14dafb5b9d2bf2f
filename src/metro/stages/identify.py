"""Identify: raw tables become compact observed tables, problems, and the base models with their intervals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from metro import __version__
from metro.batch.batch import Batch
from metro.batch.processed import Processed, Tables, read_batch, write_json, write_table
from metro.batch.provenance import write_made
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.held_out import identified_fit
from metro.loop.fitting.noise import first_noise
from metro.observables.areal.study import areal
from metro.observables.arm.calibration import calibration
from metro.observables.labelled import Labelled
from metro.observables.levelling import TABLES as LEVELLED
from metro.observables.levelling import observable as levelling
from metro.observables.loads import TABLES as LOADED
from metro.observables.loads import observable as loads
from metro.observables.observable import Observable
from metro.observables.poses import TABLES as POSES
from metro.observables.poses import observable as poses
from metro.observables.poses.calibrated_arm import with_calibrated_arm
from metro.observables.problem import Problem, Refusal
from metro.observables.published import TABLES as PRINTED
from metro.observables.published import observable as published
from metro.observables.published.study import printed_study
from metro.observables.registry import observables
from metro.observables.texture import TABLES as TEXTURE
from metro.observables.texture import observable as texture
from metro.slips.find import JUDGED, LABEL, find
from metro.slips.slip import Slip
from metro.stages.problem_file import Posed, write_problems
from metro.stages.problems import merged, pose
from metro.units import JSON


@dataclass(frozen=True)
class BaseModel:
    """Handler: the fit of a base model on identification runs and load tests; None where there is none.

    ``budget``: the model-form budget. None: nothing is fitted.
    """

    budget: float | None

    def sampled(self, problem: Problem) -> Fit | None:
        """Fit the base parameters of a problem."""
        return None if self.budget is None else base_fit(problem, self.budget)

    def labelled(self, _problem: Labelled) -> None:
        """Nothing is fitted to labels."""

    def refused(self, _refusal: Refusal) -> None:
        """There is nothing to fit."""


def base_fit(problem: Problem, budget: float) -> Fit | None:
    """Fit a base model on identification runs and load tests; None where there are none."""
    blocks = problem.role("identify", "calibrate")
    if not blocks:
        return None
    return fit(Candidate(problem.base), blocks, first_noise(budget, problem.scatter, blocks))


@dataclass
class _State:
    """The stage while one observable after another is identified."""

    batch: Batch
    read: Tables
    base_model: BaseModel
    identified: JSON
    observed: dict[str, pd.DataFrame] = field(default_factory=dict)
    posed: dict[str, Posed] = field(default_factory=dict)

    def observe(self, observable: Observable[Any]) -> None:
        """Make the observed tables of an observable."""
        tables = observable.observe(self.batch, self.read, self.identified)
        if isinstance(tables, Refusal):
            self.posed[observable.name] = Posed(tables, unobserved=True)
        else:
            self.observed |= tables

    def identify(self, observable: Observable[Any]) -> None:
        """Pose the problem of an observable, fit its base model, and write what follows from the fit."""
        task = pose(observable, self.batch, self.observed, self.identified)
        base = task.handled_by(self.base_model)
        self.posed[observable.name] = Posed(task, base)
        fitted = identified_fit(task, base) if isinstance(task, Problem) and base else None
        self.add(observable.report(self.batch, self.observed, self.identified, task, fitted))

    def add(self, blocks: JSON) -> None:
        """Put blocks into what is identified."""
        self.identified = merged(self.identified, blocks)


def identify(processed: Path, settings: JSON, code: str) -> None:
    """Write the observed tables of a batch, its problems, and ``identified.json``: no effect is in them.

    An arm that a series of measured poses has calibrated takes the place of the declared one in all else.
    All are observed before problems are posed, since a problem may need the tables of several; but some
    tables need the cutting coefficients, which are identified first.

    ``settings``: ``model_form_budget``.
    """
    batch, read = read_batch(processed), Processed(processed)
    pose_tables, pose_blocks = poses.observe(batch, read)
    batch = with_calibrated_arm(batch, pose_blocks)
    state = _identified(batch, read, settings["model_form_budget"], observables())
    state.observed |= pose_tables
    state.add(pose_blocks)
    slips = [slip.row for slip in _slips(state)]
    state.identified |= {"slips": slips} if slips else {}
    for observable in observables():
        if observable.beside:
            tables, blocks = observable.beside(batch, state.read, state.identified)
            state.observed |= tables
            state.add(blocks)
    posed = {each.name: state.posed[each.name] for each in observables()}
    refused = {name: each.task for name, each in posed.items() if isinstance(each.task, Refusal)}
    lacking = {name: refusal.reason for name, refusal in refused.items() if not refusal.moot}
    printed = published.observe(batch, state.read, state.identified)
    if not isinstance(printed, Refusal):
        state.observed |= printed
        tasks = published.problems(batch, state.observed, state.identified)
        posed = {task.observable: Posed(task, state.base_model.sampled(task), printed=True) for task in tasks}
    state.add(printed_study(batch, state.observed))
    state.add(calibration(batch, state.read))
    for measured in (loads, levelling, texture):
        tables, blocks = measured.observe(batch, state.read)
        state.observed |= tables
        state.add(blocks)
    state.add(areal(batch, state.read))
    _write(processed, batch, state.observed)
    write_problems(processed, posed)
    write_json(processed / "identified.json", {**state.identified, "not_identified": lacking})
    write_made(processed, "identify", settings, code)


def slips_of(batch: Batch, read: Tables, budget: float) -> tuple[tuple[Slip, ...], JSON]:
    """Return what the data of a batch contradict, and what is identified; nothing is written.

    Models are fitted only where cutting coefficients are asked for: by the lobes that cuts labelled stable or
    not are held against, and by a tabulated machine that yields to the force. All else that contradicts is
    found in the problems as they are posed.

    Parameters
    ----------
    read : the canonical tables. budget : the model-form budget.
    """
    needed = batch.runs["stable"].isin(list(LABEL)).any() or not read("stations").empty
    judged = [observable for observable in observables() if observable.name in JUDGED]
    state = _identified(batch, read, budget if needed else None, judged)
    return _slips(state), state.identified


def _slips(state: _State) -> tuple[Slip, ...]:
    tasks = {name: each.task for name, each in state.posed.items()}
    return find(state.batch, state.read, state.observed, tasks, state.identified)


def _identified(
    batch: Batch, read: Tables, budget: float | None, wanted: Iterable[Observable[Any]]
) -> _State:
    """Observe, pose the problems and fit their base models."""
    head: JSON = {"format": 1, "batch": batch.name, "metro": __version__}
    state = _State(batch, read, BaseModel(budget), head)
    wanted = tuple(wanted)
    for observable in wanted:
        state.observe(observable)
        if observable.gives_coefficients and observable.name not in state.posed:
            state.identify(observable)
    for observable in wanted:
        if observable.name not in state.posed:
            state.identify(observable)
    return state


def _write(processed: Path, batch: Batch, observed: dict[str, pd.DataFrame]) -> None:
    """Write every table that an observable may have, empty where it has not."""
    names = [name for observable in observables() for name in observable.tables]
    names += [*LOADED, *LEVELLED, *TEXTURE, *POSES, *PRINTED]
    unknown = set(observed) - set(names)
    if unknown:
        raise KeyError(f"{batch.name}: observed tables that no observable names: {sorted(unknown)}")
    for name in names:
        write_table(processed / f"{name}.parquet", observed.get(name, pd.DataFrame()))
