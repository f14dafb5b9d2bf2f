"""One blow of a hammer: its pulse, whether it can be used, and the gates that keep signal and drop noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.units import Array

_DOUBLE_HIT = 0.05  # of the first pulse's peak
_WEAK = 0.1  # -20 dB
_OUTLAST = 2.5


@dataclass(frozen=True)
class Hit:
    """One blow: force (n,) in N and response (n,) in SI, sampled at ``rate`` in Hz."""

    force: Array
    response: Array
    rate: float

    @property
    def seconds(self) -> float:
        """Length of the record, s."""
        return len(self.force) / self.rate


def faults(hits: Sequence[Hit]) -> list[str]:
    """Explain for each hit why it cannot be used; empty when it can.

    Beside the faults of a hit by itself (:func:`fault`): a record that is there twice, which would make the
    scatter of the hits too small, and a blow whose force stays 20 dB below the strongest of the good ones.
    """
    reasons = [fault(hit) for hit in hits]
    for i, hit in enumerate(hits):
        twin = next((j for j in range(i) if _same(hit, hits[j])), None)
        if twin is not None and not reasons[i]:
            reasons[i] = f"the same record as hit {twin + 1}"
    impulse = [0.0 if reason else _impulse(hit) for hit, reason in zip(hits, reasons, strict=True)]
    for i, size in enumerate(impulse):
        if not reasons[i] and size < _WEAK * max(impulse):
            reasons[i] = "its force spectrum is more than 20 dB below the strongest hit's"
    return reasons


def fault(hit: Hit) -> str:
    """Explain why a hit by itself cannot be used: overload, no pulse, a double hit, one channel twice."""
    for name, signal in (("force", hit.force), ("response", hit.response)):
        if not np.all(np.isfinite(signal)):
            return f"{name} has values that are not finite"
        top = np.abs(signal) >= np.abs(signal).max() * (1.0 - 1e-9)
        if np.any(top[:-2] & top[1:-1] & top[2:]):
            return f"{name} is overloaded"
    if _proportional(hit.force, hit.response):
        return "response is the force channel over again"
    start, end = pulse(hit.force)
    peak = np.abs(hit.force).max()
    outside = np.concatenate([hit.force[:start], hit.force[end:]])
    noise = 1.4826 * np.median(np.abs(outside - np.median(outside)))
    if peak < 10.0 * noise:
        return "no force pulse above the noise"
    ringing = max(_DOUBLE_HIT * peak, 6.0 * noise)
    return "double hit" if np.any(hit.force[end:] * _sign(hit) > ringing) else ""


def pulse(force: Array) -> tuple[int, int]:
    """First and one-past-last sample of the main pulse: to where the force falls below 1 % of the peak."""
    at = int(np.abs(force).argmax())
    low = np.abs(force) < 0.01 * np.abs(force[at])
    before, after = np.flatnonzero(low[:at]), np.flatnonzero(low[at:])
    start = int(before[-1]) if len(before) else 0
    end = at + int(after[0]) if len(after) else len(force)
    width = max(end - start, 4)
    return max(start - width // 2, 0), min(end + width // 2, len(force))


def gate(hit: Hit) -> tuple[Array, Array, int]:
    """Force outside its pulse, and response before it and after its decay, set to their mean level of zero.

    Returns the gated force and response and the number of samples that the response's gate keeps. No
    exponential window: nothing is added to the damping.
    """
    start, end = pulse(hit.force)
    twentieth = max(len(hit.force) // 20, 1)
    quiet = slice(0, start) if start >= twentieth else slice(len(hit.force) - twentieth, None)
    force = np.zeros_like(hit.force)
    force[start:end] = hit.force[start:end] - hit.force[quiet].mean()
    response = hit.response - hit.response[quiet].mean()
    last = _decayed(response, start)
    taper = max((last - start) // 20, 1)
    window = np.zeros_like(response)
    window[start:last] = 1.0
    window[last - taper : last] = 0.5 + 0.5 * np.cos(np.pi * (np.arange(taper) + 0.5) / taper)
    return force, response * window, last - start


def _same(a: Hit, b: Hit) -> bool:
    return np.array_equal(a.force, b.force) and np.array_equal(a.response, b.response)


def _proportional(a: Array, b: Array) -> bool:
    """Return whether b is a times a constant, to the rounding of the numbers."""
    factor = float(a @ b) / float(a @ a) if a.any() else 0.0
    return factor != 0.0 and float(np.abs(b - factor * a).max()) < 1e-9 * float(np.abs(b).max())


def _impulse(hit: Hit) -> float:
    """Impulse of the pulse, N s: the level of its spectrum at the low end."""
    start, end = pulse(hit.force)
    return float(np.abs(hit.force[start:end].sum())) / hit.rate


def _sign(hit: Hit) -> float:
    return float(np.sign(hit.force[np.abs(hit.force).argmax()]))


def _decayed(response: Array, start: int) -> int:
    """Sample from which the response holds noise alone, judged by its level at the record's end."""
    block = max((len(response) - start) // 100, 1)
    count = (len(response) - start) // block
    level = np.sqrt(np.mean(response[start : start + count * block].reshape(count, block) ** 2, axis=1))
    above = np.flatnonzero(level > 1.5 * np.median(level[-max(count // 10, 1) :]))
    if not len(above):
        return len(response)
    # slow modes are weak in acceleration and outlast the time at which the sum has sunk into the noise
    return min(start + round(_OUTLAST * (int(above[-1]) + 1)) * block, len(response))
