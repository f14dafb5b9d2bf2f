"""Flatness indices of a face from its deviations.

X_m, X_a, X_g are those of FlePFaM (unfiltered, orthogonal to the least-squares plane). FLTt, FLTp, FLTv, FLTq
are those of ISO 12781-1, which defines them on a surface that has passed a declared areal filter: a raw
maximum minus minimum is not FLTt, and the two sets are computed by two functions on two sets of deviations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

PERCENTILES = (0.1, 99.9)
NORMAL = 1.96


@dataclass(frozen=True)
class Index:
    """A flatness index as read, less what noise adds to it, and the 95 % interval of the true one.

    The interval is of what noise does alone, and need not be symmetric: an index is not negative.
    """

    value: float
    corrected: float
    low: float
    high: float

    @property
    def bias(self) -> float:
        """What noise is taken to have added."""
        return self.value - self.corrected

    @property
    def sd(self) -> float:
        """Standard uncertainty by the longer side of the interval."""
        return max(self.high - self.corrected, self.corrected - self.low) / NORMAL


def lowered(value: float, corrected: float, low: float, high: float) -> Index:
    """Return an index less what noise added to it: a correction of noise never makes one larger."""
    corrected = min(corrected, value)
    return Index(value, corrected, min(low, corrected), max(high, corrected))


def symmetric(value: float, bias: float, sd: float) -> Index:
    """Return an index by its bias and standard deviation."""
    middle = min(value, max(0.0, value - bias))
    return lowered(value, middle, max(0.0, middle - NORMAL * sd), middle + NORMAL * sd)


def log_mean_floor(step: float) -> float:
    """Value that replaces |d| < step/2 in X_g: exp(mean ln) of a deviation uniform within the step."""
    return step / (2 * np.e)


def raw_indices(deviations: Array, step: float) -> dict[str, float]:
    """Return X_m, X_a, X_g and the P0.1…P99.9 range of unfiltered ``deviations`` (n,), in their unit.

    ``step`` is the rounding step of the data, in the same unit: a deviation below half of it is not zero but
    unknown, and enters ln|d| as :func:`log_mean_floor` (dropping zeros would bias X_g by several per cent).
    """
    size = np.abs(deviations)
    xa = float(size.mean())
    floored = np.maximum(np.where(size < step / 2, log_mean_floor(step), size), np.finfo(float).tiny)
    low, high = np.percentile(deviations, PERCENTILES)
    return {
        "xm": float(np.ptp(deviations)),
        "xa": xa,
        "xg": float(np.exp(np.log(floored).mean())),
        "percentile_range": float(high - low),
    }


def iso_indices(filtered: Array) -> dict[str, float]:
    """Return FLTt, FLTp, FLTv, FLTq of a **filtered** surface's deviations (n,) from its fitted plane."""
    peak, valley = float(filtered.max()), float(-filtered.min())
    rms = float(np.sqrt(np.mean(filtered**2)))
    return {"fltt": peak + valley, "fltp": peak, "fltv": valley, "fltq": rms}
