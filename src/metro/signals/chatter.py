"""Chatter in the record of a cut: whether it is there, how sure that is, at what frequency, of what kind.

The energy above the noise between the spindle's orders is compared with that of the part that repeats with
the spindle, window by window (energy ratio of Caliskan, Kilic and Altintas, 2018, threshold 20 %). It is
chatter only where it lasts, and where it has a sign of self-excitation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.signals import chatter_signs as signs
from metro.signals.asynchronous import WINDOWS, Windows, windows
from metro.units import Array

BEGINS, ENDS = 0.2, 0.1  # energy ratio at which chatter begins, and below which it has ended
# Log-odds of chatter. With a sign that the vibration feeds itself: those of the energy ratio that two windows
# in a row reach, within LIMITS, the share of the line that keeps one frequency, and that of the windows with
# side bands. Logistic regression on simulated tests about the boundary of many machines, tools and metals,
# made and fitted by ``python benchmarks/calibrate_chatter.py``; benchmarks/bench_chatter.py tests it on
# others. Without a sign, the odds of energy alone, of an earlier regression that is not part of the command:
# even at an energy ratio of 46 %, which noise that shakes a mode does not reach. The least shares were
# chosen.
ALONE, PER_LOGIT, PER_KEPT, PER_SIDE_BANDS = 3.27, 1.52, 0.88, 2.68
UNSEEN, PER_LOGIT_UNSEEN = 0.35, 2.3
SEEN, SEEN_FAINT = 0.5, 0.7  # least share, of either sign, above and below the ratio at which chatter begins:
# noise that shakes a mode reaches a tenth of the energy, and keeps to one frequency for two thirds
LIMITS = (-7.0, -1.0)  # energy ratios of 0.1 % and 27 %: beyond, the evidence does not change
TINY = 1e-3  # energy ratio below which the evidence does not change
ERROR = 0.02  # probability that the answer is wrong however clear the record: 5 of 274 in bench_chatter.py
UNDECIDED = 0.5
TOGETHER = 2  # windows in a row that count as evidence


@dataclass(frozen=True, eq=False)
class Detection:
    """The evidence of chatter in the record of a cut.

    Attributes
    ----------
    probability : that the cut chattered; a half where the record cannot decide it.
    chatter_hz, chatter_sd_hz : frequency and its standard deviation; NaN where no chatter was held.
    kind : "hopf", "flip", "forced" (what vibrates is on the orders of the spindle: no chatter) or "unknown".
    separable : False where a vibration on orders of the spindle may be chatter or runout.
    energy_ratio : (w,) share of the energy between the orders, window by window.
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
    signs_seen = _signs(seen, order, teeth)
    looks = np.any(list(signs_seen.values()), axis=0)
    names = tuple(name for name, mask in signs_seen.items() if mask.sum() >= WINDOWS)
    kept_hz, share = signs.kept_frequency(seen, order)
    probability = probability_of(evidence(ratio), share, float(signs_seen["side bands"].mean()))
    if probability > UNDECIDED:
        chattering = held(ratio, looks)
        # too late or too faint to be held: where the line is seen
        vibrates = np.isfinite(order) & (chattering if chattering.any() else True)
        kind = signs.kind_of(kept_hz / seen.speed, teeth, 1.0 / seen.revolutions)
        return Detection(
            probability, kept_hz, _deviation(order[vibrates], seen), kind, True, ratio, vibrates, names
        )
    separable = not signs.locked(seen, teeth)
    beginning = bool(ratio[-1] > BEGINS and looks[-1])  # at the record's end, too late to be sure
    certain = separable and not beginning
    none = np.zeros(len(ratio), dtype=bool)
    kind, probability = ("forced", probability) if certain else ("unknown", UNDECIDED)
    return Detection(probability, math.nan, math.nan, kind, separable, ratio, none, names)


def _deviation(order: Array, seen: Windows) -> float:
    """Return the standard deviation, Hz, of the frequency of a line at some orders (k,) in windows."""
    # half overlapping windows: every second one is a measurement of its own
    scatter = float(order.std()) / math.sqrt(max(0.5 * len(order), 1.0))
    return math.hypot(signs.FINEST / seen.revolutions, scatter) * seen.speed


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
    begins = np.convolve(on, np.ones(WINDOWS)) >= WINDOWS - 0.5
    state = np.zeros(len(ratio), dtype=bool)
    for window in range(len(ratio)):
        before = window > 0 and bool(state[window - 1])
        state[window] = begins[window] or (before and ratio[window] >= ENDS)
    for window in range(len(ratio) - 1, 0, -1):  # the three in a row chattered from their first on
        state[window - 1] |= state[window] and bool(on[window - 1])
    return state


def evidence(ratio: Array) -> float:
    """Log-odds of the energy between the orders that are reached in two windows in a row."""
    kept = np.clip(ratio, TINY, 1.0 - TINY)
    together = np.lib.stride_tricks.sliding_window_view(np.log(kept / (1.0 - kept)), TOGETHER)
    return float(together.min(axis=1).max())


def probability_of(evidence: float, kept: float, side_bands: float) -> float:
    """Probability of chatter.

    Parameters
    ----------
    evidence : log-odds of the energy, see :func:`evidence`.
    kept : share of the line that keeps one frequency.
    side_bands : share of the windows with side bands.
    """
    begun = evidence > math.log(BEGINS / (1.0 - BEGINS))
    if max(kept, side_bands) < (SEEN if begun else SEEN_FAINT):
        odds = UNSEEN + PER_LOGIT_UNSEEN * evidence
    else:
        within = min(max(evidence, LIMITS[0]), LIMITS[1])
        odds = ALONE + PER_LOGIT * within + PER_KEPT * kept + PER_SIDE_BANDS * side_bands
    return ERROR + (1.0 - 2.0 * ERROR) / (1.0 + math.exp(-odds))
