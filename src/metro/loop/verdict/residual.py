"""What remains of an observable's residual when the search is through, and what it resembles."""

from __future__ import annotations

from dataclasses import dataclass

from metro.effects.effect import Effect
from metro.loop.checks.floor import ABOVE, AgainstFloor, against_floor
from metro.loop.checks.left_out import unseen
from metro.loop.checks.signature import Line, places, unseen_signature
from metro.loop.fitting.fit import Fit
from metro.loop.search.outcome import Outcome
from metro.loop.search.settled import unsettled
from metro.loop.search.trial import Gates
from metro.loop.statement import Statement
from metro.observables.problem import Block, Problem
from metro.units import JSON, Array

LEAST_RUNS = 2  # to identify on


@dataclass(frozen=True)
class Residual:
    """The significant residual: its ``parts``, one statement each, none where nothing significant remains.

    ``lines`` are those that it was seen in: of conditions left out of the fit where it shows in these alone.
    ``held_out``: the error of the held-out runs where it shows in none but these.
    """

    parts: tuple[Statement, ...]
    fit: Fit
    lines: tuple[Line, ...]
    held_out: AgainstFloor | None = None

    def worst(self, problem: Problem) -> Block:
        """Return a run of the condition in which it is largest."""
        if self.held_out is None:
            return _largest(self.fit)
        return next(b for b in problem.role("validate") if b.condition == self.held_out.condition)

    @property
    def statement(self) -> Statement:
        """All parts in one statement."""
        return Statement("residual", {"parts": self.parts})


def enough_runs(problem: Problem) -> bool:
    """Whether there are runs to fit and runs to judge by."""
    return len(problem.role("identify")) >= LEAST_RUNS and bool(problem.role("validate"))


def residual_of(problem: Problem, outcome: Outcome, gates: Gates, held_out: AgainstFloor | None) -> Residual:
    """Return what remains on the runs of the fit, or where their condition is left out of it.

    Where nothing does, return what the held-out runs show, whose error is ``held_out``; None: there are none.
    """
    parts = remaining(outcome)
    astray = unsettled(outcome.final)
    if astray:  # nothing is claimed of it, least of all that nothing remains
        return Residual((*parts, astray), outcome.final, outcome.lines)
    if parts or not enough_runs(problem):
        return Residual(parts, outcome.final, outcome.lines)
    scored = unseen(outcome.final, outcome.prior)
    least = problem.least_residual(max(gates.materiality, gates.model_form_budget))
    lines = tuple(line for line in unseen_signature(scored, least) if line.significant)
    if seen := places(lines):
        return Residual((Statement("unseen", {"places": seen}),), outcome.final, lines)
    error = against_floor(scored)
    if error and error.p_value < ABOVE and error.relative > least:
        return Residual((Statement("above_floor", vars(error)),), outcome.final, outcome.lines)
    if held_out and held_out.p_value < ABOVE and held_out.relative > least:
        words = Statement("held_out_above_floor", vars(held_out))
        return Residual((words,), outcome.final, outcome.lines, held_out)
    return Residual((), outcome.final, outcome.lines)


def remaining(outcome: Outcome) -> tuple[Statement, ...]:
    """State the significant residual of the runs of the fit, and what it resembles; empty: there is none."""
    parts = [Statement("like", {"effects": _resembled(outcome.likeness)})] if outcome.likeness else []
    parts += [
        Statement("may_be", {"effect": rival.effect, "others": _resembled(rival.fit)})
        for rival in outcome.rivals
        if rival.fit.candidate.effects[-1].resembled
    ]
    parts += [seen] if (seen := places(outcome.lines)) else []
    if outcome.step:
        parts.append(Statement("step", vars(outcome.step)))
    if outcome.between:
        parts.append(Statement("between", vars(outcome.between)))
    if outcome.restless:
        parts.append(Statement("restless", vars(outcome.restless)))
    return tuple(parts)


def _resembled(likeness: Fit) -> list[JSON]:
    """Name what is not of the library and would lower the residual, with the values that do it best."""
    return [
        {"name": effect.name, "values": _values(effect, likeness.theta[place])}
        for effect, place in likeness.candidate.parts(likeness.theta)
        if effect.resembled
    ]


def _values(effect: Effect, theta: Array) -> list[JSON]:
    return [
        {"name": one.name, "value": value, "unit": one.unit}
        for one, value in zip(effect.reported, (effect.matrix @ theta).tolist(), strict=True)
    ]


def _largest(fitted: Fit) -> Block:
    """Return a run of the condition whose residual is largest against the noise."""
    chi2: dict[str, float] = {}
    elements: dict[str, int] = {}
    for block in fitted.blocks:
        if block.role != "calibrate":
            chi2[block.condition] = chi2.get(block.condition, 0.0) + fitted.chi2[block.run]
            elements[block.condition] = elements.get(block.condition, 0) + fitted.elements[block.run]
    worst = max(chi2, key=lambda name: chi2[name] / elements[name])
    return next(block for block in fitted.blocks if block.condition == worst)
