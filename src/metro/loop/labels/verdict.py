"""The verdict where the measurement is a label: stable or unstable, against a predicted probability.

Nothing is fitted to labels, so there is no joint refit: the residual is the likelihood of the labels under
the predicted probabilities, judged against what those probabilities themselves would let one expect. Effects
of the boundary are weighed by it (:mod:`metro.loop.labels.search`), on the identification tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.effects.effect import Effect
from metro.loop.labels.next_test import NextTest, advice, beside, next_tests
from metro.loop.labels.problem import every_test, tests_of
from metro.loop.labels.search import (
    LEAST_SPEEDS,
    LEAST_TESTS,
    LabelOutcome,
    Weighed,
    enough,
    pairs,
    predicted,
    search_labels,
    tried,
)
from metro.loop.labels.surprise import surprise
from metro.loop.labels.unknown import UNKNOWN, curves
from metro.loop.search.trial import Gates
from metro.loop.statement import Statement
from metro.loop.verdict.story import MOST_PROPOSALS
from metro.loop.verdict.verdict import DRAWS, error
from metro.observables.labelled import Change, Labelled
from metro.units import JSON, MM, Array

SIGNIFICANT = 0.01
REFUTED = -1.0  # log-likelihood of the held-out tests that a correction may cost: more is no chance


def log_likelihood(label: Array, probability: Array) -> Array:
    """Log-likelihood of labels, (…, n) → (…,); the probabilities (n,) are kept off 0 and 1 by 1e-3."""
    p = np.clip(probability, 1e-3, 1.0 - 1e-3)
    return np.asarray(np.sum(np.where(label > 0.5, np.log(p), np.log1p(-p)), axis=-1))


def surprise_alone(label: Array, probability: Array, seed: int) -> float:
    """Probability that labels drawn one by one are at least as unlikely as those measured."""
    drawn = np.random.default_rng(seed).random((DRAWS, len(label))) < probability
    unlikelier = (
        log_likelihood(drawn.astype(float), probability) <= log_likelihood(label, probability) + 1e-12
    )
    return float((1 + np.count_nonzero(unlikelier)) / (1 + DRAWS))


@dataclass(frozen=True)
class _Judged:
    """What the verdict is made from.

    ``rows`` of the held-out tests, ``after`` with what is claimed; ``surprises`` of these before and after,
    and of the identification tests under the hypothesis that leads; ``upstream`` whether the effects of the
    force explain; ``tests`` that could come next.
    """

    rows: pd.DataFrame
    outcome: LabelOutcome | None
    surprises: tuple[float, float, float]
    upstream: bool
    refuted: bool
    tests: list[NextTest]

    @property
    def claimed(self) -> bool:
        """Whether the lead has passed the gates, its own tests agree, and held-out tests have judged it."""
        lead = self.outcome.lead if self.outcome else None
        agrees = self.surprises[2] >= SIGNIFICANT
        passed = lead is not None and not lead.rejected and agrees and not self.refuted
        return passed and len(self.rows) >= LEAST_TESTS

    @property
    def status(self) -> str:
        """The verdict."""
        contradicted, outcome = min(self.surprises[1:]) < SIGNIFICANT, self.outcome
        if len(self.rows) < LEAST_TESTS:
            return "insufficient"
        if outcome and outcome.lead and not contradicted:
            return "explained" if self.claimed and not outcome.rivals else "undetermined"
        if self.claimed:
            return "partly_explained"
        if contradicted or (outcome and outcome.elsewhere and not outcome.unsettled):
            return "unexplained"
        if outcome and outcome.unsettled:
            return "undetermined"
        return "explained" if self.upstream else "clean"

    @property
    def residual(self) -> list[Statement]:
        """What no effect accounts for, or may not."""
        parts = []
        if self.status in ("unexplained", "partly_explained"):
            label, after = (self.rows[name].to_numpy(float) for name in ("measured", "after"))
            wrong = self.rows["run"][np.abs(label - after) > 0.5].tolist()
            parts.append(Statement("wrong_labels", {"runs": wrong, "tests": len(label)}))
        lacking = self.outcome and (self.outcome.elsewhere or self.outcome.doubtful)
        if self.outcome and lacking and self.status in ("unexplained", "undetermined"):
            parts.append(_elsewhere(self.outcome))
        return parts


def judge_labels(
    task: Labelled, rows: pd.DataFrame, upstream: list[JSON], library: Sequence[Effect], gates: Gates
) -> tuple[pd.DataFrame, JSON, JSON, Change | None]:
    """Judge tests with labels: comparison rows, entries of verdict.json and loop.json, change of the models.

    The change is that of the claimed effects, to draw the boundary with them; None where there are none.

    Parameters
    ----------
    rows : comparison rows of the held-out tests; ``after`` is predicted with the coefficients as they are
        when the effects found in the cutting force are known.
    upstream : those effects. They are what explains the labels where the prediction contradicts these without
        them only.
    library : effects that change the boundary.
    """
    judged = _judged(task, rows, library, gates)
    rows, after = judged.rows, judged.rows["after"].to_numpy(float)
    floor = float(np.sqrt(np.mean(after * (1.0 - after)))) if len(rows) else None
    figures = {
        column: error(rows, column, gates.seed) if len(rows) else None for column in ("before", "after")
    }
    verdict: JSON = {
        "status": judged.status,
        "unit": "1",
        "noise_floor": floor,
        "held_out_runs": rows["run"].tolist(),
        **figures,
        "effects": (upstream if judged.upstream else []) + _effects(judged),
        "candidates": _candidates(judged),
        "indistinguishable": pairs(judged.outcome) if judged.outcome else [],
        "next_experiment": _next(judged),
        "unexplained": None,
    }
    if judged.residual and figures["after"]:
        verdict["unexplained"] = {
            "rms": figures["after"]["rms"],
            "unit": "1",
            "signature": Statement("residual", {"parts": judged.residual}),
        }
    lead = judged.outcome.lead if judged.outcome else None
    change = lead.hypothesis.likeliest if lead and judged.claimed else None
    return rows, verdict, _story(task, judged, verdict, gates), change


def _judged(task: Labelled, rows: pd.DataFrame, library: Sequence[Effect], gates: Gates) -> _Judged:
    tests, _ = tests_of(task, "identify")
    outcome = search_labels(task, library, gates) if enough(tests) else None
    label = rows["measured"].to_numpy(float)

    def surprised(column: str) -> float:
        return surprise_alone(label, rows[column].to_numpy(float), gates.seed) if len(rows) else 1.0

    before, refitted = surprised("before"), surprised("after")
    upstream = before < SIGNIFICANT <= refitted
    if outcome is None:
        return _Judged(rows, None, (before, refitted, 1.0), upstream, False, [])
    lead, refuted = outcome.lead, False
    within = _within(task, outcome, gates)
    nothing = leading = outcome.weighed[0]
    if lead and not lead.rejected and within >= SIGNIFICANT:
        corrected = _with_effects(task, rows, outcome)
        old, new = (log_likelihood(label, each["after"].to_numpy(float)) for each in (rows, corrected))
        still = _held_out(task, outcome, lead, gates) < SIGNIFICANT
        refuted = bool(new - old < REFUTED) or (still and outcome.doubtful)
        rows, leading = (rows, nothing) if refuted else (corrected, lead)
    after = refitted
    if rows["after"].equals(rows["before"]) or leading is lead:  # else the force's effects predict them
        before, after = (_held_out(task, outcome, one, gates) for one in (nothing, leading))
    suggested = next_tests(task, outcome) if lead or len(rows) < LEAST_TESTS else []
    return _Judged(rows, outcome, (before, after, within), upstream, refuted, suggested)


def _held_out(task: Labelled, outcome: LabelOutcome, one: Weighed, gates: Gates) -> float:
    """Return the surprise of the held-out tests under a hypothesis."""
    tests, _ = tests_of(task, "validate")
    return surprise(tests, one.hypothesis, outcome.evidence.deviations, gates.seed)


def _with_effects(task: Labelled, rows: pd.DataFrame, outcome: LabelOutcome) -> pd.DataFrame:
    """Put into ``after`` what the lead predicts for the held-out tests whose boundary it changes."""
    assert outcome.lead is not None
    tests, runs = tests_of(task, "validate")
    probability = predicted(outcome.lead.hypothesis, tests, outcome.evidence.deviations)
    changed = pd.Series(probability, index=list(runs), dtype=float).reindex(rows["run"]).to_numpy()
    return rows.assign(after=np.where(np.isfinite(changed), changed, rows["after"]))


def _elsewhere(outcome: LabelOutcome) -> Statement:
    """State how a cause that the library lacks would have to move the boundary."""
    perhaps = not outcome.elsewhere or outcome.unsettled
    likeliest = outcome.lacking[0]
    if likeliest.names != (UNKNOWN,):
        return Statement("likeness_of_labels", {"perhaps": perhaps, "effect": likeliest.names[0]})
    curve = likeliest.hypothesis
    rpm, depth = outcome.base_boundary
    at = np.argsort(rpm, kind="stable")[[0, len(rpm) // 2, -1]]
    factor = np.exp(curve.weights @ curves(curve, (rpm, depth), (rpm[at], depth[at])))
    factors = [{"rpm": float(rpm[i]), "factor": float(f)} for f, i in zip(factor, at, strict=True)]
    return Statement("lacking", {"perhaps": perhaps, "factors": factors})


def _within(task: Labelled, outcome: LabelOutcome, gates: Gates) -> float:
    """Return the surprise of the tests that weighed the hypothesis that leads; of all where it is nothing."""
    leading, tests = outcome.lead, outcome.evidence.tests
    if leading is None:
        leading, tests = outcome.weighed[0], every_test(task)
    return surprise(tests, leading.hypothesis, outcome.evidence.deviations, gates.seed)


def _effects(judged: _Judged) -> list[JSON]:
    """Effects that are claimed, the first to lead first."""
    lead = judged.outcome.lead if judged.outcome else None
    if judged.outcome is None or lead is None or not judged.claimed:
        return []
    return [
        {
            "effect": name,
            "probability": judged.outcome.probability(name),
            "parameters": lead.hypothesis.parameters(name),
        }
        for name in lead.names
    ]


def _candidates(judged: _Judged) -> list[JSON]:
    claimed = {entry["effect"] for entry in _effects(judged)}
    entries = tried(judged.outcome) if judged.outcome else []
    return [entry for entry in entries if entry["effect"] not in claimed]


def _next(judged: _Judged) -> Statement:
    if judged.outcome and judged.tests and judged.status in ("undetermined", "insufficient"):
        return advice(judged.tests, judged.outcome)
    return beside(judged.rows)


def _story(task: Labelled, judged: _Judged, verdict: JSON, gates: Gates) -> JSON:
    outcome = judged.outcome
    return {
        "unit": "1",
        "notes": list(task.notes),
        "noise": {
            "floor": verdict["noise_floor"],
            "budget": gates.model_form_budget,
            "words": _surprise(judged),
        },
        "candidates": _tried(judged),
        "path": [],
        "signature": [],
        "cannot_be_seen": [
            {"effect": name, "why": why} for name, why in (outcome.not_visible if outcome else {}).items()
        ],
        "experiments": _experiments(judged),
        "blocks": [],
    }


def _tried(judged: _Judged) -> list[JSON]:
    """Every hypothesis with what became of it."""
    if judged.outcome is None:
        return []
    claimed = {entry["effect"] for entry in _effects(judged)}
    entries = []
    for one, entry in zip(judged.outcome.weighed[1:], tried(judged.outcome), strict=True):
        rival = bool(set(one.names) & set(judged.outcome.rivals))
        outcome = "added" if set(one.names) == claimed else ("rival" if rival else "rejected")
        estimates = {name: one.hypothesis.parameters(name) for name in one.names}
        parameters = estimates[one.names[0]] if len(estimates) == 1 else estimates
        weighed = {"weight": entry["probability"], "verdict": outcome, "parameters": parameters}
        entries.append({key: value for key, value in entry.items() if key != "probability"} | weighed)
    return entries


def _experiments(judged: _Judged) -> list[JSON]:
    names = (
        [*judged.outcome.lead.names[-1:], *judged.outcome.rivals]
        if judged.outcome and judged.outcome.lead
        else []
    )
    return [
        {
            "pair": names[:2],
            "proposal": test.statement,
            "repeats": 1,
            "runs": 1,
            "probability": test.leading,
            "probability_once": test.leading,
            "spindle_rpm": test.rpm,
            "axial_depth_mm": test.depth / MM,
        }
        for test in judged.tests[:MOST_PROPOSALS]
    ]


def _surprise(judged: _Judged) -> Statement:
    """State how unlikely the labels are under the prediction, and by which tests effects are weighed."""
    before, after, _ = judged.surprises
    values: JSON = {"tests": len(judged.rows), "before": before, "after": after}
    if judged.outcome is None:
        return Statement(
            "surprise_alone", {**values, "tests_needed": LEAST_TESTS, "speeds_needed": LEAST_SPEEDS}
        )
    tests = judged.outcome.evidence.tests
    weighed = {"weighed": len(tests.depth), "speeds": len(tests.speeds)}
    return Statement("surprise", {**values, **weighed, "nothing": judged.outcome.weighed[0].probability})
