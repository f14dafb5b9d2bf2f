"""The motion and the torques of an arm from its log, filtered alike, for models that need speeds.

A joint that stands still resists by anything between minus and plus its Coulomb friction. Therefore the
samples whose direction is known are marked.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.units import Array

STEPS = 10.0  # encoder steps per sample that give a speed, and with it its sign, to 10 %
BANDWIDTH = 0.1  # of the samples' rate, at most
PER_PERIOD = 5  # samples that are kept per period of the cut-off
EDGE = 2.0  # periods of the cut-off at both ends, where the filter has to guess what lies beyond


@dataclass(frozen=True, eq=False)
class Motion:
    """An arm's motion and torques, low-passed alike and thinned; (m, n) each, rad and N m.

    ``direction`` is the sign of the speed, passed through the same filter as the torque; ``moving`` marks
    where a joint moves fast enough for its encoder to show which way.
    """

    angle: Array
    rate: Array
    acceleration: Array
    direction: Array
    torque: Array
    moving: np.ndarray


def motion(
    q: Array,
    torque: Array,
    period: float,
    cutoff_hz: float,
    step: Array | None = None,
    *,
    filtered: bool = False,
) -> Motion:
    """Filter a log without delay, differentiate, and keep five samples per period of the cut-off.

    Parameters
    ----------
    q, torque : (m, n) measured, rad, N m, every ``period`` s.
    cutoff_hz : of the fourth-order low-pass, both ways; at most a tenth of the samples' rate.
    step : (n,) resolution of the joints' encoders, rad; else what the log shows of it.
    filtered : whether the direction is known wherever the filtered speed shows it, else where each sample
        does. Of an arm that turns round often, and leaves standstill at once, the first loses less.
    """
    from scipy.signal import butter, sosfiltfilt

    cutoff = min(cutoff_hz, BANDWIDTH / period)
    filter_ = butter(4, cutoff, fs=1 / period, output="sos")

    def smooth(signal: Array) -> Array:
        return np.asarray(sosfiltfilt(filter_, signal, axis=0))

    angle = smooth(q)
    rate = np.gradient(angle, period, axis=0)
    steps = encoder_step(q) if step is None else step
    slowest = STEPS * (rate_noise(steps, period, cutoff) if filtered else steps / period)
    direction = smooth(np.clip(rate / slowest, -1.0, 1.0))
    edge = min(int(EDGE / (cutoff * period)), len(q) // 4)
    keep = slice(edge, len(q) - edge, max(1, int(1 / PER_PERIOD / (cutoff * period))))
    return Motion(
        angle[keep],
        rate[keep],
        np.gradient(rate, period, axis=0)[keep],
        direction[keep],
        smooth(torque)[keep],
        (np.abs(rate) > slowest)[keep],
    )


def rate_noise(step: Array, period: float, cutoff_hz: float) -> Array:
    """Return the error (n,), rad/s, of a low-passed speed by the rounding of angles to ``step`` (n,).

    Rounding is white noise of variance step²/12, of density 2 T step²/12 up to half the samples' rate; its
    derivative below f_c has the variance ∫ (2πf)² density df = (2π)² 2 T f_c³/3 · step²/12.
    """
    return np.asarray(step * 2 * math.pi * cutoff_hz * math.sqrt(2 * period * cutoff_hz / 36))


def evenly(time: Array, q: Array, torque: Array, cutoff_hz: float, *, filtered: bool = False) -> Motion:
    """Filter a log whose clock need not be even, as :func:`motion`; gaps are bridged by straight lines.

    Parameters
    ----------
    time : (m,) s, strictly rising. q, torque : (m, n) rad, N m. filtered : as of :func:`motion`.
    """
    even, period = even_clock(time)
    angle, load = (np.array([np.interp(even, time, column) for column in part.T]).T for part in (q, torque))
    step = encoder_step(q)  # as it is before the bridging
    return motion(angle, load, period, cutoff_hz, step, filtered=filtered)


def even_clock(time: Array) -> tuple[Array, float]:
    """Return even times over those of a log, and their step: the median of its steps, s."""
    period = float(np.median(np.diff(time)))
    return np.arange(time[0], time[-1], period), period


def encoder_step(q: Array) -> Array:
    """Resolution (n,) of logged angles (m, n): the second differences that rounding or noise leaves.

    Their lower decile is one step of an encoder where the arm does not accelerate, and is that even at
    constant speed, where the angles themselves change by many steps from sample to sample.
    """
    change = np.abs(np.diff(q, n=2, axis=0))
    rounding = 8 * np.finfo(float).eps * np.maximum(np.abs(q).max(axis=0), 1.0)
    return np.array(
        [_lower_decile(each[each > least]) for each, least in zip(change.T, rounding, strict=True)]
    )


def _lower_decile(values: Array) -> float:
    return float(np.quantile(values, 0.1)) if len(values) else math.inf
