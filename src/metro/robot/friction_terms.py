"""What the friction of a joint has beyond Coulomb and viscous: by speed, by load, by time.

Candidates are added one at a time, that with the largest statistic first, and only where two things agree:
the statistic of its coefficient (jackknife) is beyond chance for as many candidates as were tried, and
stretches of the log that were held out are predicted better with it. What passes is claimed as a change of
the torque, with its error; what does not is not mentioned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.determined import STRETCHES, solve
from metro.units import Array

LEVEL = 0.01  # probability by chance of any one further term in a joint without them
SPEEDS = (0.03, 0.06, 0.12, 0.25, 0.5)  # of the joint's fastest, at which a Stribeck curve may have fallen
FOLDS = 6  # parts of the log, each held out once
MOST = 3


@dataclass(frozen=True, eq=False)
class Term:
    """A further term of a joint's friction.

    Attributes
    ----------
    name : speed (falls off as exp(−|q̇|/v)), load (grows with the torque of the links), time (along the log).
    value, sd : of its coefficient: torque at standstill beyond Coulomb; torque per torque of the links;
        change of the Coulomb level over the log. scale : v, rad/s, of the term of speed, else NaN.
    p : probability of its statistic by chance, candidates counted.
    held_out : rms of held-out stretches with it over that without.
    """

    name: str
    value: float
    sd: float
    scale: float
    p: float
    held_out: float


def further_terms(
    columns: Array, torque: Array, stretch: np.ndarray, rigid: Array, rate: Array
) -> tuple[Term, ...]:
    """Return the terms that the moving samples (m,) of a joint show.

    Parameters
    ----------
    columns : (m, p) of the fit; the first is the sign of the speed. stretch : (m,) int.
    rigid : (m,) torque of the links by that fit. rate : (m,) rad/s.
    """
    from scipy.stats import t as student

    sign, time = columns[:, 0], stretch / STRETCHES - 0.5
    fastest = float(np.abs(rate).max())
    candidates = {("speed", s * fastest): sign * np.exp(-np.abs(rate) / (s * fastest)) for s in SPEEDS}
    candidates |= {("load", np.nan): sign * np.abs(rigid), ("time", np.nan): sign * time}
    tried = len(candidates)
    found: list[Term] = []
    for _ in range(MOST):
        best: tuple[float, tuple[str, float], Array] | None = None
        for key, column in candidates.items():
            value, sd = _coefficient(columns, column, torque, stretch)
            if np.isfinite(value) and sd > 0.0 and (best is None or abs(value) / sd > best[0]):
                best = abs(value) / sd, key, column
        if best is None:
            break
        p = min(1.0, tried * 2.0 * float(student.sf(best[0], STRETCHES - 1)))
        ratio = _held_out(columns, best[2], torque, stretch)
        if p > LEVEL or ratio >= 1.0:
            break
        name, scale = best[1]
        value, sd = _coefficient(columns, best[2], torque, stretch)
        found.append(Term(name, value, sd, scale, p, ratio))
        columns = np.column_stack([columns, best[2]])
        candidates = {key: column for key, column in candidates.items() if key[0] != name}
    return tuple(found)


def _coefficient(
    columns: Array, column: Array, torque: Array, stretch: np.ndarray
) -> tuple[float, float]:
    """Coefficient of one more column, and its error; NaN where it is not determined."""
    size = np.zeros(columns.shape[1] + 1)
    size[-1] = 1.0
    return solve(np.column_stack([columns, column]), torque, stretch).combination(size)


def _held_out(columns: Array, column: Array, torque: Array, stretch: np.ndarray) -> float:
    """Rms of held-out parts of the log with one more column, over that without."""
    fold = stretch * FOLDS // STRETCHES
    square = []
    for some in (columns, np.column_stack([columns, column])):
        scale = np.maximum(np.linalg.norm(some, axis=0), np.finfo(float).tiny)
        left = 0.0
        for part in np.unique(fold):
            out = fold == part
            value = np.linalg.lstsq(some[~out] / scale, torque[~out], rcond=1e-6)[0]
            left += float(np.sum((torque[out] - some[out] / scale @ value) ** 2))
        square.append(left)
    return float(np.sqrt(square[1] / square[0])) if square[0] > 0.0 else 1.0
