"""Verification: the final model on the runs that neither a fit nor a decision has seen.

Which effects are named is settled before: these runs decide no cause. Where they contradict the model, the
status says that something remains, and effects are believed as far as they explain these runs.
"""

from __future__ import annotations

import pandas as pd

from metro.loop.checks.floor import ABOVE, AgainstFloor, against_floor
from metro.loop.checks.left_out import scored_unseen, unseen
from metro.loop.search.outcome import Outcome
from metro.loop.search.settled import beyond
from metro.loop.statement import Statement
from metro.observables.problem import Block, Problem
from metro.units import JSON

WHENS = ("before", "after")
WORSE = 1.1  # times the error without effects: a run that is predicted worse with them by more is named


def held_out_error(problem: Problem, outcome: Outcome) -> AgainstFloor | None:
    """Compare the error of the final model on the held-out runs with the noise floor; None without any."""
    groups: dict[str, list[Block]] = {}
    for block in problem.role("validate"):
        groups.setdefault(block.condition, []).append(block)
    scored = [scored_unseen(outcome.final, blocks) for blocks in groups.values()]
    return against_floor(scored, noise_scale(outcome))


def verification(problem: Problem, outcome: Outcome, rows: pd.DataFrame, error: AgainstFloor) -> JSON:
    """Say how the final model does on the held-out runs, and whether better than without any effect.

    Parameters
    ----------
    rows : of the comparison. error : of :func:`held_out_error`.

    Returns
    -------
    JSON
        ``ratio`` of the error to the floor with the errors of the parameters, ``freedom``: of how many
        independent values it is the mean, ``p_value`` of one as large by noise alone, ``holds``: whether it
        is not beyond chance, ``worse_runs`` that the effects make worse, ``words``: all that as a statement.
    """
    holds = error.p_value >= ABOVE
    worse = _worse(rows) if outcome.names else []
    before, after = (float(((rows["measured"] - rows[when]) ** 2).mean() ** 0.5) for when in WHENS)
    without = beyond(outcome.final, problem.role("validate"))
    values = {
        "runs": len(problem.role("validate")),
        "conditions": len({block.condition for block in problem.role("validate")}),
        "ratio": error.ratio,
        "p_value": error.p_value,
        "holds": holds,
        "condition": error.condition,
        "worse_runs": worse,
        "grew": [before, after] if outcome.names and after > before else None,
        "unit": problem.unit,
        "without": without,
    }
    return {
        "ratio": error.ratio,
        "freedom": error.freedom,
        "p_value": error.p_value,
        "holds": holds,
        "worse_runs": worse,
        "words": Statement("verification", values),
    }


def lowered_by_held_out(verdict: JSON) -> JSON:
    """Believe the effects of a verdict no more than they explain of the held-out runs, which contradict it.

    As a residual of the identification runs does, theirs may be of an unknown cause of the same signature.
    """
    noise = verdict["noise_floor"] or 0.0
    whole, left = (max(0.0, verdict[when]["rms"] ** 2 - noise**2) for when in WHENS)
    explained = 1.0 - min(1.0, left / whole) if whole else 0.0
    effects = [
        {**one, "probability": one["probability"] * explained, "lowered": _lowered(one, explained)}
        for one in verdict["effects"]
    ]
    return {**verdict, "effects": effects, "unexplained": {**verdict["unexplained"], "held_out_only": True}}


def _lowered(effect: JSON, explained: float) -> Statement:
    values = {"effect": effect["effect"], "weight": effect["probability"], "explained": explained}
    return Statement("lowered", {**values, "held_out": True})


def noise_scale(outcome: Outcome) -> float:
    """Return the factor on the declared noise that the left-out conditions of the identification show."""
    error = against_floor(unseen(outcome.final, outcome.prior))
    return error.scale if error else 1.0


def _worse(rows: pd.DataFrame) -> list[JSON]:
    """Return the runs that are predicted worse with the effects than without, and their errors."""
    square = pd.DataFrame(
        {
            "run": rows["run"],
            "before": (rows["measured"] - rows["before"]) ** 2,
            "after": (rows["measured"] - rows["after"]) ** 2,
        }
    )
    by_run = square.groupby("run").mean() ** 0.5
    return [
        {"run": str(run), "before": before, "after": after}
        for run, before, after in zip(by_run.index, by_run["before"], by_run["after"], strict=True)
        if after > WORSE * before
    ]
