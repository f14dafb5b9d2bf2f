"""What is believed of the instruments beforehand, and where a fit without and with the effects puts it."""

from __future__ import annotations

import numpy as np

from metro.loop.fitting.fit import Fit
from metro.loop.search.outcome import Outcome
from metro.loop.statement import Statement
from metro.units import JSON

FAR = 3.0  # standard deviations from what is believed, from which it is reported


def beliefs(outcome: Outcome) -> list[JSON]:
    """Return each base parameter of which something is believed: its deviation there, and in both fits."""
    before, after = _estimates(outcome.base), _estimates(outcome.final)
    return [
        {"name": name, "unit": unit, "sd": sd, "before": value, "after": after[name, unit, sd]}
        for (name, unit, sd), value in before.items()
        if (name, unit, sd) in after
    ]


def strained(entries: list[JSON], outcome: Outcome) -> Statement | str:
    """State which of these a fit puts far from what is believed; nothing where none is."""
    far = [one for one in entries if max(abs(one["before"]), abs(one["after"])) > FAR * one["sd"]]
    if not far:
        return ""
    far.sort(key=lambda one: -max(abs(one["before"]), abs(one["after"])) / one["sd"])
    return Statement("strained", {"far": far, "effects": list(outcome.names), "limit": FAR})


def _estimates(fitted: Fit) -> dict[tuple[str, str, float], float]:
    """Estimates less what is believed, in their units, by name, unit and standard deviation."""
    model, found = fitted.candidate.model(fitted.theta), {}
    parameters = fitted.candidate.base.parameters
    for block in fitted.blocks:
        if block.belief:
            rows, _ = model.design(block, fitted.nuisance[block.run], fitted.beta)
            for place, known, sd in zip(
                np.abs(rows).argmax(axis=1), block.measured, block.sigma, strict=True
            ):
                one = parameters[place]
                off = float(fitted.beta[place]) - float(known)
                found[one.name, one.unit, float(sd) / one.si] = off / one.si
    return found
