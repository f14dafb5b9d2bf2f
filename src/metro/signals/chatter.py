"""Chatter in the record of a cut: whether it is there, how sure that is, at what frequency, of what kind.

The energy that stands out of the noise off the spindle's orders is compared with what repeats with the
spindle, window by window (energy ratio of Caliskan, Kilic and Altintas, 2018, threshold 20 %). It is chatter
only where it lasts, and where it looks like a vibration that feeds itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.signals import chatter_signs as signs
from metro.signals.asynchronous import LEAST_WINDOWS, Windows, windows
from metro.units import Array

BEGINS, ENDS = 0.2, 0.1  # energy ratio at which chatter begins, and below which it has ended
TINY = 1e-3  # energy ratio below which nothing more is told
# Log-odds of chatter: where signs of it were seen, where none was, and per log-odds of the energy. Logistic
# regression on simulated tests near the boundary, where chatter moves the tip by more than half the feed per
# tooth from turn to turn; with signs the odds are even at an energy ratio of 18 %, without at 46 %.
SEEN, UNSEEN, PER_LOGIT = 3.5, 0.35, 2.3
ERROR = 0.01  # probability that the answer is wrong however clear the record
UNDECIDED = 0.5


@dataclass(frozen=True, eq=False)
class Detection:
    """What the record of a cut says.

    Attributes
    ----------
    probability : that the cut chattered; a half where that cannot be told.
    chatter_hz, chatter_sd_hz : frequency and its standard deviation; NaN where no chatter was held.
    kind : "hopf", "flip", "forced" (what vibrates is on the orders of the spindle: no chatter) or "unknown".
    separable : False where something stands on orders of the spindle that may be chatter or runout.
    energy_ratio : (w,) share of the energy off the orders, window by window.
    chattering : (w,) windows in which it chattered.
    signs : of "side bands", "growth", "closed curve" those that were seen in three windows.
    """

    probability: float
    chatter_hz: float
    chatter_sd_hz: float
    kind: str
    separable: bool
    energy_ratio: Array
    chattering: np.ndarray
    signs: tuple[str, ...]


def detect(time: Array, angle: Array, signal: Array, teeth: int, *, differentiated: int = 0) -> Detection:
    """Look for chatter in the record of a steady cut.

    Parameters
    ----------
    time, angle : (n,) s; rad, of the spindle. signal : (n, channels), of one quantity.
    differentiated : 0 for a force or a displacement, 2 for an acceleration.

    Raises
    ------
    ValueError
        If the record is too short.
    """
    seen = windows(time, angle, signal, differentiated=differentiated)
    ratio, order = seen.energy_ratio, signs.line(seen)
    found = _signs(seen, order, teeth)
    looks = np.any(list(found.values()), axis=0)
    chattering = held(ratio, looks)
    probability = probability_of(evidence(ratio), seen=looks.sum() >= LEAST_WINDOWS)
    names = tuple(name for name, mask in found.items() if mask.sum() >= LEAST_WINDOWS)
    if chattering.any():
        middle, sd = _mean(order[chattering & np.isfinite(order)], seen)
        kind = signs.kind_of(middle / seen.speed, teeth, 1.0 / seen.revolutions)
        return Detection(probability, middle, sd, kind, True, ratio, chattering, names)
    separable = probability > UNDECIDED or not signs.locked(seen, teeth)
    beginning = bool(ratio[-1] > BEGINS and looks[-1])  # at the record's end, too late to be held
    if probability < UNDECIDED and (beginning or not separable):
        probability = UNDECIDED
    kind = "forced" if probability < UNDECIDED else "unknown"
    return Detection(probability, math.nan, math.nan, kind, separable, ratio, chattering, names)


def _mean(order: Array, seen: Windows) -> tuple[float, float]:
    """Mean frequency of the line over windows, Hz, and its standard deviation."""
    # half overlapping windows: every second one is a measurement of its own
    scatter = float(order.std()) / math.sqrt(max(0.5 * len(order), 1.0))
    return float(order.mean()) * seen.speed, math.hypot(signs.FINEST / seen.revolutions, scatter) * seen.speed


def _signs(seen: Windows, order: Array, teeth: int) -> dict[str, np.ndarray]:
    """Windows (w,) in which each sign of a vibration that feeds itself is seen."""
    there = np.isfinite(order)
    ring = there.any() and signs.amplitude_scatter(seen, float(np.nanmean(order))) < signs.RING
    return {
        "side bands": signs.side_bands(seen, order, teeth),
        "growth": there & signs.growing(seen),
        "closed curve": there & ring,
    }


def held(ratio: Array, looks: np.ndarray) -> np.ndarray:
    """Windows (w,) in which it chatters: begun by three in a row above 20 %, over at the first below 10 %."""
    on = (ratio > BEGINS) & looks
    begins = np.convolve(on, np.ones(LEAST_WINDOWS)) >= LEAST_WINDOWS - 0.5
    state = np.zeros(len(ratio), dtype=bool)
    for window in range(len(ratio)):
        before = window > 0 and bool(state[window - 1])
        state[window] = begins[window] or (before and ratio[window] >= ENDS)
    for window in range(len(ratio) - 1, 0, -1):  # the three in a row chattered from their first on
        state[window - 1] |= state[window] and bool(on[window - 1])
    return state


def evidence(ratio: Array) -> float:
    """Log-odds of the energy off the orders that are reached in three windows in a row."""
    kept = np.clip(ratio, TINY, 1.0 - TINY)
    three = np.lib.stride_tricks.sliding_window_view(np.log(kept / (1.0 - kept)), LEAST_WINDOWS)
    return float(three.min(axis=1).max())


def probability_of(evidence: float, *, seen: bool) -> float:
    """Probability of chatter, from the log-odds of the energy and whether a sign of chatter was seen."""
    odds = (SEEN if seen else UNSEEN) + PER_LOGIT * evidence
    return ERROR + (1.0 - 2.0 * ERROR) / (1.0 + math.exp(-odds))
