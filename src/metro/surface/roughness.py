"""Roughness of a stylus trace: Ra and Rz of ISO 21920-2 (formerly ISO 4287)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.profile import ROUGHNESS_CUTOFF, even, gaussian_filter
from metro.units import Array


@dataclass(frozen=True)
class Roughness:
    """Mean height ``ra`` and mean peak-to-valley height over section lengths ``rz``, m."""

    ra: float
    rz: float


def roughness(x: Array, z: Array) -> Roughness:
    """Roughness of a trace ``x``, ``z`` (n,), m, above the cut-off of 0.8 mm.

    Half a cut-off is left off at both ends, where the filter has less than its weights. A section is as long
    as the cut-off.

    Raises
    ------
    ValueError
        If there is not one whole section, or the points are too far apart: five to a cut-off at least.
    """
    x, z = even(x, z)
    spacing = float(x[1] - x[0])
    if spacing > ROUGHNESS_CUTOFF / 5.0:
        raise ValueError(
            f"points {spacing:.3g} m apart: roughness needs {ROUGHNESS_CUTOFF / 5.0:.3g} m or less"
        )
    section, margin = round(ROUGHNESS_CUTOFF / spacing), round(0.5 * ROUGHNESS_CUTOFF / spacing)
    rough = (z - gaussian_filter(z, spacing, ROUGHNESS_CUTOFF))[margin : len(z) - margin]
    count = len(rough) // section
    if count < 1:
        raise ValueError(
            f"a trace of {x[-1] - x[0]:.3g} m: roughness needs {2.0 * ROUGHNESS_CUTOFF:.3g} m or more"
        )
    sections = rough[: count * section].reshape(count, section)
    return Roughness(float(np.abs(rough).mean()), float(np.ptp(sections, axis=1).mean()))
