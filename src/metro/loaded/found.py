"""The effects that a verdict names, put back on a model, and what is known of their parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from metro.effects.effect import Effect
from metro.effects.library import library
from metro.report.sections.trust import do_not_use
from metro.units import JSON

COVERAGE = 1.959963984540054  # half of a 95 % interval in standard deviations


@dataclass(frozen=True)
class Found:
    """An effect that a verdict names.

    Attributes
    ----------
    effect : of the library.
    values : of its parameters, in the units of the contract; what a list holds per axis or tooth is a list.
    deviations : their standard deviations, likewise; 0 where the verdict has no interval.
    """

    effect: Effect
    values: Mapping[str, Any]
    deviations: Mapping[str, Any]

    def applied(self, model: Any) -> Any:
        """Return a model with the effect as it was found."""
        return self.effect.apply(model, dict(self.values))

    def drawn(self, model: Any, rng: np.random.Generator) -> Any:
        """Return a model with the effect as it may be: each parameter drawn from its interval."""
        drawn = {
            name: (np.array(value) + rng.standard_normal(np.shape(value)) * self.deviations[name]).tolist()
            for name, value in self.values.items()
        }
        return self.effect.apply(model, drawn)


def found(entry: JSON, observable: str) -> tuple[list[Found], list[str]]:
    """Return the effects of a verdict that a prediction has, and notes: why others are left out.

    An effect of the instrument alone changes what is measured and not what happens: a prediction has none.
    The first note is that predictions are not to be used, where the verdict says so.

    Parameters
    ----------
    entry : of the observable in ``verdict.json``.
    """
    known = library(observable)
    taken: list[Found] = []
    warning = do_not_use(entry)
    left_out = [warning] if warning else []
    for each in entry.get("effects") or []:
        name, parameters = str(each["effect"]), each.get("parameters") or {}
        effect = next(
            (one for one in known if one.name == name and _of_the_place(one, parameters)),
            None,
        )
        words = name.replace("_", " ")
        numbers = {
            key: _numbers(value) for key, value in parameters.items() if effect and key in effect.names
        }
        if effect is None:
            left_out.append(f"{words} is not included: the library has no effect of this name and place")
        elif set(effect.belongs_to) == {"instrument"}:
            left_out.append(f"{words} is not included: it changes the reading, not the quantity")
        elif any(None in np.ravel(values).tolist() for values, _ in numbers.values()):
            left_out.append(f"{words} is not included: not all of its parameters could be determined")
        else:
            values, deviations = ({key: pair[i] for key, pair in numbers.items()} for i in (0, 1))
            taken.append(Found(effect, values, deviations))
    return taken, left_out


def _of_the_place(effect: Effect, parameters: JSON) -> bool:
    """Return whether a form of an effect is at the place (the joint) that the verdict names."""
    return all(parameters.get(key) == value for key, value in effect.where.items())


def _numbers(parameter: Any) -> tuple[Any, Any]:
    """Return value and standard deviation of a parameter, lists of a list."""
    if isinstance(parameter, list):
        values, deviations = zip(*map(_numbers, parameter), strict=True)
        return list(values), list(deviations)
    return parameter["value"], next(_deviations(parameter.get("ci95")), 0.0)


def _deviations(ends: Any) -> Iterator[float]:
    """Yield the standard deviation that an interval stands for, if it has both ends."""
    if ends and None not in ends:
        yield (ends[1] - ends[0]) / (2.0 * COVERAGE)
