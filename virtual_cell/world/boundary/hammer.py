"""Impact tests as they are made: blows beside the axis, double blows, soft tips, a sensor that has a mass.

Nothing is handed over exactly. The response is that of the whole structure to the whole pulse; transfer
functions are averages over the blows (H1), with their coherence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.noise import sensor_noise
from virtual_cell.units import DEG, Array
from virtual_cell.world.boundary.resonances import Resonances

_PRE, _LONGER = 0.023, 3  # s before the blow; length that is computed over the one recorded


@dataclass(frozen=True)
class Hammer:
    """How a machine is struck.

    Attributes
    ----------
    rate, seconds : of a record. hits : blows in each direction. peak : N.
    tip_hz : frequency at which the force of the tip has fallen to a tenth.
    astray : (2,) rad, by which the blows in x and y miss their direction; scatter : rad, from blow to blow.
    sensor_astray : (2,) rad. mass : of the sensor, kg. reversed : (2,) whether it looks the other way.
    warmth : (2,) relative change of all frequencies from each direction's test to the cuts.
    double : share of blows that strike twice.
    force_noise, response_noise : relative to the peak, and to the rms, of what is measured.
    """

    rate: float
    seconds: float
    hits: int
    peak: float
    tip_hz: float
    astray: tuple[float, float]
    scatter: float
    sensor_astray: tuple[float, float]
    mass: float
    reversed: tuple[bool, bool]
    warmth: tuple[float, float]
    double: float
    force_noise: float
    response_noise: float

    @property
    def pulse(self) -> float:
        """Width of the half-sine, s: the spectrum of one of width T falls to a tenth at 1.304 / T."""
        return 1.304 / self.tip_hz


def drawn(rng: np.random.Generator, highest: float) -> Hammer:
    """Draw a hammer test of a structure whose highest frequency is ``highest``, Hz, which its tip reaches."""
    signs = rng.choice([-1.0, 1.0], 2)
    return Hammer(
        rate=float(rng.choice([4096.0, 5120.0, 8192.0])),
        seconds=float(rng.choice([1.0, 2.0])),
        hits=int(rng.integers(3, 8)),
        peak=_between(rng, 80.0, 600.0),
        tip_hz=_between(rng, max(1000.0, 1.23 * highest), 3000.0),
        astray=tuple((signs * [_between(rng, 2.0, 10.0) * DEG for _ in range(2)]).tolist()),
        scatter=_between(rng, 0.5, 3.0) * DEG,
        sensor_astray=tuple((rng.normal(0.0, 1.5, 2) * DEG).tolist()),
        mass=_between(rng, 1e-3, 20e-3),
        reversed=tuple((rng.random(2) < 0.02).tolist()),
        warmth=tuple((rng.choice([-1.0, 1.0], 2) * [_between(rng, 5e-4, 5e-3) for _ in range(2)]).tolist()),
        double=float(rng.choice([0.0, _between(rng, 0.05, 0.3)])),
        force_noise=_between(rng, 5e-4, 4e-3),
        response_noise=_between(rng, 3e-3, 4e-2),
    )


def struck(
    structure: Resonances, hammer: Hammer, axis: int, flats: float, rng: np.random.Generator
) -> list[dict[str, Array]]:
    """Return the records of all blows along an axis (0: x, 1: y), columns of the contract.

    ``flats``: angle by which what the operator takes for x and y is turned, rad.
    """
    felt = structure.felt_by_hammer().warmer(hammer.warmth[axis])
    aimed = flats + axis * math.pi / 2.0
    looks = aimed + hammer.sensor_astray[axis]
    sensor = np.array([math.cos(looks), math.sin(looks)]) * (-1.0 if hammer.reversed[axis] else 1.0)
    count = round(hammer.seconds * hammer.rate)
    frequency = np.fft.rfftfreq(count * _LONGER, 1.0 / hammer.rate)
    accelerance = -((2.0 * math.pi * frequency[:, None, None]) ** 2) * felt.receptance(frequency, hammer.mass)
    records: list[dict[str, Array]] = []
    for _ in range(hammer.hits):
        along = aimed + hammer.astray[axis] + hammer.scatter * rng.standard_normal()
        force, spectrum = _blow(hammer, count, frequency, rng)
        into = np.array([math.cos(along), math.sin(along)])
        motion = np.fft.irfft((accelerance @ into) @ sensor * spectrum, count * _LONGER)[:count]
        force = force + sensor_noise(count, hammer.force_noise * hammer.peak, rng, pink=0.2)
        motion = motion + sensor_noise(count, hammer.response_noise * float(motion.std()), rng, pink=0.2)
        records.append({"t_s": np.arange(count) / hammer.rate, "force_n": force, "response": motion})
    return records


def _blow(hammer: Hammer, count: int, frequency: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Force (count,) of a blow, behind its anti-alias filter, and its spectrum over the longer time."""
    width = hammer.pulse * rng.uniform(0.85, 1.15)
    pulses = [(_PRE + rng.uniform(0.0, 0.01), hammer.peak * rng.uniform(0.5, 1.4))]
    if rng.random() < hammer.double:
        pulses.append((pulses[0][0] + rng.uniform(0.01, 0.06), pulses[0][1] * rng.uniform(0.05, 0.4)))
    omega = 2.0 * math.pi * frequency
    spectrum = np.zeros(len(frequency), dtype=complex)
    for start, peak in pulses:
        spectrum += peak * _half_sine(omega, width) * np.exp(-1j * omega * (start + 0.5 * width))
    spectrum *= hammer.rate / np.sqrt(1.0 + (frequency / (0.4 * hammer.rate)) ** 16)
    return np.fft.irfft(spectrum, count * _LONGER)[:count], spectrum


def _half_sine(omega: Array, width: float) -> Array:
    """Fourier integral of a half-sine of height 1, about its middle, s."""
    x = omega * width / math.pi
    away = np.where(np.abs(x - 1.0) < 1e-6, 1.0 + 1e-6, x)
    value: Array = 2.0 * width / math.pi * np.cos(0.5 * math.pi * away) / (1.0 - away**2)
    return value


def averaged(records: list[dict[str, Array]], rate: float) -> tuple[Array, Array, Array]:
    """Frequencies, Hz, receptance (H1), m/N, and coherence of all blows, without the line at zero."""
    force = np.array([np.fft.rfft(one["force_n"]) for one in records])
    response = np.array([np.fft.rfft(one["response"]) for one in records])
    frequency = np.fft.rfftfreq(len(records[0]["force_n"]), 1.0 / rate)[1:]
    cross = (response * force.conj()).sum(axis=0)[1:]
    powers = ((np.abs(one) ** 2).sum(axis=0)[1:] for one in (force, response))
    of_force, of_response = powers
    receptance = -cross / of_force / (2.0 * math.pi * frequency) ** 2
    return frequency, receptance, np.abs(cross) ** 2 / (of_force * of_response)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))
