"""What the friction of a joint has beyond Coulomb and viscous: by speed, by load, by time.

Candidates are added one at a time, that with the largest statistic first, and only where two things agree:
the statistic of its coefficient (jackknife) is beyond chance for as many candidates as were tried, and
stretches of the log that were held out are predicted better with it. What passes is claimed as a change of
the torque, with its error; what does not is not mentioned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.determined import RANK, STRETCHES, solve
from metro.units import Array

LEVEL = 0.01  # probability by chance of any one further term in a joint without them
SPEEDS = (0.03, 0.06, 0.12, 0.25, 0.5)  # of the joint's fastest, at which a Stribeck curve may have fallen
FOLDS = 6  # parts of the log, each held out once
MOST = 3
TURNS = 6  # of the torque of the links and the friction that it makes


@dataclass(frozen=True, eq=False)
class Term:
    """A further term of a joint's friction.

    Attributes
    ----------
    name : speed (falls off as exp(−|q̇|/v)), load (grows with the torque of the links), time (along the log).
    value, sd : of speed, rms of what differs from the line of Coulomb and viscous friction, above zero where
        friction at rest is above that line; of load, torque per torque of the links; of time, change of the
        Coulomb level over the log. scale : v over the joint's fastest speed, of the term of speed, else NaN.
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
    columns: Array, torque: Array, stretch: np.ndarray, links: slice, rate: Array
) -> tuple[Term, ...]:
    """Return the terms that the moving samples (m,) of a joint show.

    Parameters
    ----------
    columns : (m, p) of the fit; the first is the sign of the speed. stretch : (m,) int.
    links : which of the columns are the links'. rate : (m,) rad/s.
    """
    from scipy.stats import t as student

    sign, time = columns[:, 0], stretch / STRETCHES - 0.5
    fastest = float(np.abs(rate).max())
    candidates = {("speed", s * fastest): sign * np.exp(-np.abs(rate) / (s * fastest)) for s in SPEEDS}
    candidates |= {("load", np.nan): sign, ("time", np.nan): sign * time}
    tried = len(candidates)
    found: list[Term] = []
    while candidates and len(found) < MOST:
        best: tuple[float, tuple[str, float], Array] | None = None
        if ("load", np.nan) in candidates:
            candidates["load", np.nan] = _loaded(columns, torque, stretch, links)
        for key, column in candidates.items():
            value, sd = _coefficient(columns, column, torque, stretch)
            if key[0] == "load" and value < 0.0:
                continue  # a gear loses power, and never gives any
            if np.isfinite(value) and sd > 0.0 and (best is None or abs(value) / sd > best[0]):
                best = abs(value) / sd, key, column
        if best is None:
            break
        name, scale = best[1]
        value, sd = _coefficient(columns, best[2], torque, stretch)
        if name == "load":
            sd = _error_of_load(columns, torque, stretch, links)
        p = min(1.0, tried * 2.0 * float(student.sf(abs(value) / sd, STRETCHES - 1)))
        ratio = _held_out(columns, best[2], torque, stretch)
        rest = {key: column for key, column in candidates.items() if key[0] != name}
        if p > LEVEL or ratio >= 1.0:
            if name != "load":
                break
            candidates = rest  # what it is cannot be said: others may still be seen
            continue
        size = _beyond_a_line(best[2], sign, rate) if name == "speed" else 1.0
        found.append(Term(name, value * size, sd * size, scale / fastest, p, ratio))
        columns, candidates = np.column_stack([columns, best[2]]), rest
    return tuple(found)


def _loaded(columns: Array, torque: Array, stretch: np.ndarray, links: slice) -> Array:
    """Return the column of friction that grows with the torque of the links, (m,).

    That torque is only known with this friction taken away: what it is, and what it would be without, are
    found in turns.
    """
    sign, more = columns[:, 0], np.zeros((len(columns), 0))
    loaded = np.zeros(len(columns))
    for _ in range(TURNS):
        values = solve(np.column_stack([columns, more]), torque, stretch).value
        loaded = sign * np.abs(columns[:, links] @ values[: columns.shape[1]][links])
        more = loaded[:, None]
    return loaded


def _error_of_load(columns: Array, torque: Array, stretch: np.ndarray, links: slice) -> float:
    """Return the error of the term of load, by a jackknife that finds the links' torque anew."""
    values = []
    for each in np.unique(stretch):
        kept = stretch != each
        part, load = columns[kept], torque[kept]
        column = _loaded(part, load, stretch[kept], links)
        both = np.column_stack([part, column])
        scale = np.maximum(np.linalg.norm(both, axis=0), np.finfo(float).tiny)
        values.append(np.linalg.lstsq(both / scale, load, rcond=RANK)[0][-1] / scale[-1])
    return float(np.sqrt((len(values) - 1) * np.var(values)))


def _beyond_a_line(column: Array, sign: Array, rate: Array) -> float:
    """Rms of what a column has beyond Coulomb and viscous friction."""
    line = np.column_stack([sign, rate])
    left = column - line @ np.linalg.lstsq(line, column, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)))


def _coefficient(columns: Array, column: Array, torque: Array, stretch: np.ndarray) -> tuple[float, float]:
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
