"""Receptances of a batch, from hammer records and FRF files, with the errors that repeats show."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.dynamics.frf import estimate_frf, pooled
from metro.dynamics.hits import Hit
from metro.dynamics.polefit import Scatter
from metro.units import Array, ComplexArray


@dataclass(frozen=True)
class Receptance:
    """One receptance.

    Attributes
    ----------
    position, reference, response : where it was taken.
    frequency : (n,) Hz.
    frf : (n,) m/N.
    variance : (n,); None without repeats.
    deviation : (k, n) contribution of each repeat to the error of ``frf``.
    repeated : (k,) the hit of each repeat: hits of the same name on one reference may be the same blow.
    usable : (n,) lines that the force excited.
    redundancy : step between independent lines.
    coherence : (n,) as a file has it, the mean of its repeats; None where it has none.
    """

    position: str
    reference: str
    response: str
    frequency: Array
    frf: ComplexArray
    variance: Array | None
    deviation: ComplexArray
    repeated: tuple[Hashable, ...]
    usable: np.ndarray
    redundancy: int = 1
    coherence: Array | None = None

    @property
    def driving(self) -> bool:
        """Whether the structure was hit where its response was measured."""
        return self.reference == self.response

    @property
    def pair(self) -> str:
        """The pair of points in words."""
        return f"{self.reference} to {self.response}"

    def repeats(self, other: Receptance) -> bool:
        """Whether the data duplicate those of another pair, which is not the reciprocal one."""
        reciprocal = (self.reference, self.response) == (other.response, other.reference)
        alike = len(self.frf) == len(other.frf) and np.allclose(self.frf, other.frf, rtol=1e-9, atol=0.0)
        return alike and not reciprocal


def from_records(hits: pd.DataFrame, decay: float, notes: list[str]) -> Iterator[Receptance]:
    """Average the hits of every pair of points."""
    keys = ["position", "reference", "response", "response_unit"]
    every = {
        key: {name: _hit(part) for name, part in rows.groupby(["test", "replicate"], sort=False)}
        for key, rows in hits.groupby(keys, sort=False)
    }
    longest = max((hit.seconds for records in every.values() for hit in records.values()), default=0.0)
    for (position, reference, response, unit), records in every.items():
        name = f"position {position}, {reference} to {response}"
        try:
            frf = estimate_frf(list(records.values()), str(unit), decay, longest)
        except ValueError as error:
            notes.append(f"{name}: {error}")
            continue
        notes += [f"{name}: {note}" for note in frf.notes]
        repeated = len(frf.used) > 1
        yield Receptance(
            *(str(position), str(reference), str(response), frf.frequency, frf.h1),
            frf.variance if repeated else None,
            frf.deviation,
            tuple(list(records)[i] for i in frf.used) if repeated else (),
            frf.excited,
            math.ceil(frf.redundancy),
        )


def _hit(rows: pd.DataFrame) -> Hit:
    time = rows["t_s"].to_numpy()
    rate = (len(time) - 1) / float(time[-1] - time[0])
    # The rates of one test's records differ only by the rounding of the time stamps.
    return Hit(rows["force_n"].to_numpy(), rows["response_si"].to_numpy(), round(rate, 3))


def from_files(frfs: pd.DataFrame, notes: list[str]) -> Iterator[Receptance]:
    """Average the FRF files of every pair of points."""
    keys = ["position", "reference", "response"]
    for (position, reference, response), rows in frfs.groupby(keys, sort=False):
        parts = {
            name: part.sort_values("frequency_hz")
            for name, part in rows.groupby(["test", "replicate"], sort=False)
        }
        frequency = next(iter(parts.values()))["frequency_hz"].to_numpy()
        same = {name: p for name, p in parts.items() if np.array_equal(p["frequency_hz"], frequency)}
        if len(same) < len(parts):
            notes.append(
                f"position {position}, {reference} to {response}: "
                f"{len(parts) - len(same)} FRFs on other lines than the first were left out"
            )
        values = np.array([p["real_m_n"].to_numpy() + 1j * p["imag_m_n"].to_numpy() for p in same.values()])
        keep = (frequency > 0) & np.all(np.isfinite(values), axis=0)
        mean, variance, deviation = _averaged(values[:, keep])
        yield Receptance(
            *(str(position), str(reference), str(response), frequency[keep], mean, variance, deviation),
            tuple(same) if len(same) > 1 else (),
            np.ones(len(mean), dtype=bool),
            coherence=_coherence(list(same.values()), keep),
        )


def _coherence(files: list[pd.DataFrame], keep: np.ndarray) -> Array | None:
    if not all("coherence" in file and file["coherence"].notna().all() for file in files):
        return None
    mean: Array = np.mean([file["coherence"].to_numpy(float) for file in files], axis=0)[keep]
    return mean


def _averaged(values: ComplexArray) -> tuple[ComplexArray, Array | None, ComplexArray]:
    """Mean (n,), its variance, and the contribution of each repeat (k, n) to its error."""
    mean, repeats = values.mean(axis=0), len(values)
    if repeats == 1:
        return mean, None, np.zeros((0, len(mean)), dtype=np.complex128)
    deviation = (values - mean) / np.sqrt(repeats * (repeats - 1))
    return mean, pooled(np.sum(np.abs(deviation) ** 2, axis=0)), deviation


def arranged(group: list[Receptance]) -> tuple[list[Receptance], int]:
    """Order a group for the poly-reference fit, and count the inputs of one output.

    If every reference was measured at every response, the fewer of the two are the inputs (the structure is
    reciprocal), and those of one output are adjacent. Otherwise each pair is a separate output.
    """
    references = list(dict.fromkeys(item.reference for item in group))
    responses = list(dict.fromkeys(item.response for item in group))
    if len(group) < len(references) * len(responses):
        return group, 1
    by_pair = {(item.reference, item.response): item for item in group}
    if len(references) <= len(responses):
        return [by_pair[i, o] for o in responses for i in references], len(references)
    return [by_pair[i, o] for i in references for o in responses], len(responses)


def scatter(group: list[Receptance], keep: np.ndarray) -> Scatter | None:
    """Return the scatter of a group's repeats on the lines ``keep``; None if a pair has no repeats.

    A repeat of one name on one reference is one cluster over all responses: the responses may have been
    recorded together, and share the noise of the force.
    """
    if not all(item.repeated for item in group):
        return None
    names = list(dict.fromkeys((item.reference, name) for item in group for name in item.repeated))
    deviation = np.zeros((len(names), len(keep), len(group)), dtype=np.complex128)
    for column, item in enumerate(group):
        for name, own in zip(item.repeated, item.deviation, strict=True):
            deviation[names.index((item.reference, name)), :, column] = own[keep]
    references = list(dict.fromkeys(reference for reference, _ in names))
    return Scatter(deviation, np.array([references.index(reference) for reference, _ in names]))


def files(group: list[Receptance]) -> list[list[np.ndarray]]:
    """Return the ways in which a group may have been measured piece by piece: the columns of each piece.

    Hammer after hammer place, or sensor after sensor place: a table does not say which, and between either
    something may have moved.
    """
    ways = []
    for names in ([item.reference for item in group], [item.response for item in group]):
        pieces = [np.flatnonzero([other == name for other in names]) for name in dict.fromkeys(names)]
        ways += [pieces] if len(pieces) > 1 else []
    return ways
