"""Charge amplifier, filter and converter: drift, discharge, a zero of another time, phase, steps, a clock."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_signed, drawn_size
from virtual_cell.noise import quantised
from virtual_cell.units import Array


@dataclass(frozen=True)
class Amplifier:
    """What lies between quartz and file.

    Attributes
    ----------
    drift : (3,) N/s. constant : (3,) s, of the discharge. waits : least and most time between the reset and a
        record, s.
    order, cutoff : of the anti-alias filter (Butterworth), and its frequency in parts of the rate.
    rate : declared, Hz. fast : by how much its clock is, as a share. step, capacity : N.
    """

    drift: Array
    constant: Array
    waits: tuple[float, float]
    order: int
    cutoff: float
    rate: float
    fast: float
    step: float
    capacity: float

    def filter(self, hz: Array) -> Array:
        """Response (n,) of the anti-alias filter."""
        s = 1j * hz / (self.cutoff * self.rate)
        angles = math.pi * (2.0 * np.arange(self.order) + self.order + 1.0) / (2.0 * self.order)
        out = np.ones_like(s)
        for pole in np.exp(1j * angles):
            out = out * (-pole / (s - pole))
        return np.asarray(out)


def drawn_amplifier(rate: float, rng: np.random.Generator) -> Amplifier:
    """Draw an amplifier on its long time constant, and a converter of 12 to 16 bit."""
    capacity = float(rng.choice([1000.0, 2000.0, 5000.0]))
    bits = int(rng.choice([12, 14, 16, 16]))
    return Amplifier(
        np.array([drawn_signed(rng, 0.01, 1.0) for _ in range(3)]),
        np.array([drawn_size(rng, 150.0, 1000.0) for _ in range(3)]),
        (0.3, drawn_size(rng, 2.0, 30.0)),
        int(rng.integers(2, 9)),
        float(rng.uniform(0.25, 0.45)),
        rate,
        drawn_signed(rng, 1e-6, 1e-4),
        2.0 * capacity / 2**bits,
        capacity,
    )


def slow(amplifier: Amplifier, load: Array, rate: float, held: Array, cut_before: float) -> Array:
    """Discharge a load (n, 3), N, at ``rate``, that has been ``held`` (3,) for ``cut_before`` s.

    Each axis is a first-order high pass, stepped exactly.
    """
    from scipy import signal

    out = np.empty_like(load)
    for axis in range(3):
        constant = float(amplifier.constant[axis])
        keep = math.exp(-1.0 / (rate * constant))
        lost = held[axis] * (1.0 - math.exp(-cut_before / constant))
        gone, _ = signal.lfilter([1.0 - keep], [1.0, -keep], load[:, axis], zi=[keep * lost])
        out[:, axis] = load[:, axis] - gone
    return out


def zeros(amplifier: Amplifier, rng: np.random.Generator) -> Array:
    """Return the reading (3,), N, of no force as a record starts: drift since the reset, and a jump."""
    low, high = amplifier.waits
    wait = math.exp(rng.uniform(math.log(low), math.log(high)))
    return np.asarray(amplifier.drift * wait + 0.3 * rng.standard_normal(3))


def converted(amplifier: Amplifier, read: Array) -> Array:
    """Return readings as the converter gives them, N."""
    return quantised(np.clip(read, -amplifier.capacity, amplifier.capacity), amplifier.step)
