"""What the friction of a joint has beyond Coulomb and viscous: by speed, load, and temperature or time.

Candidates are added one at a time, that with the largest statistic first, and only where two things agree:
the statistic of its coefficient (jackknife) is beyond chance for as many candidates as were tried, and
parts of the log that were held out agree that they are predicted better with it. What passes is claimed as a
change of the torque, with its error; what does not is not mentioned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.determined import RANK, STRETCHES, solve
from metro.units import Array

LEVEL = 0.01  # probability by chance of any one further term in a joint without them
SPEEDS = (0.03, 0.06, 0.12, 0.25, 0.5)  # of the joint's fastest, at which a Stribeck curve may have fallen
FOLDS = 6  # parts of the log, each held out once
MOST = 4
WARMING = 1.0  # K that a joint must have warmed by, to show more than the time does
TURNS = 6  # of the torque of the links and the friction that it makes

Key = tuple[str, float]


@dataclass(frozen=True, eq=False)
class Term:
    """A further term of a joint's friction.

    Attributes
    ----------
    name : speed (falls off as exp(−|q̇|/v)), load (grows with the torque of the links), time (Coulomb level
        along the log), temperature (Coulomb level by that of the joint), and viscous_time and
        viscous_temperature (viscous friction likewise).
    value, sd : of speed, rms of what differs from the line of Coulomb and viscous friction, above zero where
        friction at rest is above that line; of load, torque per torque of the links; of time, change over
        the log; of temperature, per kelvin.
    scale : v over the joint's fastest speed, of the term of speed, else NaN.
    p : probability of its statistic by chance, candidates counted.
    held_out : rms of held-out stretches with it over that without.
    """

    name: str
    value: float
    sd: float
    scale: float
    p: float
    held_out: float


@dataclass(frozen=True, eq=False)
class Samples:
    """The moving samples (m,) of a joint.

    Attributes
    ----------
    columns : (m, p) of the fit; the first is the sign of the speed. torque : (m,). stretch : (m,) int.
    links : which of the columns are the links'. rate : (m,) rad/s. warmth : (m,) °C of the joint; None where
        it was not logged.
    """

    columns: Array
    torque: Array
    stretch: np.ndarray
    links: slice
    rate: Array
    warmth: Array | None = None

    @property
    def candidates(self) -> list[Key]:
        """Return the terms that may be there: name and, of a curve of speed, its v in rad/s.

        Grease gets thinner as it warms, which changes both levels; without a temperature it warms with time.
        """
        by = "time" if self.warmth is None or np.ptp(self.warmth) < WARMING else "temperature"
        fastest = float(np.abs(self.rate).max())
        curves = [("speed", share * fastest) for share in SPEEDS]
        return [*curves, ("load", np.nan), (by, np.nan), (f"viscous_{by}", np.nan)]

    def column(self, key: Key, more: Array) -> Array:
        """Return the column (m,) of a term beside ``more`` (m, k), the columns of those that were found."""
        name, scale = key
        sign = self.columns[:, 0]
        if name == "speed":
            return np.asarray(sign * np.exp(-np.abs(self.rate) / scale))
        if name == "load":
            return _loaded(np.column_stack([self.columns, more]), self.torque, self.stretch, self.links)
        by = self.warmth if name.endswith("temperature") else self.stretch / STRETCHES - 0.5
        assert by is not None  # else there were no such candidate
        return np.asarray((self.rate if name.startswith("viscous") else sign) * (by - np.mean(by)))


def further_terms(joint: Samples) -> tuple[Term, ...]:
    """Return the terms that the moving samples of a joint show."""
    from scipy.stats import t as student

    candidates, tried = joint.candidates, len(joint.candidates)
    more, found = np.zeros((len(joint.torque), 0)), list[Term]()
    while candidates and len(found) < MOST:
        best: tuple[float, Key, Array] | None = None
        columns = np.column_stack([joint.columns, more])
        for key in candidates:
            column = joint.column(key, more)
            value, sd = _coefficient(columns, column, joint.torque, joint.stretch)
            if key[0] == "load" and value < 0.0:
                continue  # a gear loses power, and never gives any
            if np.isfinite(value) and sd > 0.0 and (best is None or abs(value) / sd > best[0]):
                best = abs(value) / sd, key, column
        if best is None:
            break
        name, scale = best[1]
        value, sd = _coefficient(columns, best[2], joint.torque, joint.stretch)
        if name == "load":
            sd = _error_of_load(columns, joint.torque, joint.stretch, joint.links)
        p = min(1.0, tried * 2.0 * float(student.sf(abs(value) / sd, STRETCHES - 1)))
        ratio, agreed = _held_out(columns, best[2], joint.torque, joint.stretch)
        rest = [key for key in candidates if key[0] != name]
        if p > LEVEL or not agreed:
            if name != "load":
                break
            candidates = rest  # what it is cannot be said: others may still be seen
            continue
        size = _beyond_a_line(best[2], columns[:, 0], joint.rate) if name == "speed" else 1.0
        fastest = float(np.abs(joint.rate).max())
        found.append(Term(name, value * size, sd * size, scale / fastest, p, ratio))
        more, candidates = np.column_stack([more, best[2]]), rest
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


def _held_out(columns: Array, column: Array, torque: Array, stretch: np.ndarray) -> tuple[float, bool]:
    """Rms of held-out parts of the log with one more column over that without, and whether they agree on it.

    They do where their mean gain is more than its standard error (Breiman, Friedman, Olshen & Stone,
    Classification and Regression Trees, 1984, 3.4.3): else one part of the log may have made all of it.
    """
    fold = stretch * FOLDS // STRETCHES
    square = np.array(
        [
            [_missed(some, torque, fold == part) for part in np.unique(fold)]
            for some in (columns, np.column_stack([columns, column]))
        ]
    )
    gain, (before, after) = square[0] - square[1], square.sum(axis=1)
    if len(gain) < 2 or not before > 0.0:
        return 1.0, False
    agreed = gain.mean() > gain.std(ddof=1) / np.sqrt(len(gain))
    return float(np.sqrt(after / before)), bool(agreed)


def _missed(columns: Array, torque: Array, out: np.ndarray) -> float:
    """Sum of the squares that a fit to the other samples leaves in those held ``out``."""
    scale = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    value = np.linalg.lstsq(columns[~out] / scale, torque[~out], rcond=1e-6)[0]
    return float(np.sum((torque[out] - columns[out] / scale @ value) ** 2))
