"""The story of an observable's loop for the report: all that was tried, in numbers."""

from __future__ import annotations

import numpy as np

from metro.loop.checks.signature import Line
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.search.outcome import Outcome
from metro.loop.search.trial import Gates, Trial
from metro.loop.statement import Statement
from metro.loop.verdict.advice import ranked
from metro.loop.verdict.beliefs import beliefs, strained
from metro.loop.verdict.verdict import error, estimates, gain, held_out_rms, parameters, why_not
from metro.observables.problem import Block, Problem
from metro.units import JSON, Array

MOST_PROPOSALS = 5  # that are listed


def story(problem: Problem, outcome: Outcome, verdict: JSON, gates: Gates) -> JSON:
    """Return the observable's entry of loop.json, all that was tried: statements where that has sentences."""
    believed = beliefs(outcome)
    return {
        "unit": problem.unit,
        "notes": list(problem.notes),
        "noise": _noise(problem, outcome, verdict, gates),
        "believed": believed,
        "strained": strained(believed, outcome),
        "candidates": [_tried(problem, trial, outcome) for trial in outcome.trials],
        "path": _path(problem, outcome),
        "signature_unit": problem.basis_unit or problem.unit,
        "signature": [_line(line, problem.si) for line in outcome.lines],
        "cannot_be_seen": [
            {"effect": name, "why": why}
            for name, why in {**outcome.not_visible, **outcome.dim}.items()
            if name not in outcome.names
        ],
        "experiments": _experiments(problem, outcome),
        "blocks": _blocks(problem, outcome),
    }


def _noise(problem: Problem, outcome: Outcome, verdict: JSON, gates: Gates) -> JSON:
    noise = outcome.final.noise
    at = noise.scattering
    scatter = 100.0 * float(np.mean(noise.scatter[at])) if len(at) else 0.0
    prior = float(np.mean(problem.scatter[at])) if len(at) else 0.0
    relative = {"prior": prior, "systematic": problem.systematic, "budget": gates.model_form_budget}
    return {
        "floor": verdict["noise_floor"],
        "budget": gates.model_form_budget,
        "scatter": scatter / 100.0,
        "words": Statement("noise", {"scatter_percent": scatter, **relative}),
    }


def _tried(problem: Problem, trial: Trial, outcome: Outcome) -> JSON:
    rivals = {rival.other for rival in outcome.rivals}
    verdict = "added" if trial.effect.name in outcome.names else "rejected"
    verdict = "rival" if trial.effect.name in rivals else verdict
    verdict = "not visible" if trial.effect.name in outcome.not_visible else verdict
    fitted = outcome.final if verdict == "added" else trial.fit
    forms = sum(effect.name == trial.effect.name for effect in outcome.offered)
    return {
        "effect": trial.effect.name,
        "statistic": trial.evidence.statistic,
        "p_value": trial.evidence.p_value,
        "q_value": trial.q_value,
        "held_out_rms": held_out_rms(problem, trial.fit),
        "held_out_gain": gain(trial),
        "size": trial.evidence.size,
        "weight": trial.weight,
        "verdict": verdict,
        "why_not": "" if verdict == "added" else why_not(outcome, trial),
        "parameters": parameters(trial.fit, trial.effect.name),
        "estimates": estimates(fitted, trial.effect.name),
        "where": dict(trial.effect.where),
        "chosen_among": max(forms, trial.effect.sought),
    }


def _path(problem: Problem, outcome: Outcome) -> list[JSON]:
    """Error on the held-out runs after each addition."""
    if not problem.role("validate"):
        return []
    entries = []
    for fitted in (outcome.base, *outcome.steps):
        rows = comparison(problem, held_out(problem, fitted))
        scored = error(rows, "before", 0)
        names = [effect.name for effect in fitted.candidate.effects]
        entries.append({"added": names, "held_out_rms": scored["rms"], "nrmse": scored["nrmse"]})
    return entries


def _line(line: Line, si: float) -> JSON:
    return {
        "axis": line.axis,
        "label": line.label,
        "amplitude": line.rms / si,
        "excess": line.excess / si,
        "relative": line.relative,
        "p_value": line.p_value,
        "significant": line.significant,
    }


def _experiments(problem: Problem, outcome: Outcome) -> list[JSON]:
    """Return what the most promising runs promise for each pair that is undecided."""
    return [
        {
            "pair": list(rival.pair),
            "proposal": prospect.proposal.words,
            "repeats": prospect.repeats,
            "runs": prospect.runs,
            "probability": prospect.probability,
            "probability_once": prospect.once,
        }
        for rival in outcome.rivals
        for prospect in ranked(problem, outcome, rival)[:MOST_PROPOSALS]
    ]


def _blocks(problem: Problem, outcome: Outcome) -> list[JSON]:
    """Size of the residual of each run of the fit, before and after."""
    return [
        {
            "run": block.run,
            "condition": block.condition,
            "role": block.role,
            "order": block.order,
            "rms_measured": _rms(block, block.measured) / problem.si,
            "rms_before": _rms(block, block.measured - outcome.base.predict(block)) / problem.si,
            "rms_after": _rms(block, block.measured - outcome.final.predict(block)) / problem.si,
            "chi2_before": outcome.base.chi2[block.run],
            "chi2_after": outcome.final.chi2[block.run],
        }
        for block in problem.role("identify", "calibrate")
    ]


def _rms(block: Block, values: Array) -> float:
    return float(np.sqrt(np.mean(block.to_rows(values) ** 2)))
