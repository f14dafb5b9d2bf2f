"""What is always there of an effect, and whether there is enough of it to be listed beside what is hidden."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import Parameters
from virtual_cell.units import Array

LEAST = 5.0  # of log-likelihood: with less no reader of all readings could tell it from none
_OWN = 0.5  # of the mean square of what a thing does: most of it is of the effect's form


@dataclass(frozen=True)
class Term:
    """Parameters of an effect as the contract has them.

    ``size``: rms of what they make of a reading, over its noise. ``gain``: of the log-likelihood of all
    readings, by knowing it. ``rest``: share of the mean square of what the thing does that they do not make.
    """

    parameters: Parameters
    size: float
    gain: float
    rest: float

    @property
    def present(self) -> bool:
        """Whether it is large enough to be seen, and what the thing does is mostly this."""
        return self.gain >= LEAST and self.rest <= _OWN


def term(parameters: Parameters, does: Array, told: Array, noise: float, readings: float) -> Term:
    """Compare what a thing does to readings, (n,) or (n, m), with what its parameters make of them.

    ``noise``: standard deviation of a reading, in their unit. ``readings``: how many have a noise of their
    own, of those that ``does`` and ``told`` are a sample of.
    """
    whole = float(np.mean(does**2))
    rest = float(np.mean((does - told) ** 2)) / whole if whole > 0.0 else 1.0
    size = float(np.sqrt(np.mean(told**2))) / noise
    return Term(parameters, size, 0.5 * readings * size**2, rest)


def listed(
    terms: Mapping[str, Iterable[Term]], hidden: Mapping[str, Parameters]
) -> dict[str, list[Parameters]]:
    """Return, by effect, the parameters of what is there of it, but for what is hidden on purpose.

    Of an effect of single joints a hidden one excludes its own joint alone.
    """
    found: dict[str, list[Parameters]] = {}
    for name, some in terms.items():
        own = [one.parameters for one in some if one.present]
        own = [one for one in own if name not in hidden or one.get("joint") != hidden[name].get("joint")]
        found |= {name: own} if own else {}
    return found
