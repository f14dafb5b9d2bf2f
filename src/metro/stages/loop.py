"""Loop: what the prediction leaves over, traced to effects of the library, and the error before and after.

The observables are taken in order. Where effects were found in the cutting force, its coefficients are those
refitted with them, and the observables that start from the coefficients are predicted anew: their error after
includes what was found upstream.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pandas as pd

from metro import __version__
from metro.batch.batch import Batch
from metro.batch.processed import Processed, read_batch, read_json, read_table, write_json, write_table
from metro.batch.provenance import write_made
from metro.effects.effect import Effect
from metro.effects.library import described, library
from metro.loop import measured_poses
from metro.loop.causes.witnesses import Closed
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.held_out import COMPARISON, comparison, held_out, identified_fit, typed
from metro.loop.labels.verdict import judge_labels
from metro.loop.search.outcome import Outcome
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.statement import to_json
from metro.loop.verdict.believable import believable, contradicted, with_share
from metro.loop.verdict.story import story
from metro.loop.verdict.verdict import judge
from metro.loop.verdict.verification import noise_scale
from metro.observables.labelled import Labelled
from metro.observables.observable import Observable
from metro.observables.poses import ERRORS as POSE_ERRORS
from metro.observables.poses.calibrated_arm import with_calibrated_arm
from metro.observables.problem import BaseFit, Problem, Refusal
from metro.observables.published import TABLES as PRINTED
from metro.observables.registry import by_name, observables
from metro.stages.across import across
from metro.stages.problem_file import Posed, read_problems
from metro.stages.problems import merged, pose
from metro.units import JSON

SETTLED = ("explained", "partly_explained")  # statuses whose effects are proven


@dataclass
class Closing:
    """The loop of one batch while its observables are closed one after another."""

    batch: Batch
    processed: Path
    gates: Gates
    prediction: pd.DataFrame
    identified: JSON
    observed: dict[str, pd.DataFrame]
    tables: list[pd.DataFrame] = field(default_factory=list)
    verdicts: JSON = field(default_factory=dict)
    stories: JSON = field(default_factory=dict)
    closed: dict[str, Closed] = field(default_factory=dict)

    @property
    def upstream(self) -> list[JSON]:
        """Effects that changed the cutting coefficients."""
        names = [each.name for each in observables() if each.gives_coefficients]
        return [effect for name in names for effect in (self.verdicts.get(name) or {}).get("effects") or []]

    def spoiled(self, observable: str) -> bool:
        """Whether the data contradict what the batch declares for an observable: then it has no causes."""
        return any(observable in slip["observables"] for slip in self.identified.get("slips") or [])

    def effects(self, observable: str) -> tuple[Effect, ...]:
        """Return the effects that the residual of an observable may be traced to."""
        return () if self.spoiled(observable) else library(observable)

    def without_causes(self, observable: str, verdict: JSON) -> JSON:
        """Return a verdict, without any cause where the data contradict what the batch declares."""
        return contradicted(verdict) if self.spoiled(observable) else with_share(verdict)

    def before(self, observable: str) -> pd.DataFrame:
        """Return the rows of the prediction that are of an observable."""
        rows = self.prediction[self.prediction["observable"] == observable]
        return rows.reset_index(drop=True)


@dataclass(frozen=True)
class Closure:
    """What closing the loop of one observable changed.

    ``outcome`` of the search, where a model was fitted; ``redrawn``: observed tables that effects changed.
    """

    outcome: Outcome | None = None
    redrawn: Mapping[str, pd.DataFrame] = field(default_factory=dict)


@dataclass(frozen=True)
class Loop:
    """Handler: close the loop of an observable; the held-out runs are read once, for the figures.

    ``base``: the fit of the base model, None where the problem was posed anew. ``first``: the problem before
    that.
    """

    state: Closing
    base: Fit | None
    first: Any

    def sampled(self, problem: Problem) -> Closure:
        """Search the library for the effects that the base model lacks."""
        state = self.state
        if not problem.role("identify"):
            return Closure()
        outcome = search(problem, state.effects(problem.observable), state.gates, base=self.base)
        outcome = believable(outcome)
        final = comparison(problem, held_out(problem, outcome.final))
        before = state.before(problem.observable)["before"]
        sigma = final["sigma"] * noise_scale(outcome)
        rows = final.assign(after=final["before"], before=before, sigma=sigma)
        verdict = state.without_causes(problem.observable, judge(problem, outcome, rows, state.gates))
        self._keep(problem.observable, rows, verdict, story(problem, outcome, verdict, state.gates))
        return Closure(outcome)

    def labelled(self, problem: Labelled) -> Closure:
        """Weigh the effects of the boundary by the labels."""
        state = self.state
        effects = state.effects(problem.observable)
        rows = state.before(problem.observable).assign(after=problem.comparison()["before"])
        rows, verdict, record, change = judge_labels(
            problem, rows, state.upstream, effects, state.gates, first=self.first
        )
        verdict = state.without_causes(problem.observable, verdict)
        self._keep(problem.observable, rows, verdict, record)
        return Closure(redrawn=problem.redrawn(state.observed, change) if change else {})

    def refused(self, _refusal: Refusal) -> Closure:
        """There is nothing to close."""
        return Closure()

    def _keep(self, observable: str, rows: pd.DataFrame, verdict: JSON, story: JSON) -> None:
        self.state.tables.append(rows)
        self.state.verdicts[observable] = verdict
        self.state.stories[observable] = story


def loop(
    processed: Path, reports: Path, settings: JSON, code: str, only: Collection[str] | None = None
) -> None:
    """Write ``comparison``, ``lobes_final``, ``findings.json``, and the ``identified.json`` of the reports.

    ``settings``: ``model_form_budget``, ``materiality``, ``false_additions``, ``held_out_gain``, ``seed``.
    ``only``: the observables to be closed; None: all.
    """
    state = closed(processed, Gates(**settings), only)
    _write(state, reports)
    write_made(processed, "loop", settings, code)


def closed(
    processed: Path, gates: Gates, only: Collection[str] | None = None, limits: JSON | None = None
) -> Closing:
    """Close the loop of a batch's observables (or ``only`` some), one after another, and write nothing.

    ``limits`` of settings, [least, largest] by column of the run table, within which runs may be proposed.
    """
    identified = read_json(processed / "identified.json")
    batch = with_calibrated_arm(read_batch(processed), identified)
    state = Closing(
        batch=replace(batch, manifest={**batch.manifest, "limits": limits}) if limits else batch,
        processed=processed,
        gates=gates,
        prediction=read_table(processed / "prediction.parquet"),
        identified=identified,
        observed=_read_observed(processed),
    )
    for name, posed in read_problems(processed).items():
        if only is not None and name not in only:
            continue
        if posed.printed:
            posed.task.handled_by(Loop(state, posed.base, posed.task))
        else:
            _close(state, by_name(name), posed, anew=bool(limits))
    if only is None or measured_poses.NAME in only:
        _judge_poses(state)
    return state


def _judge_poses(state: Closing) -> None:
    """Judge the arm by measured poses, which ``identify`` has fitted and tested already."""
    errors = read_table(state.processed / f"{POSE_ERRORS}.parquet")
    found = measured_poses.judged(state.identified.get("pose") or {}, errors, state.gates.seed)
    if found:
        verdict, story, rows = found
        state.tables.append(rows)
        state.verdicts[measured_poses.NAME] = verdict
        state.stories[measured_poses.NAME] = story


def _close(state: Closing, observable: Observable[Any], posed: Posed, *, anew: bool) -> None:
    """Close the loop of an observable, and write again what follows from what was found.

    Where effects changed the cutting coefficients, the problem is posed ``anew`` with these.
    """
    first = posed.task
    if state.upstream or anew:
        posed = _posed_anew(state, observable, posed)
    closure = posed.task.handled_by(Loop(state, posed.base, first))
    state.observed |= closure.redrawn
    fitted = None
    if closure.outcome and isinstance(posed.task, Problem):
        state.closed[observable.name] = Closed(posed.task, closure.outcome)
        fitted = identified_fit(posed.task, closure.outcome.final)
    has_result = bool(fitted) or (observable.reported_without_fit and not posed.unobserved)
    if (state.upstream or closure.redrawn) and has_result:
        blocks = observable.report(state.batch, state.observed, state.identified, posed.task, fitted)
        state.identified = merged(state.identified, blocks)
    if closure.outcome and fitted:
        _follow(state, observable, state.closed[observable.name], fitted)


def _posed_anew(state: Closing, observable: Observable[Any], posed: Posed) -> Posed:
    """Pose a problem with what is identified by now; what was not observed has none."""
    if state.upstream and observable.observed_with_coefficients:
        again = observable.observe(state.batch, Processed(state.processed), state.identified)
        if isinstance(again, Refusal):
            return Posed(again, unobserved=True)
        state.observed |= again
    elif posed.unobserved:
        return posed
    return Posed(pose(observable, state.batch, state.observed, state.identified))


def _follow(state: Closing, observable: Observable[Any], closed: Closed, fitted: BaseFit) -> None:
    """Write what follows from the model with the effects found, where there are any."""
    final = closed.outcome.final
    if not final.candidate.effects:
        return
    with_effects = replace(closed.problem, base=final.candidate.model(final.theta))
    settled = state.verdicts[observable.name]["status"] in SETTLED
    writers = [observable.report] if observable.retold and settled else []
    for write in [*writers, *filter(None, [observable.after_loop])]:
        blocks = write(state.batch, state.observed, state.identified, with_effects, fitted)
        state.identified = merged(state.identified, blocks)


def _read_observed(processed: Path) -> dict[str, pd.DataFrame]:
    """Read the observed tables that the batch has."""
    names = [name for observable in observables() for name in observable.tables] + [*PRINTED]
    tables = {name: pd.read_parquet(processed / f"{name}.parquet") for name in names}
    return {name: table for name, table in tables.items() if len(table.columns)}


def _write(state: Closing, reports: Path) -> None:
    filled = [table for table in state.tables if len(table)]
    joined = pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(COMPARISON))
    name, processed = state.batch.name, state.processed
    write_table(processed / "comparison.parquet", typed(joined))
    diagram = state.observed.get("lobes", pd.DataFrame())
    write_table(processed / "lobes_final.parquet", diagram)
    observables = {
        observable: {"verdict": verdict, "story": state.stories[observable]}
        for observable, verdict in state.verdicts.items()
    }
    findings = {"format": 1, "batch": name, "metro": __version__, "observables": observables}
    findings |= {"effects": described(), "slips": state.identified.get("slips") or []}
    findings |= across(state.closed, state.verdicts, joined, state.observed, state.gates)
    write_json(reports / "identified.json", state.identified)
    write_json(processed / "findings.json", to_json(findings))
