"""What recordings of packets share: every packet has a stamp, and some are late, doubled or torn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from metro.formats.errors import FormatError
from metro.units import MS, Array

LATEST_S = 1.0  # a network delivers within this; stamps that fall by more are those of a second start


class Note(NamedTuple):
    """What a reader notes about a file that it could read, in the words of the quality table.

    A table's notes are in its ``attrs["notes"]``.
    """

    check: str
    value: float
    limit: float
    ok: bool
    message: str


def in_order(
    path: Path,
    what: str,
    stamps: tuple[npt.NDArray[np.int64], float],
    values: Array,
    place: Callable[[int], str],
) -> tuple[npt.NDArray[np.intp], list[Note]]:
    """Order packets by their stamps, each stamp once; gaps between them stay.

    Parameters
    ----------
    what : what a stamp is called.
    stamps : (n,) in ticks, in the order of arrival, and the seconds of a tick.
    values : (n, k) what the packets hold. place : names a packet by its place in the order of arrival.

    Returns
    -------
    tuple
        The packets to take, in order, and notes on those that were late or came twice.

    Raises
    ------
    FormatError
        Where the stamps fall by more than a network's delay, or one stamp has different values.
    """
    ticks, tick_s = stamps
    newest = np.maximum.accumulate(ticks)
    lateness = (newest - ticks) * tick_s
    if lateness.max(initial=0.0) > LATEST_S:
        row = int(np.argmax(lateness > LATEST_S))
        fault = f"found {what} {ticks[row]} after {newest[row]}"
        split = (
            f"expected it to rise, or to be late by {LATEST_S:g} s at most: split a recording of two starts"
        )
        raise FormatError(path, f"{place(row)}: {fault}, {split}")
    order = np.argsort(ticks, kind="stable")
    repeated = np.diff(ticks[order], prepend=ticks[order][:1] - 1) == 0
    for again in np.flatnonzero(repeated):
        if not np.array_equal(values[order[again]], values[order[again - 1]], equal_nan=True):
            fault = f"found {what} {ticks[order[again]]} a second time with other values"
            raise FormatError(path, f"{place(int(order[again]))}: {fault}, expected one packet per stamp")
    twice = int(np.count_nonzero(repeated))
    delay = lateness[order][~repeated]
    late = int(np.count_nonzero(delay))
    notes = []
    if late:
        by = f"by up to {float(delay.max()) / MS:.3g} ms"
        notes.append(_harmless("late packets", late, f"came late, {by}, and were put in order"))
    if twice:
        notes.append(_harmless("repeated packets", twice, "came a second time and were left out"))
    return order[~repeated], notes


def _harmless(check: str, count: int, message: str) -> Note:
    return Note(check, float(count), np.nan, True, f"{count} packets {message}")
