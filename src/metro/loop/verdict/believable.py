"""When nothing is attributed: the data contradict the batch, or the model misses half of them."""

from __future__ import annotations

import math

from metro.loop.checks.floor import against_floor
from metro.loop.checks.left_out import unseen
from metro.loop.search.outcome import Outcome, withdrawn
from metro.loop.statement import Statement
from metro.units import JSON

HALF = 0.5  # of the signal, beyond the noise: a base model that misses more is not one of this cut


def believable(outcome: Outcome) -> Outcome:
    """Return the outcome, without its effects where even with these the model misses half of the signal.

    The effects of the library are changes of a model that is right in the main. Judged on conditions that are
    left out of the fit, beyond their noise.
    """
    if not outcome.names:
        return outcome
    error = against_floor(unseen(outcome.final, outcome.prior))
    if error is None or error.relative <= HALF:
        return outcome
    return withdrawn(outcome, Statement("misses_half", {"share": error.relative}))


def with_share(verdict: JSON) -> JSON:
    """Return an observable's verdict, with the share of the signal that is missed where it is over half."""
    after, floor = verdict["after"], verdict["noise_floor"] or 0.0
    if not after or not after["rms"] or verdict["unit"] == "1":
        return verdict
    share = after["nrmse"] * math.sqrt(max(after["rms"] ** 2 - floor**2, 0.0)) / after["rms"]
    return {**verdict, "misses": share} if share > HALF else verdict


def contradicted(verdict: JSON) -> JSON:
    """Return an observable's verdict where a contradiction was found: no cause, correct the batch first."""
    return {
        **{name: value for name, value in verdict.items() if name != "traces"},
        "status": "unexplained",
        "effects": [],
        "indistinguishable": [],
        "contradicted": True,
        "next_experiment": Statement("correct_first"),
        "unexplained": {"rms": None, "unit": verdict["unit"], "signature": Statement("contradiction")},
    }
