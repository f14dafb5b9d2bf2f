"""A dynamometer record that need not fit in memory: every pass over it reads it in stretches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.batch.processed import Tables
from metro.signals import steady
from metro.units import Array

STRETCH = 1 << 19  # approximate number of samples in memory at a time
AXES = ["fx_n", "fy_n", "fz_n"]


@dataclass(frozen=True, eq=False)
class Stretch:
    """Successive samples: ``time`` (n,) s, ``signal`` (n, 3) N, ``tacho`` (n,) degrees, NaN without one."""

    time: Array
    signal: Array
    tacho: Array


class LongRecord:
    """The dynamometer record of a run.

    Attributes
    ----------
    samples : their number. start, end : the first and the last time, s.
    """

    def __init__(self, read: Tables, run: str) -> None:
        self._read, self._run = read, run
        self.samples, self.start, self.end = 0, np.nan, np.nan
        kept: list[pd.DataFrame] = []
        for piece in read.pieces("force", run):
            if len(piece):
                self.start = self.start if self.samples else float(piece["t_s"].iloc[0])
                self.end = float(piece["t_s"].iloc[-1])
                self.samples += len(piece)
                kept = [*kept, piece] if self.samples <= STRETCH else []
        self._kept = kept

    @property
    def rate(self) -> float:
        """Sampling rate, Hz."""
        return (self.samples - 1) / (self.end - self.start)

    def stretches(self, place: slice | None = None) -> Iterator[Stretch]:
        """Yield the record, or a part of it, in stretches of about equal length; a short one in one piece."""
        start, stop, _ = (place or slice(None)).indices(self.samples)
        count = max(1, round((stop - start) / STRETCH))
        ends = np.linspace(start, stop, count + 1).round().astype(int)[1:]
        pieces = iter(self._kept) if self._kept else self._read.pieces("force", self._run)
        waiting, first = next(pieces), 0  # samples already read, and the place of the first of them
        for end in ends.tolist():
            while first + len(waiting) < end:
                over = min(max(start - first, 0), len(waiting))
                waiting = pd.concat([waiting.iloc[over:], next(pieces)], ignore_index=True)
                first += over
            yield _stretch(waiting.iloc[start - first : end - first])
            start = end

    def turns(self, samples_per_revolution: float) -> steady.Turns:
        """Return the record by its revolutions."""
        return steady.turns((each.signal for each in self.stretches()), samples_per_revolution)


def _stretch(table: pd.DataFrame) -> Stretch:
    return Stretch(
        table["t_s"].to_numpy(dtype=float),
        table[AXES].to_numpy(dtype=float),
        table["spindle_deg"].to_numpy(dtype=float),
    )
