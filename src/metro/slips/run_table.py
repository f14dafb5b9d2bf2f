"""Rows of the run table, or files, that were exchanged: which record fits which row."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from metro.slips.hypothesis import Hypothesis
from metro.slips.waveform import Design, Record, WaveFit, fit, residual_with

IntArray = NDArray[np.int64]

ROUNDS = 4
NEVER = 1e6  # share of the power that is left where a record and a row have other orders


def exchanged(
    records: Sequence[Record], designs: Sequence[Design], declared: WaveFit
) -> Iterator[Hypothesis]:
    """Yield the assignment of records to rows that fits best, where it is not the declared one.

    Runs whose designs have the same number of orders can be exchanged; the coefficients follow the
    assignment, and the assignment the coefficients. Rows with the same settings are the same.
    """
    from scipy.optimize import linear_sum_assignment

    kinds = _kinds(designs)
    place = list(range(len(records)))
    beta = declared.mean.value
    for _ in range(ROUNDS):
        cost = np.array([[residual_with(record, one, beta) for one in designs] for record in records])
        cost[~np.isfinite(cost)] = NEVER
        before = place
        place = linear_sum_assignment(cost)[1].tolist()
        beta = fit(records, [designs[i] for i in place]).wave.value
        if np.array_equal(kinds[before], kinds[place]):
            break
    moved = np.flatnonzero(kinds[place] != kinds).tolist()
    if moved:
        rows = ", ".join(
            f"{records[i].run} with the row of {records[_row(place[i], kinds, moved)].run}" for i in moved
        )
        remedy = f"the records fit other rows: {rows}; exchange the files or the settings"
        yield Hypothesis("rows", remedy, "dynamometer", records, [designs[i] for i in place], "runs.csv")


def _row(wanted: int, kinds: IntArray, moved: Sequence[int]) -> int:
    """Return a row of the same kind as the wanted one, one of those that move if there is one."""
    alike = [i for i in moved if kinds[i] == kinds[wanted]]
    return alike[0] if alike else wanted


def _kinds(designs: Sequence[Design]) -> IntArray:
    """Give designs numbers (n,): those that are the same have the same one."""
    kinds = np.arange(len(designs))
    for i, one in enumerate(designs):
        for j in range(i):
            if _same(one, designs[j]):
                kinds[i] = kinds[j]
                break
    return kinds


def _same(one: Design, other: Design) -> bool:
    """Whether two designs differ by less than a thousandth in every coefficient's force."""
    if one.basis.shape != other.basis.shape:
        return False
    apart, size = (np.linalg.norm(each, axis=(0, 1)) for each in (one.basis - other.basis, one.basis))
    return bool(np.all(apart <= 1e-3 * size))
