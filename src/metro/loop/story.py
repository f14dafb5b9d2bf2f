"""The story of an observable's loop for the report: all that was tried, in numbers and in words."""

from __future__ import annotations

import numpy as np

from metro.loop import signature as rest
from metro.loop.advice import ranked
from metro.loop.search import Gates, Outcome, Trial
from metro.loop.verdict import (
    comparison,
    error,
    estimates,
    gain,
    held_out,
    held_out_rms,
    parameters,
    why_not,
)
from metro.observables.problem import Block, Problem
from metro.units import JSON, Array, printed

MOST_PROPOSALS = 5
SENTENCES = {
    "clean": "The base model predicts the held-out runs within the noise and the declared model-form budget; "
    "nothing was added.",
    "explained": "The residual is explained by {named}.",
    "partly_explained": "Part of the residual is explained by {named}, proven on left-out conditions; "
    "a significant rest remains that no effect of the library accounts for.",
    "undetermined": "Several effects explain the residual equally well with these data: {rivals}.",
    "unexplained": "There is a significant residual that no effect of the library accounts for; "
    "nothing was added.",
    "insufficient": "There are too few runs to tell: nothing can be said about the residual.",
}


def told(problem: Problem, outcome: Outcome, verdict: JSON, gates: Gates) -> JSON:
    """Return the observable's entry of loop.json: all that was tried, for the report."""
    return {
        "unit": problem.unit,
        "notes": list(problem.notes),
        "noise": _noise(problem, outcome, verdict, gates),
        "candidates": [_tried(problem, trial, outcome) for trial in outcome.trials],
        "path": _path(problem, outcome),
        "signature_unit": problem.basis_unit or problem.unit,
        "signature": [_line(line, problem.si) for line in outcome.lines],
        "cannot_be_seen": [
            {"effect": name, "why": why}
            for name, why in (outcome.not_visible | outcome.dim).items()
            if name not in outcome.names
        ],
        "experiments": _experiments(problem, outcome),
        "blocks": _blocks(problem, outcome),
        "words": in_words(verdict),
    }


def _noise(problem: Problem, outcome: Outcome, verdict: JSON, gates: Gates) -> JSON:
    noise = outcome.final.noise
    at = noise.scattering
    scatter = 100.0 * float(np.mean(noise.scatter[at])) if len(at) else 0.0
    words = (
        f"From run to run the base parameters scatter by {scatter:.2g} % (from repeats, drawn towards "
        f"{100 * float(np.mean(problem.scatter[at])) if len(at) else 0:.2g} %); differences below "
        f"{100 * gates.model_form_budget:.2g} % of the signal are the declared model-form budget "
        "and nobody's effect."
    )
    if problem.systematic:
        words += (
            f" All runs may share an error of {100 * problem.systematic:.2g} % that the inputs of the model "
            "have; an effect must change the prediction by more than twice that."
        )
    return {
        "floor": verdict["noise_floor"],
        "budget": gates.model_form_budget,
        "scatter": scatter / 100.0,
        "words": words,
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
        found = error(rows, "before", 0)
        names = [effect.name for effect in fitted.candidate.effects]
        entries.append({"added": names, "held_out_rms": found["rms"], "nrmse": found["nrmse"]})
    return entries


def _line(line: rest.Line, si: float) -> JSON:
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
    """Say what the most promising runs promise for each pair that is undecided."""
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
    """Size of the rest of each run of the fit, before and after."""
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


def in_words(verdict: JSON) -> str:
    """Say the verdict as an engineer would."""
    *first, last = [entry["effect"].replace("_", " ") for entry in verdict["effects"]] or [""]
    named = f"{', '.join(first)} and {last}" if first else last
    rivals = "; ".join(" or ".join(pair).replace("_", " ") for pair in verdict["indistinguishable"])
    sentence = SENTENCES[verdict["status"]].format(named=named, rivals=rivals)
    before, after, left = verdict["before"], verdict["after"], verdict["unexplained"]
    if before and after:
        unit = f" {printed(verdict['unit'])}".rstrip()
        sentence += f" On held-out runs the error is {before['rms']:.3g}{unit} rms before"
        sentence += f" and {after['rms']:.3g}{unit} after."
    return sentence + (f" What is left: {left['signature']}." if left else "")
