"""Is a force record fit for use that is read piece by piece? Findings as of :mod:`metro.signals.quality`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from metro.signals import quality
from metro.signals.clipping import FLAT_TOP_SAMPLES
from metro.signals.quality import Finding, Steps
from metro.units import Array


@dataclass
class RecordQuality:
    """Gathers what the checks need of each piece of a record; a record of one piece is checked as a whole.

    Attributes
    ----------
    names, full_scale : of the channels; their range, None where it is not known.
    zero : s, the first time stamp.
    largest : of the forces, all channels together.
    """

    names: tuple[str, ...]
    full_scale: float | None
    zero: float = np.nan
    largest: float = 0.0
    _steps: Steps | None = None
    _end: tuple[Array, Array] | None = None  # the last stamp and the last samples
    _first: Array = field(default_factory=lambda: np.zeros(0))
    _low: Array | float = np.inf
    _high: Array | float = -np.inf
    _same: set[tuple[int, int, bool]] | None = None
    _near: Array | None = None  # the last piece, with the samples before it
    _begins: bool = True  # whether that piece begins the record
    _flat: list[Finding] = field(default_factory=list)  # of the pieces before it
    _blocks: list[tuple[Array, Array, Array]] = field(default_factory=list)

    def add(self, time: Array, values: Array) -> None:
        """Take the next piece: stamps (n,), s, and channels (n, k)."""
        if self._end is None:
            self.zero, self._first = float(time[0]), values[0]
            stamps, near = time, values
        else:  # a step, or a flat top, may lie across two pieces
            stamps, near = (np.concatenate(parts) for parts in zip(self._end, (time, values), strict=True))
        if len(stamps) > 1:
            steps = quality.steps(stamps, self._steps.typical if self._steps else None)
            self._steps = self._steps.joined(steps) if self._steps else steps
        self._end = time[-1:], near[1 - FLAT_TOP_SAMPLES :]
        self.largest = max(self.largest, float(np.linalg.norm(values, axis=1).max()))
        self._low = np.minimum(self._low, values.min(axis=0))
        self._high = np.maximum(self._high, values.max(axis=0))
        pairs = quality.same_pairs(values)
        self._same = pairs if self._same is None else self._same & pairs
        if self._near is not None:  # that piece does not end the record
            self._flat = self._flat_so_far(last=False)
            self._begins = False
        self._near = near
        self._blocks.append(quality.blocks_of(values))

    def _flat_so_far(self, *, last: bool) -> list[Finding]:
        """Return the longest flat top of each channel up to the piece that was taken last."""
        if self._near is None:
            raise ValueError("a record without samples has no channels to check")
        ends = self._begins, last
        channels = zip(self.names, self._near.T, strict=True)
        flat = [quality.flat_tops(name, channel, self.full_scale, ends) for name, channel in channels]
        before = self._flat or flat
        return [max(pair, key=lambda one: one.value) for pair in zip(before, flat, strict=True)]

    @property
    def step(self) -> float:
        """Typical step of the stamps, s."""
        return self._known.typical

    @property
    def _known(self) -> Steps:
        if self._steps is None:
            raise ValueError("a record of less than two samples has no steps")
        return self._steps

    def sampling(self, declared_hz: float | None) -> list[Finding]:
        """Check rate, jitter and gaps."""
        return quality.sampled(self._known, declared_hz)

    def air_offset(self) -> list[Finding]:
        """Check the zero of the channels where the tool cuts air at the start or the end."""
        scatter, mean, steps = (np.concatenate(parts) for parts in zip(*self._blocks, strict=True))
        largest = float(np.max(np.maximum(np.abs(self._low), np.abs(self._high))))
        return quality.zero_in_air(self.names, (scatter, mean, steps), largest)

    def channels(self) -> list[Finding]:
        """Check each channel: it moves, is not clipped, and no two are the same."""
        span = np.asarray(self._high) - np.asarray(self._low)
        first = zip(
            self.names, span.tolist(), self._first.tolist(), self._flat_so_far(last=True), strict=True
        )
        each = [one for name, size, value, flat in first for one in (quality.moving(name, size, value), flat)]
        return [*each, quality.apart(self.names, self._same or set(), span)]
