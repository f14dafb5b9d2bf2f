"""How the arm's tip moves in a pass: the mean force comes on and goes off, and the tip's modes ring.

The teeth pass far above the modes of the arm, so the force that moves the tip is the mean over a revolution,
which rises while the cutter enters the block and falls while it leaves. M Ẍ + C Ẋ + K X = F(t) is solved by
its modes in the frequency domain over one period (pass and return): a face is cut in equal passes, and what
rings on from one reaches the next.
"""

from __future__ import annotations

import numpy as np

from metro.units import Array


def tip_heights(
    mass: Array, stiffness: Array, damping: float, *, force: Array, period: float, disc: float = 0.0
) -> Array:
    """Height of the tip over a period, in m, pass by pass: (passes, n).

    Parameters
    ----------
    mass : (3, 3) reduced to the tip, kg. stiffness : (passes, 3, 3), N/m, taken as constant within a pass.
    damping : damping ratio of all modes.
    force : (n, 3) on the tip at even times over the ``period`` (s), N.
    disc : s, time that the tool takes to travel the radius of the disc over which heights are averaged.
    """
    frequency, shape = _modes(mass, stiffness)
    rate = np.asarray(2 * np.pi * np.fft.rfftfreq(len(force), period / len(force)), dtype=np.float64)
    load = np.fft.rfft(force, axis=0)
    modal = load @ shape
    size = frequency[:, None, :]
    receptance = 1 / (size**2 - rate[:, None] ** 2 + 2j * damping * size * rate[:, None])
    spectrum = ((modal * receptance) @ shape[:, 2, :, None])[:, :, 0] * _disc_transmission(rate * disc)
    return np.fft.irfft(spectrum, n=len(force), axis=1)


def _modes(mass: Array, stiffness: Array) -> tuple[Array, Array]:
    """Undamped frequencies (passes, 3), rad/s, and mass-normalised shapes (passes, 3, 3), a column each."""
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    square, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    return np.sqrt(square), inverse.T @ vectors


def _disc_transmission(wave: Array) -> Array:
    """Share of a wave that its mean over a disc keeps, ``wave`` = 2π radius over wavelength."""
    from scipy.special import j1

    safe = np.where(wave > 1e-6, wave, 1.0)
    return np.where(wave > 1e-6, 2 * j1(safe) / safe, 1.0)
