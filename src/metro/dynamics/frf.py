"""Frequency response functions from hammer records: gating, estimators, variance, rejected hits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray

_INTEGRATIONS = {"m/s2": -2, "m/s": -1, "m": 0}
_DOUBLE_HIT = 0.05  # of the first pulse's peak
_POOLED_LINES = 11
_OUTLAST = 2.5


@dataclass(frozen=True)
class Hit:
    """One blow: force (n,) in N and response (n,) in SI, sampled at ``rate`` in Hz."""

    force: Array
    response: Array
    rate: float


@dataclass(frozen=True)
class Frf:
    """Receptance from one or several hits, e^{+i omega t}: Im H < 0 at a driving point.

    Attributes
    ----------
    frequency : (n,) Hz, from the first line above 0.
    h1, h2, hv : (n,) receptance, m/N: noise on the response, on the force, on both.
    variance : (n,) of the complex ``h1``, m²/N², from the scatter of the hits; NaN for a single hit.
    coherence : (n,); NaN for a single hit.
    excited : (n,) whether the force's spectrum is within 20 dB of its largest line.
    redundancy : record length over the length kept by the gate: neighbouring lines so many apart are
        independent.
    hits : number of hits used.
    notes : what was rejected and what could not be had.
    """

    frequency: Array
    h1: ComplexArray
    h2: ComplexArray
    hv: ComplexArray
    variance: Array
    coherence: Array
    excited: np.ndarray
    redundancy: float
    hits: int
    notes: tuple[str, ...]


def estimate_frf(hits: Sequence[Hit], unit: str) -> Frf:
    """Average gated hits into a receptance.

    Parameters
    ----------
    hits : repeats of the same test, of one rate and length.
    unit : of the response: m/s2, m/s or m.

    Raises
    ------
    ValueError
        When no hit is usable, when rates or lengths differ, or when the unit is none of the three.
    """
    if len({(hit.rate, len(hit.force), len(hit.response)) for hit in hits}) != 1:
        raise ValueError("hits of one test: expected one sampling rate and one length for all")
    if unit not in _INTEGRATIONS:
        raise ValueError(f"response unit {unit!r}: expected {', '.join(_INTEGRATIONS)}")
    faults = [fault(hit) for hit in hits]
    notes = [f"hit {i + 1} rejected: {reason}" for i, reason in enumerate(faults) if reason]
    good = [hit for hit, reason in zip(hits, faults, strict=True) if not reason]
    if not good:
        raise ValueError("no usable hit: " + "; ".join(notes))
    if len(good) == 1:
        notes.append("a single hit: no coherence and no variance from repeats")
    gated = [gate(hit) for hit in good]
    length, rate = len(good[0].force), good[0].rate
    omega = np.asarray(2.0 * np.pi * np.fft.rfftfreq(length, 1.0 / rate)[1:], dtype=np.float64)
    to_displacement = np.asarray(1j * omega, dtype=np.complex128) ** _INTEGRATIONS[unit]
    force = np.asarray(np.fft.rfft([f for f, _, _ in gated], axis=1)[:, 1:], dtype=np.complex128)
    response = np.asarray(np.fft.rfft([x for _, x, _ in gated], axis=1)[:, 1:], dtype=np.complex128)
    sff, sxx = np.sum(np.abs(force) ** 2, axis=0), np.sum(np.abs(response) ** 2, axis=0)
    sfx = np.sum(force.conj() * response, axis=0)
    variance, coherence = _scatter(force, response)
    return Frf(
        frequency=omega / (2.0 * np.pi),
        h1=sfx / sff * to_displacement,
        h2=sxx / sfx.conj() * to_displacement,
        hv=sfx / np.abs(sfx) * np.sqrt(sxx / sff) * to_displacement,
        # pooled as measured, where the noise is even: as displacement it rises steeply towards 0 Hz
        variance=variance * np.abs(to_displacement) ** 2,
        coherence=coherence,
        excited=np.sqrt(sff) > 0.1 * np.sqrt(sff.max()),
        redundancy=length / max(kept for _, _, kept in gated),
        hits=len(good),
        notes=tuple(notes),
    )


def _scatter(force: ComplexArray, response: ComplexArray) -> tuple[Array, Array]:
    """Variance of H1 from the scatter of the hits (k, n), and coherence; NaN for one hit."""
    hits, lines = force.shape
    if hits == 1:
        unknown = np.full(lines, np.nan)
        return unknown, unknown
    sff, sxx = np.sum(np.abs(force) ** 2, axis=0), np.sum(np.abs(response) ** 2, axis=0)
    sfx = np.sum(force.conj() * response, axis=0)
    left = np.sum(np.abs(response - sfx / sff * force) ** 2, axis=0) / (hits - 1)
    return pooled(left / sff), np.abs(sfx) ** 2 / (sff * sxx)


def pooled(values: Array, lines: int = _POOLED_LINES) -> Array:
    """Mean over ``lines`` neighbouring lines; the ends take what is there."""
    window = np.ones(min(lines, len(values)))
    count = np.convolve(np.ones(len(values)), window, mode="same")
    total: Array = np.convolve(values, window, mode="same") / count
    return total


def fault(hit: Hit) -> str:
    """Say why a hit cannot be used: overload, no pulse, a double hit; empty when it can."""
    for name, signal in (("force", hit.force), ("response", hit.response)):
        if not np.all(np.isfinite(signal)):
            return f"{name} has values that are not finite"
        top = np.abs(signal) >= np.abs(signal).max() * (1.0 - 1e-9)
        if np.any(top[:-2] & top[1:-1] & top[2:]):
            return f"{name} is overloaded"
    start, end = pulse(hit.force)
    peak = np.abs(hit.force).max()
    rest = np.concatenate([hit.force[:start], hit.force[end:]])
    noise = 1.4826 * np.median(np.abs(rest - np.median(rest)))
    if peak < 10.0 * noise:
        return "no force pulse above the noise"
    ringing = max(_DOUBLE_HIT * peak, 6.0 * noise)
    return "double hit" if np.any(hit.force[end:] * _sign(hit) > ringing) else ""


def _sign(hit: Hit) -> float:
    return float(np.sign(hit.force[np.abs(hit.force).argmax()]))


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
