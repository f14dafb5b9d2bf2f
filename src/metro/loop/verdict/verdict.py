"""The verdict on an observable: what is claimed, how sure, and the error on runs that no fit has seen."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.effects.effect import Effect, EffectParameter, by_name
from metro.loop.ceiling import ceiling
from metro.loop.checks.signature import share_left
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.held_out import comparison, held_out, run_dof
from metro.loop.search.outcome import Outcome
from metro.loop.search.trial import Gates, Trial
from metro.loop.statement import Statement
from metro.loop.verdict.advice import more_runs, next_experiment
from metro.loop.verdict.residual import Residual, enough_runs, residual_of
from metro.loop.verdict.verification import held_out_error, lowered_by_held_out, verification
from metro.observables.problem import Problem
from metro.observables.quantity import quantity
from metro.units import JSON, Array

DRAWS = 2000  # of runs, for intervals of errors; of labels, for the p-value of those held out
SETTLED = ("clean", "explained")  # statuses by which nothing more is missing
LOWERED = 0.01  # by which an unexplained residual lowers a probability: below, no printed digit shows it


def error(rows: pd.DataFrame, column: str, seed: int) -> JSON:
    """Rms and relative rms of measured less predicted, the interval by bootstrap over runs (not samples)."""
    square = (rows["measured"] - rows[column]) ** 2
    by_run = square.groupby(rows["run"]).agg(["sum", "count"]).to_numpy(float)
    signal = float(np.sqrt((rows["measured"] ** 2).mean()))
    drawn = np.random.default_rng(seed).integers(0, len(by_run), size=(DRAWS, len(by_run)))
    total, count = by_run[drawn].sum(axis=1).T
    low, high = np.quantile(np.sqrt(total / count), [0.025, 0.975])
    rms = float(np.sqrt(square.mean()))
    return {"rms": rms, "nrmse": rms / signal if signal > 0 else 0.0, "ci95": [float(low), float(high)]}


def widened(figures: JSON, freedom: float) -> JSON:
    """Return an error with an interval no narrower than that of a mean of ``freedom`` independent squares.

    Two or three runs may agree by chance, which makes the bootstrap's interval as narrow as one likes.
    """
    from scipy.stats import chi2

    low, high = (figures["rms"] * math.sqrt(freedom / chi2.ppf(at, freedom)) for at in (0.975, 0.025))
    ends = figures["ci95"]
    return {**figures, "ci95": [min(ends[0], low), max(ends[1], high)]}


def judge(problem: Problem, outcome: Outcome, rows: pd.DataFrame, gates: Gates) -> JSON:
    """Return the observable's entry of verdict.json, with statements where that has sentences."""
    floor = float(np.sqrt((rows["sigma"] ** 2).mean())) if len(rows) else math.nan
    enough = enough_runs(problem)
    error_held_out = held_out_error(problem, outcome)
    residual = residual_of(problem, outcome, gates, error_held_out)
    claimed = outcome.names if enough else ()  # what no held-out run has tested is not claimed
    verified = verification(problem, outcome, rows, error_held_out) if error_held_out else None
    before, after = (
        widened(error(rows, name, gates.seed), verified["freedom"]) if verified else None
        for name in ("before", "after")
    )
    status = _status(outcome, bool(residual.parts), enough)
    below = traces(outcome, gates.materiality) if status in SETTLED else None
    verdict = {
        "status": status,
        "unit": problem.unit,
        "noise_floor": floor if math.isfinite(floor) else None,
        "held_out_runs": [block.run for block in problem.role("validate")],
        "before": before,
        "after": after,
        "verification": verified,
        "effects": [_effect(outcome, name) for name in claimed],
        "candidates": [
            _candidate(problem, trial, why_not(outcome, trial))
            for trial in outcome.trials
            if trial.effect.name not in claimed
        ],
        "indistinguishable": [list(pair) for pair in dict.fromkeys(rival.pair for rival in outcome.rivals)],
        "next_experiment": (next_experiment(problem, outcome, residual) if enough else more_runs(problem)),
        "unexplained": _unexplained(problem, outcome, rows, residual) if residual.parts else None,
        **({"traces": below} if below else {}),
    }
    return lowered_by_held_out(verdict) if residual.held_out else verdict


def traces(outcome: Outcome, materiality: float) -> Statement | None:
    """Return which effects are significant but smaller than what errors of the model's inputs may cause.

    None of them is claimed, since such an error may look like any of them: where nothing was hidden, they
    are significant, too. That they are there is said all the same, but of none that is named in another form.
    ``materiality``: below it, nothing is.
    """
    small = {
        trial.effect.name: trial.why_not.values
        for trial in outcome.trials
        if trial.why_not and trial.why_not.code == "immaterial"
        if not trial.effect.resembled and trial.effect.name not in outcome.names
    }
    seen = [{"effect": name, **sizes} for name, sizes in small.items() if sizes["size"] >= materiality]
    return Statement("traces", {"seen": seen}) if seen else None


def why_not(outcome: Outcome, trial: Trial) -> Statement:
    """Return why an effect that was tried is not claimed."""
    if trial.effect.name in outcome.names:
        return Statement("untested")
    chosen = dict.fromkeys(rival.effect for rival in outcome.rivals if rival.other == trial.effect.name)
    if chosen:
        return Statement("confounded", {"effects": list(chosen)})
    return trial.why_not or Statement("resembled" if trial.effect.resembled else "beaten")


def _status(outcome: Outcome, remaining: bool, enough: bool) -> str:
    if not enough:
        return "insufficient"
    if outcome.rivals:
        return "undetermined"
    if outcome.names:
        return "partly_explained" if remaining else "explained"
    return "unexplained" if remaining else "clean"


def _effect(outcome: Outcome, name: str) -> JSON:
    weight, explained = outcome.weight[name], outcome.explained
    lowered = Statement("lowered", {"effect": name, "weight": weight, "explained": explained})
    return {
        "effect": name,
        "probability": outcome.probability(name),
        **({"lowered": lowered} if weight * (1.0 - explained) > LOWERED else {}),
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
        covariance = fitted.covariance[p:, p:][place, place] * np.outer(*[fitted.wider[place]] * 2)
        # An infinite variance stays one: a product with zeros would make it undefined.
        variance = [
            float(row[row != 0] @ covariance[np.ix_(row != 0, row != 0)] @ row[row != 0])
            for row in effect.matrix
        ]
        return effect, values, np.sqrt(np.maximum(variance, 0.0) * fitted.dispersion)
    raise KeyError(name)


def bounded(parameter: EffectParameter, value: float, deviation: float, dof: float) -> JSON:
    """Write an effect's parameter: its interval within the bounds, that of an angle within its period.

    ``told`` is false where the interval is the whole range of the parameter, and absent otherwise.
    """
    entry = quantity(value, deviation, parameter.unit, dof)
    low, high = entry["ci95"]
    if low is None:
        return entry | {"told": False}
    if parameter.period is None:
        entry["ci95"] = [max(low, parameter.lower), min(high, parameter.upper)]
        identified = low > parameter.lower or high < parameter.upper
    else:
        half = min(0.5 * (high - low), 0.5 * parameter.period)
        entry["ci95"] = [value - half, value + half]
        identified = high - low < parameter.period
    return entry if identified else entry | {"told": False}


def _candidate(problem: Problem, trial: Trial, why_not: Statement) -> JSON:
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


def _unexplained(problem: Problem, outcome: Outcome, rows: pd.DataFrame, residual: Residual) -> JSON:
    """Return the residual; its size is the share left on the runs that show it, of the held-out signal."""
    whole = [abs(change.relative) for change in (outcome.step, outcome.between, outcome.restless) if change]
    whole += [residual.held_out.relative] if residual.held_out else []
    lines = residual.lines
    share = max(share_left(lines), *whole) if whole else share_left(lines)
    over = share * float(np.sqrt((rows["measured"] ** 2).mean())) if len(rows) and share else None
    statement = residual.statement
    if outcome.likeness and len(rows):
        rms = held_out_rms(problem, outcome.likeness)
        statement = Statement(
            "residual_and_likeness", {"residual": statement, "rms": rms, "unit": problem.unit}
        )
    return {
        "rms": over,
        "unit": problem.unit,
        "signature": statement,
        "ceiling": ceiling(problem, outcome.base),
    }
