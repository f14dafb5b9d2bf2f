"""The verdict on an observable: what was found, how sure, and the error on runs that no fit has seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.effects.effect import Effect, EffectParameter, by_name
from metro.loop.advice import enough_runs, left_over, more_runs, next_experiment
from metro.loop.fit import Fit, polished, score
from metro.loop.noise import block_sigma
from metro.loop.search import Gates, Outcome, Trial, withdrawn
from metro.loop.signature import Line, in_words, share_left, signature
from metro.loop.trial import beyond, unsettled
from metro.observables.problem import BaseFit, Problem
from metro.observables.quantity import quantity
from metro.units import JSON, Array, printed

COMPARISON = (
    *("observable", "run", "axis", "t_s", "angle_deg", "s_mm", "x_mm", "y_mm"),
    *("measured", "before", "after", "sigma", "unit"),
)
DRAWS = 2000
AGAINST = 1.0  # log-likelihood by which held-out runs must be worse off with effects to speak against them
WORSE = 2.0  # times the least rest that counts: on unseen runs, what the parameters are off adds to it
RESEMBLED = "no effect of the library: it is only said what the rest is like"
BEATEN = "passed every gate, but what was added explains the runs better"
REFUTED = "the held-out runs speak against it: they are predicted worse with it"
MAKESHIFT = "what is predicted of a run that no fit has seen is a makeshift:"
UNTESTED = "not tested: there is no run to judge it by that the fit has not seen"


@dataclass(frozen=True)
class Held:
    """The held-out runs under a fit: rows of the comparison, in the problem's unit, by run."""

    predicted: dict[str, Array]
    sigma: dict[str, Array]


def held_out(problem: Problem, fitted: Fit) -> Held:
    """Predict the validation runs; only their own unknowns (start phase) are estimated from them."""
    blocks = problem.role("validate")
    if not blocks:
        return Held({}, {})
    scored = score(fitted, blocks)
    model = scored.candidate.model(scored.theta)
    predicted, sigma = {}, {}
    for block in blocks:
        matrix, offset = model.design(block, scored.nuisance[block.run], scored.beta)
        predicted[block.run] = block.compared(offset + matrix @ scored.beta) / problem.si
        sigma[block.run] = block_sigma(block, fitted.noise, matrix, fitted.beta) / problem.si
    return Held(predicted, sigma)


def comparison(problem: Problem, before: Held, after: Held | None = None) -> pd.DataFrame:
    """Return the held-out runs' rows of comparison.parquet; ``after`` is None before the loop has run."""
    parts = []
    for block in problem.role("validate"):
        measured = block.compared(block.measured) / problem.si
        rows: dict[str, object] = dict.fromkeys(COMPARISON)
        rows |= {
            "observable": problem.observable,
            "run": block.run,
            "unit": problem.unit,
            **block.coordinates,
        }
        rows |= {
            "measured": measured,
            "before": before.predicted[block.run],
            "sigma": before.sigma[block.run],
        }
        if after is not None:
            rows |= {"after": after.predicted[block.run], "sigma": after.sigma[block.run]}
        parts.append(pd.DataFrame(rows, index=range(len(measured))))
    table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(COMPARISON))
    return typed(table)


def typed(table: pd.DataFrame) -> pd.DataFrame:
    """Give the columns of a comparison table their types, in the contract's order."""
    text = ("observable", "run", "axis", "unit")
    return table.reindex(columns=list(COMPARISON)).astype(
        {name: "str" if name in text else "float64" for name in COMPARISON}
    )


def error(rows: pd.DataFrame, column: str, seed: int) -> JSON:
    """Rms and relative rms of measured less predicted, the interval by bootstrap over runs (not samples)."""
    square = (rows["measured"] - rows[column]) ** 2
    by_run = square.groupby(rows["run"]).mean().to_numpy()
    signal = float(np.sqrt((rows["measured"] ** 2).mean()))
    drawn = np.random.default_rng(seed).integers(0, len(by_run), size=(DRAWS, len(by_run)))
    low, high = np.quantile(np.sqrt(by_run[drawn].mean(axis=1)), [0.025, 0.975])
    rms = float(np.sqrt(square.mean()))
    return {"rms": rms, "nrmse": rms / signal if signal > 0 else 0.0, "ci95": [float(low), float(high)]}


def stands(problem: Problem, outcome: Outcome) -> Outcome:
    """Return an outcome whose effects the held-out runs do not speak against: else it has none.

    They do where these runs are predicted worse, and are less likely, with the effects than without. Nothing
    is fitted or chosen by them.
    """
    held = problem.role("validate")
    if not held or not outcome.names:
        return outcome
    before, after = held_out_rms(problem, outcome.base), held_out_rms(problem, outcome.final)
    worse = before is not None and after is not None and after > before
    unlikelier = score(outcome.final, held).total < score(outcome.base, held).total - AGAINST
    return withdrawn(outcome, REFUTED) if worse and unlikelier else outcome


def judge(problem: Problem, outcome: Outcome, rows: pd.DataFrame, gates: Gates) -> JSON:
    """Return the observable's entry of verdict.json."""
    floor = float(np.sqrt((rows["sigma"] ** 2).mean())) if len(rows) else math.nan
    enough = enough_runs(problem)
    remaining, told_by, lines = rest_of(problem, outcome, gates)
    found = outcome.names if enough else ()  # what no held-out run has tested is not claimed
    before = error(rows, "before", gates.seed) if len(rows) else None
    after = error(rows, "after", gates.seed) if len(rows) else None
    return {
        "status": _status(outcome, bool(remaining), enough),
        "unit": problem.unit,
        "noise_floor": floor if math.isfinite(floor) else None,
        "held_out_runs": [block.run for block in problem.role("validate")],
        "before": before,
        "after": after,
        "effects": [_effect(outcome, name) for name in found],
        "candidates": [
            _candidate(problem, trial, why_not(outcome, trial))
            for trial in outcome.trials
            if trial.effect.name not in found
        ],
        "indistinguishable": [list(rival.pair) for rival in outcome.rivals],
        "next_experiment": (
            next_experiment(problem, outcome, remaining, told_by) if enough else more_runs(problem)
        ),
        "unexplained": _unexplained(problem, outcome, rows, remaining, lines) if remaining else None,
    }


def rest_of(problem: Problem, outcome: Outcome, gates: Gates) -> tuple[str, Fit, tuple[Line, ...]]:
    """Describe what is left, if only on held-out runs, with the fit and the lines that tell it."""
    remaining, told_by, lines = left_over(outcome), outcome.final, outcome.lines
    astray = unsettled(outcome.final)
    if astray:  # nothing is claimed of it, least of all that nothing is left
        return "; ".join(filter(None, [remaining, astray])), told_by, lines
    if enough_runs(problem) and not remaining:
        told_by = score(outcome.final, problem.role("validate"))
        lines = _unseen_rest(problem, told_by, gates)
        remaining = f"only on runs that no fit has seen: {in_words(lines)}" if lines else ""
    nowhere = beyond(outcome.final, problem.role("validate"))
    makeshift = f"{MAKESHIFT} {nowhere}" if nowhere else ""
    return "; ".join(filter(None, [remaining, makeshift])), told_by, lines


def _unseen_rest(problem: Problem, scored: Fit, gates: Gates) -> tuple[Line, ...]:
    """Test the rest on the held-out runs, too: a model may be right only where it was fitted."""
    least = max(gates.materiality, 2.0 * problem.systematic, gates.model_form_budget)
    return tuple(line for line in signature(scored, WORSE * least) if line.significant)


def why_not(outcome: Outcome, trial: Trial) -> str:
    """Say why an effect that was tried is not claimed."""
    if trial.effect.name in outcome.names:
        return UNTESTED
    found = [rival.found for rival in outcome.rivals if rival.other == trial.effect.name]
    if found:
        return f"these runs do not tell it from {' and '.join(found).replace('_', ' ')}"
    return trial.why_not or (RESEMBLED if trial.effect.resembled else BEATEN)


def _status(outcome: Outcome, remaining: bool, enough: bool) -> str:
    if not enough:
        return "insufficient"
    if outcome.rivals:
        return "undetermined"
    if outcome.names:
        return "partly_explained" if remaining else "explained"
    return "unexplained" if remaining else "clean"


def _effect(outcome: Outcome, name: str) -> JSON:
    return {
        "effect": name,
        "probability": outcome.probability(name),
        "parameters": parameters(outcome.final, name),
    }


def parameters(fitted: Fit, name: str) -> JSON:
    """Parameters of one effect of a fit with their intervals, in the contract's units; lists as lists."""
    effect, values, deviation = _estimated(fitted, name)
    entries = [
        bounded(parameter, float(value), float(sd), run_dof(fitted))
        for parameter, value, sd in zip(effect.reported, values, deviation, strict=True)
    ]
    return {**effect.where, **by_name(effect.reported, entries)}


def estimates(fitted: Fit, name: str) -> list[JSON]:
    """Parameters of one effect of a fit as they are estimated, with their standard deviations, one by one.

    ``signed``: around the value at which it changes nothing there is room on both sides, for all parameters
    of the effect, so that estimates of what is not there scatter about it (``less_neutral`` is what they
    differ by); no interval is cut off.
    """
    effect, values, deviation = _estimated(fitted, name)
    signed = all(p.period is None and p.lower < p.neutral < p.upper for p in effect.reported)
    entries: list[JSON] = []
    for parameter, value, sd in zip(effect.reported, values.tolist(), deviation.tolist(), strict=True):
        entries.append(
            {
                "parameter": parameter.name,
                "index": sum(entry["parameter"] == parameter.name for entry in entries),
                "value": value,
                "sd": finite(sd),
                "unit": parameter.unit,
                "less_neutral": value - parameter.neutral,
                "signed": signed,
                "inside": bool(parameter.lower < value < parameter.upper),
                "angle": parameter.period is not None,
            }
        )
    return entries


def _estimated(fitted: Fit, name: str) -> tuple[Effect, Array, Array]:
    """Return an effect of a fit, with the values of the contract (v,) and their standard deviations."""
    p = len(fitted.beta)
    for effect, place in fitted.candidate.parts(fitted.theta):
        if effect.name != name:
            continue
        values = effect.matrix @ fitted.theta[place]
        covariance = fitted.covariance[p:, p:][place, place]
        # An infinite variance stays one: a product with zeros would make it undefined.
        variance = [
            float(row[row != 0] @ covariance[np.ix_(row != 0, row != 0)] @ row[row != 0])
            for row in effect.matrix
        ]
        return effect, values, np.sqrt(np.maximum(variance, 0.0) * fitted.dispersion)
    raise KeyError(name)


def bounded(parameter: EffectParameter, value: float, deviation: float, dof: float) -> JSON:
    """Write an effect's parameter: its interval within the bounds, that of an angle within its period.

    ``told`` is false, and otherwise absent, where that is all that the parameter may be.
    """
    entry = quantity(value, deviation, parameter.unit, dof)
    low, high = entry["ci95"]
    if low is None:
        return entry | {"told": False}
    if parameter.period is None:
        entry["ci95"] = [max(low, parameter.lower), min(high, parameter.upper)]
        told = low > parameter.lower or high < parameter.upper
    else:
        half = min(0.5 * (high - low), 0.5 * parameter.period)
        entry["ci95"] = [value - half, value + half]
        told = high - low < parameter.period
    return entry if told else entry | {"told": False}


def identified_fit(problem: Problem, fitted: Fit) -> BaseFit:
    """Return the base parameters of a fit, with the unknowns of the held-out runs beside those of its own."""
    held, fitted = problem.role("validate"), polished(fitted)
    nuisance = {**fitted.nuisance, **(score(fitted, held).nuisance if held else {})}
    p = len(fitted.beta)
    covariance = fitted.covariance[:p, :p] * fitted.dispersion
    return BaseFit(fitted.beta, covariance, run_dof(fitted), nuisance)


def run_dof(fitted: Fit) -> float:
    """Degrees of freedom of intervals: runs (and load tests) less one; a sample is no evidence of its own."""
    return float(max(1, len(fitted.blocks) - 1))


def _candidate(problem: Problem, trial: Trial, why_not: str) -> JSON:
    return {
        "effect": trial.effect.name,
        "probability": trial.weight,
        "held_out_rms": held_out_rms(problem, trial.fit),
        "held_out_gain": gain(trial),
        "p_value": trial.evidence.p_value,
        "size": trial.evidence.size,
        "why_not": why_not,
    }


def gain(trial: Trial) -> float | None:
    """Return what conditions left out gain by a trial; None where that was not worth computing."""
    return finite(trial.evidence.gain) if trial.evidence.held_out else None


def held_out_rms(problem: Problem, fitted: Fit) -> float | None:
    """Error of a fit on the held-out runs, rms in the problem's unit; None without such runs."""
    rows = comparison(problem, held_out(problem, fitted))
    return float(np.sqrt(((rows["measured"] - rows["before"]) ** 2).mean())) if len(rows) else None


def finite(value: float) -> float | None:
    """Return the value, or None where it is not a finite number (JSON has none)."""
    return value if math.isfinite(value) else None


def _unexplained(
    problem: Problem, outcome: Outcome, rows: pd.DataFrame, words: str, lines: Sequence[Line]
) -> JSON:
    """Describe the rest; its size is the share left on the runs that tell of it, of the held-out signal."""
    whole = [abs(found.relative) for found in (outcome.step, outcome.between, outcome.restless) if found]
    share = max(share_left(lines), *whole) if whole else share_left(lines)
    over = share * float(np.sqrt((rows["measured"] ** 2).mean())) if len(rows) and share else None
    if outcome.likeness and len(rows):
        words += (
            f"; with that the error would be {held_out_rms(problem, outcome.likeness):.3g} "
            f"{printed(problem.unit)} rms"
        )
    return {"rms": over, "unit": problem.unit, "signature": words}
