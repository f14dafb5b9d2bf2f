"""The verdict where the measurement is a label: stable or unstable, against a predicted probability.

Nothing is fitted to labels, so there is no joint refit: the residual is the likelihood of the labels under
the predicted probabilities, judged against what those probabilities themselves would let one expect. Effects
of the boundary are weighed by it (:mod:`metro.loop.labels.search`), on the identification tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from metro.effects.effect import Effect
from metro.loop.labels.evidence import Labels
from metro.loop.labels.next_test import NextTest, advice, any_tests, beside, next_tests
from metro.loop.labels.problem import tests_of
from metro.loop.labels.search import (
    LEAST_SPEEDS,
    LEAST_TESTS,
    LabelOutcome,
    enough,
    pairs,
    predicted,
    search_labels,
    tried,
)
from metro.loop.labels.surprise import surprise
from metro.loop.labels.unknown import UNKNOWN, curves
from metro.loop.labels.verification import SIGNIFICANT, of_hypotheses, verification
from metro.loop.search.trial import Gates
from metro.loop.statement import Statement
from metro.loop.verdict.story import MOST_PROPOSALS
from metro.loop.verdict.verdict import error
from metro.loop.verdict.verification import lowered_by_held_out
from metro.observables.labelled import Change, Labelled
from metro.units import JSON, MM

# What the identification tests say, and what is said where held-out tests contradict it.
REFUTED = {"explained": "partly_explained", "clean": "unexplained"}


@dataclass(frozen=True)
class _Judged:
    """What the verdict is made from.

    ``rows`` of the held-out tests, ``after`` with what is claimed; ``tests`` of the identification and their
    ``runs``; ``contradiction``: how surprising these are under the hypothesis that leads; ``upstream``
    whether the effects of the force explain; ``suggested`` tests that could come next; ``verified``: what the
    held-out tests say, None without any.
    """

    rows: pd.DataFrame
    outcome: LabelOutcome | None
    tests: Labels
    runs: tuple[str, ...]
    contradiction: float
    upstream: bool
    suggested: list[NextTest]
    verified: JSON | None = None

    @property
    def enough(self) -> bool:
        """Whether there are tests to decide by, and others to verify by."""
        return self.outcome is not None and len(self.rows) >= LEAST_TESTS

    @property
    def claimed(self) -> bool:
        """Whether the lead has passed the gates, its own tests agree, and there are tests to verify it."""
        lead = self.outcome.lead if self.outcome else None
        return self.enough and lead is not None and not lead.rejected and self.contradiction >= SIGNIFICANT

    @property
    def status(self) -> str:
        """The verdict."""
        said = self.by_identification
        return REFUTED.get(said, said) if self.verified and not self.verified["holds"] else said

    @property
    def by_identification(self) -> str:
        """The verdict by the identification tests alone."""
        contradicted, outcome = self.contradiction < SIGNIFICANT, self.outcome
        if outcome is None or not self.enough:
            return "insufficient"
        if outcome.lead and not contradicted:
            return "explained" if self.claimed and not outcome.rivals else "undetermined"
        if contradicted or (outcome.elsewhere and not outcome.unsettled):
            return "unexplained"
        if outcome.unsettled:
            return "undetermined"
        return "explained" if self.upstream else "clean"

    @property
    def residual(self) -> list[Statement]:
        """What no effect accounts for, or may not."""
        parts: list[Statement] = []
        if self.outcome is None:
            return parts
        if self.status != self.by_identification:
            against = self.rows["run"][np.abs(self.rows["measured"] - self.rows["after"]) > 0.5]
            values = {"runs": against.tolist(), "tests": len(self.rows)}
            parts.append(Statement("wrong_held_out", values))
        if self.by_identification == "unexplained":
            leading = self.outcome.lead or self.outcome.weighed[0]
            probability = predicted(leading.hypothesis, self.tests, self.outcome.evidence.errors)
            wrong = np.flatnonzero(np.abs(self.tests.unstable - probability) > 0.5)
            parts.append(
                Statement("wrong_labels", {"runs": [self.runs[i] for i in wrong], "tests": len(self.runs)})
            )
        lacking = self.outcome.elsewhere or self.outcome.doubtful
        if lacking and self.by_identification in ("unexplained", "undetermined"):
            parts.append(_elsewhere(self.outcome))
        return parts


def judge_labels(
    task: Labelled,
    rows: pd.DataFrame,
    upstream: list[JSON],
    library: Sequence[Effect],
    gates: Gates,
    *,
    first: Labelled | None = None,
) -> tuple[pd.DataFrame, JSON, JSON, Change | None]:
    """Judge tests with labels: comparison rows, entries of verdict.json and loop.json, change of the models.

    The tests of the identification decide; those held out verify, and name no cause: where they contradict
    the boundary, the status says that something remains. The change is that of the claimed effects, to draw
    the boundary with them; None where there are none.

    Parameters
    ----------
    rows : comparison rows of the held-out tests; ``after`` is predicted with the coefficients as they are
        when the effects found in the cutting force are known.
    upstream : those effects. They are what explains the labels where the prediction contradicts these without
        them only.
    library : effects that change the boundary. first : the problem before those effects of the force were
        known; None: the same.
    """
    judged = _judged(task, rows, library, gates, first if upstream else None)
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
        "verification": judged.verified,
        "effects": (upstream if judged.upstream else []) + _effects(judged),
        "candidates": _candidates(judged),
        "indistinguishable": pairs(judged.outcome) if judged.outcome else [],
        "next_experiment": _next(task, judged),
        "unexplained": None,
    }
    if judged.residual and figures["after"]:
        verdict["unexplained"] = {
            "rms": figures["after"]["rms"],
            "unit": "1",
            "signature": Statement("residual", {"parts": judged.residual}),
        }
    if judged.status != judged.by_identification:
        verdict = lowered_by_held_out(verdict)
    lead = judged.outcome.lead if judged.outcome else None
    change = lead.hypothesis.likeliest if lead and judged.claimed else None
    return rows, verdict, _story(task, judged, verdict, gates), change


def _judged(
    task: Labelled, rows: pd.DataFrame, library: Sequence[Effect], gates: Gates, first: Labelled | None
) -> _Judged:
    tests, runs = tests_of(task, "identify")
    outcome = search_labels(task, library, gates) if enough(tests) else None
    if outcome is None:
        verified = verification(rows, gates) if len(rows) else None
        return _Judged(rows, None, tests, runs, 1.0, False, [], verified)
    leading = outcome.lead or outcome.weighed[0]
    contradiction = surprise(tests, leading.hypothesis, outcome.evidence.errors, gates.seed)
    upstream = first is not None and contradiction >= SIGNIFICANT > _without_upstream(first, gates)
    suggested = next_tests(task, outcome) if outcome.lead or len(rows) < LEAST_TESTS else []
    judged = _Judged(rows, outcome, tests, runs, contradiction, upstream and not outcome.lead, suggested)
    if judged.claimed:
        judged = replace(judged, rows=_with_effects(task, rows, outcome))
    return replace(judged, verified=_verified(task, judged, gates)) if len(rows) else judged


def _without_upstream(first: Labelled, gates: Gates) -> float:
    """Return how surprising the tests are under the base model with the coefficients as they were."""
    tests, _ = tests_of(first, "identify")
    outcome = search_labels(first, (), gates)
    return surprise(tests, outcome.weighed[0].hypothesis, outcome.evidence.errors, gates.seed)


def _verified(task: Labelled, judged: _Judged, gates: Gates) -> JSON:
    """Compare the held-out tests with what is predicted of them, by the hypothesis that is claimed if any."""
    assert judged.outcome is not None
    if judged.upstream:  # the force's effects predict them
        return verification(judged.rows, gates)
    lead = judged.outcome.lead if judged.claimed else None
    return verification(judged.rows, gates, of_hypotheses(task, judged.outcome, lead, gates))


def _with_effects(task: Labelled, rows: pd.DataFrame, outcome: LabelOutcome) -> pd.DataFrame:
    """Put into ``after`` what the lead predicts for the held-out tests whose boundary it changes."""
    assert outcome.lead is not None
    tests, runs = tests_of(task, "validate")
    probability = predicted(outcome.lead.hypothesis, tests, outcome.evidence.errors)
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
    return [entry for entry in entries if not set(entry["effect"].split(" + ")) <= claimed]


def _next(task: Labelled, judged: _Judged) -> Statement:
    if judged.outcome and judged.suggested and judged.status in ("undetermined", "insufficient"):
        return advice(judged.suggested, judged.outcome)
    if judged.outcome:
        return beside(judged.rows)
    return any_tests(len(judged.rows), len(tests_of(task, "validate")[0].speeds))


def _story(task: Labelled, judged: _Judged, verdict: JSON, gates: Gates) -> JSON:
    outcome = judged.outcome
    return {
        "unit": "1",
        "notes": list(task.notes),
        "noise": {
            "floor": verdict["noise_floor"],
            "budget": gates.model_form_budget,
            "words": _surprise(judged, verdict),
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
        for test in judged.suggested[:MOST_PROPOSALS]
    ]


def _surprise(judged: _Judged, verdict: JSON) -> Statement:
    """State how surprising the labels are under the prediction, and by which tests effects are weighed."""
    verified = verdict["verification"]["words"].values if verdict["verification"] else {}
    values: JSON = {
        "verified": len(judged.rows),
        "before": verified.get("before"),
        "after": verified.get("p_value"),
    }
    if judged.outcome is None:
        needed = {"tests_needed": LEAST_TESTS, "speeds_needed": LEAST_SPEEDS}
        return Statement("surprise_alone", {**values, **needed, "weighed": len(judged.runs)})
    weighed = {"weighed": len(judged.runs), "speeds": len(judged.tests.speeds)}
    return Statement("surprise", {**values, **weighed, "nothing": judged.outcome.weighed[0].probability})
