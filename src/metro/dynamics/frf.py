"""Frequency response functions from hammer records: estimators, coherence, variance per line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.dynamics.hits import Hit, faults, gate
from metro.dynamics.outlying import outlying
from metro.units import Array, ComplexArray

_INTEGRATIONS = {"m/s2": -2, "m/s": -1, "m": 0}
_POOLED_LINES = 11
_WEAK = 0.1  # -20 dB


@dataclass(frozen=True)
class Frf:
    """Receptance from one or several hits, e^{+i omega t}: Im H < 0 at a driving point.

    Attributes
    ----------
    frequency : (n,) Hz, from the first line above 0.
    h1, h2, hv : (n,) receptance, m/N: noise on the response, on the force, on both.
    variance : (n,) of the complex ``h1``, m²/N², from the scatter of the hits; NaN for a single hit.
    deviation : (k, n) what each of the k hits used adds to the error of ``h1``, m/N: the sum of outer
        products is the covariance of all lines, noise of the force included, which many lines share. No rows
        for a single hit.
    coherence : (n,); NaN for a single hit.
    excited : (n,) whether the force's spectrum is within 20 dB of its largest line.
    redundancy : record length over the length kept by the gate: neighbouring lines so many apart are
        independent.
    used : which of the hits given were used.
    notes : what was rejected and what could not be had.
    """

    frequency: Array
    h1: ComplexArray
    h2: ComplexArray
    hv: ComplexArray
    variance: Array
    deviation: ComplexArray
    coherence: Array
    excited: np.ndarray
    redundancy: float
    used: tuple[int, ...]
    notes: tuple[str, ...]


def estimate_frf(hits: Sequence[Hit], unit: str, decay: float = 0.0, seconds: float = 0.0) -> Frf:
    """Average gated hits into a receptance.

    A record that ends before ``seconds``, or before another one, is continued with zeros: after its gate it
    holds nothing else. So records of several lengths have the same lines.

    Parameters
    ----------
    hits : repeats of the same test. Those of another sampling rate than most are rejected.
    unit : of the response: m/s2, m/s or m.
    decay : 1/s, of an exponential window that the records went through, force and response alike. The FRF is
        that of poles moved left by it (:func:`metro.dynamics.modal.identify_modes` subtracts it again).

    Raises
    ------
    ValueError
        When no hit is usable, when force and response of one differ in length, or when the unit is none of
        the three.
    """
    if any(len(hit.force) != len(hit.response) for hit in hits):
        raise ValueError("a hit's force and response: expected one length for both")
    if unit not in _INTEGRATIONS:
        raise ValueError(f"response unit {unit!r}: expected {', '.join(_INTEGRATIONS)}")
    reasons = _other_rates(hits, faults(hits))
    used = tuple(i for i, reason in enumerate(reasons) if not reason)
    if not used:
        raise ValueError("no usable hit: " + "; ".join(_rejected(reasons)))
    gated = [gate(hits[i]) for i in used]
    rate = hits[used[0]].rate
    length = round(max(seconds, *(hits[i].seconds for i in used), 0.0) * rate)
    force = _spectra([one for one, _, _ in gated], length)
    response = _spectra([one for _, one, _ in gated], length)
    band = _excited(np.sqrt(np.sum(np.abs(force) ** 2, axis=0)))
    apart = outlying(force[:, band], response[:, band])
    kept = [i for i in range(len(used)) if i not in apart]
    reasons = [reasons[i] or apart.get(used.index(i), "") for i in range(len(hits))]
    notes = _rejected(reasons)
    used, gated = tuple(used[i] for i in kept), [gated[i] for i in kept]
    force, response = force[kept], response[kept]
    if len(used) == 1:
        notes.append("a single hit: no coherence and no variance from repeats")
    short = [f"{i + 1} ({hits[i].seconds:.4g} s)" for i in used if len(hits[i].force) < 0.99 * length]
    if short:
        notes.append(
            f"hit{'s' * (len(short) > 1)} {', '.join(short)} shorter than the longest record "
            f"({length / rate:.4g} s): continued with zeros"
        )
    omega = np.asarray(2.0 * np.pi * np.fft.rfftfreq(length, 1.0 / rate)[1:], dtype=np.float64)
    # a signal times e^{-decay t} has its spectrum at i omega + decay
    to_displacement = np.asarray(1j * omega + decay, dtype=np.complex128) ** _INTEGRATIONS[unit]
    sff, sxx = np.sum(np.abs(force) ** 2, axis=0), np.sum(np.abs(response) ** 2, axis=0)
    sfx = np.sum(force.conj() * response, axis=0)
    variance, deviation, coherence = _scatter(force, response)
    return Frf(
        frequency=omega / (2.0 * np.pi),
        h1=sfx / sff * to_displacement,
        h2=sxx / sfx.conj() * to_displacement,
        hv=sfx / np.abs(sfx) * np.sqrt(sxx / sff) * to_displacement,
        # pooled as measured, where the noise is even: as displacement it rises steeply towards 0 Hz
        variance=variance * np.abs(to_displacement) ** 2,
        deviation=deviation * to_displacement,
        coherence=coherence,
        excited=_excited(np.sqrt(sff)),
        redundancy=length / max(kept for _, _, kept in gated),
        used=used,
        notes=tuple(notes),
    )


def _rejected(reasons: Sequence[str]) -> list[str]:
    return [f"hit {i + 1} rejected: {reason}" for i, reason in enumerate(reasons) if reason]


def _other_rates(hits: Sequence[Hit], reasons: Sequence[str]) -> list[str]:
    """Add to the reasons those hits whose sampling rate is not that of most."""
    rates = [hit.rate for hit in hits]
    most = max(rates, key=rates.count)
    others = f"{rates.count(most)} others at {most:g} Hz"
    return [
        reason or ("" if rate == most else f"sampled at {rate:g} Hz, {others}")
        for rate, reason in zip(rates, reasons, strict=True)
    ]


def _spectra(signals: Sequence[Array], length: int) -> ComplexArray:
    """Spectra of signals continued with zeros to ``length``, without the line at 0 Hz."""
    return np.stack([np.fft.rfft(signal, length)[1:] for signal in signals]).astype(np.complex128)


def _excited(level: Array) -> np.ndarray:
    """Lines that a hammer with the spectrum ``level`` (n,) excites: those of strong side lobes as well."""
    return np.asarray(level > _WEAK * level.max())


def _scatter(force: ComplexArray, response: ComplexArray) -> tuple[Array, ComplexArray, Array]:
    """Variance (n,) and deviations (k, n) of H1 from the scatter of k hits, and coherence (n,)."""
    hits, lines = force.shape
    if hits == 1:
        unknown = np.full(lines, np.nan)
        return unknown, np.zeros((0, lines), dtype=np.complex128), unknown
    sff, sxx = np.sum(np.abs(force) ** 2, axis=0), np.sum(np.abs(response) ** 2, axis=0)
    sfx = np.sum(force.conj() * response, axis=0)
    residual = response - sfx / sff * force
    left = np.sum(np.abs(residual) ** 2, axis=0) / (hits - 1)
    # A hit pulls the mean towards itself by its share of the force's power, which makes its residual smaller.
    share = np.abs(force) ** 2 / sff
    deviation = residual * force.conj() / sff / np.sqrt(1.0 - share)
    return pooled(left / sff), deviation, np.abs(sfx) ** 2 / (sff * sxx)


def pooled(values: Array, lines: int = _POOLED_LINES) -> Array:
    """Mean over ``lines`` neighbouring lines; the ends take what is there."""
    window = np.ones(min(lines, len(values)))
    count = np.convolve(np.ones(len(values)), window, mode="same")
    total: Array = np.convolve(values, window, mode="same") / count
    return total
