"""Stylus profiles: the Gaussian filter of ISO 16610-21, and the bands that it parts a profile into."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.surface.dust import dust
from metro.units import MM, Array

ALPHA = math.sqrt(math.log(2.0) / math.pi)
KERNEL_SD = ALPHA / math.sqrt(2.0 * math.pi)  # of the Gaussian weights, per cut-off: 0.18739
ROUGHNESS_CUTOFF = 0.8 * MM


@dataclass(frozen=True, eq=False)
class Bands:
    """A profile parted by wavelength, each (n,) and in the profile's unit; together they are the profile.

    ``deformation`` is longer than the cut-off, ``roughness`` shorter than 0.8 mm, ``waviness`` between the
    two. Each may also be (n, k), of profiles side by side.
    """

    deformation: Array
    waviness: Array
    roughness: Array


def gaussian_filter(profile: Array, spacing: float, cutoff: float) -> Array:
    """Long-wave part of a profile: Gaussian filter, transmission 0.5 at ``cutoff`` (ISO 16610-21).

    Near the ends the weights that are left carry a first-order regression, so that a straight line passes
    unchanged everywhere; inside, that is the plain convolution. The kernel runs to ± one cut-off (weights of
    1e-6).

    Parameters
    ----------
    profile : (n,) or (n, k), evenly spaced along axis 0. spacing, cutoff : in the same unit.
    """
    from scipy.signal import oaconvolve

    reach = max(math.ceil(cutoff / spacing), 1)
    offset = np.arange(-reach, reach + 1) * (spacing / cutoff)
    weight = np.exp(-np.pi * (offset / ALPHA) ** 2)
    columns = profile.reshape(len(profile), -1)
    ones = np.ones((len(profile), 1))

    def moment(values: Array, power: int) -> Array:
        # correlation with weight · offset^power, written as a convolution with the mirrored kernel
        kernel = (weight * offset**power)[::-1, None]
        return np.asarray(oaconvolve(values, kernel, axes=0)[reach : reach + len(values)])

    m0, m1, m2 = (moment(ones, power) for power in range(3))
    smooth = (m2 * moment(columns, 0) - m1 * moment(columns, 1)) / (m0 * m2 - m1**2)
    return smooth.reshape(profile.shape)


def transmission(wavelength: Array, cutoff: float) -> Array:
    """Share of a wave's amplitude that :func:`gaussian_filter` passes: exp(−π (α cutoff/wavelength)²)."""
    return np.asarray(np.exp(-np.pi * (ALPHA * cutoff / wavelength) ** 2))


def part(profile: Array, spacing: float, cutoff: float, shortest: float = ROUGHNESS_CUTOFF) -> Bands:
    """Part an evenly spaced profile (n,) or profiles (n, k) by wavelength.

    ``spacing`` and ``cutoff`` in m; waves below ``shortest``, m, are roughness.
    """
    deformation = gaussian_filter(profile, spacing, cutoff)
    smooth = gaussian_filter(profile, spacing, shortest)
    return Bands(deformation, smooth - deformation, profile - smooth)


def noise_gain(spacing: float, cutoff: float) -> float:
    """Factor by which the filter lowers white noise on the points: ∫w² = 1/(2√π σ), σ that of the kernel."""
    return math.sqrt(min(spacing / (2.0 * math.sqrt(math.pi) * KERNEL_SD * cutoff), 1.0))


def even(x: Array, z: Array) -> tuple[Array, Array]:
    """Bring a trace to even spacing: sorted, without dust or points that have no value, linear between them.

    Parameters
    ----------
    x, z : (n,) position along the trace and height.

    Raises
    ------
    ValueError
        If a gap is longer than ten spacings, or fewer than 8 points are left.
    """
    known = np.isfinite(x) & np.isfinite(z)
    x, first = np.unique(x[known], return_index=True)
    z = z[known][first]
    if len(x) < 8:
        raise ValueError(f"a profile of {len(x)} points: at least 8 are needed")
    step = np.diff(x)
    spacing = float(np.median(step))
    if step.max() > 10 * spacing:
        place = int(np.argmax(step))
        raise ValueError(
            f"the profile has a gap of {step[place]:.3g} after x = {x[place]:.6g}, "
            f"where its points are {spacing:.3g} apart"
        )
    clean = ~dust(x, z)
    grid = np.linspace(x[0], x[-1], round((x[-1] - x[0]) / spacing) + 1)
    return grid, np.interp(grid, x[clean], z[clean])
