"""Errors of modes and coefficients, by which a predicted boundary is uncertain.

The scatter of blows is the least of them. The sensor of a hammer test has a mass, the machine is warmer in
the cut than it was at the test, and the spindle does not turn quite as fast as it says. All three move lobes
along the speed: hardly anything on a flat part of the boundary, a lot on a steep flank.

Verdicts on labels allow for them. The band of the diagram holds the scatter alone: its samples are to first
order, which on steep flanks goes far below the lowest depth that any frequency leads to.
"""

from __future__ import annotations

import numpy as np

from metro.units import Array

# Relative standard deviations. Temperature moves frequencies by 0.05 to 0.5 % from file to file: 0.3 %, of
# each mode by itself, and of all alike between the hammer test and the cuts.
OWN_SD, COMMON_SD = 0.003, 0.003
SENSOR = 0.01  # kg: usual sensors have 1 to 20 g, and lower a frequency by half their share of the modal mass


def frequency_sd(scatter: Array, modal_mass: Array) -> Array:
    """Relative standard deviations (m,) of the frequencies of m modes.

    Parameters
    ----------
    scatter : (m,) by the measurement alone, NaN where it is not known. modal_mass : (m,) at the tip, kg.
    """
    sensor = 0.5 * SENSOR / modal_mass
    return np.asarray(np.sqrt(np.nan_to_num(scatter) ** 2 + OWN_SD**2 + sensor**2))


def deviations(sd: Array, draws: int, seed: int) -> Array:
    """Draw errors (draws, 3 m + 2) of the logarithms of modes and coefficients.

    Parameters
    ----------
    sd : (3 m + 2,) standard deviations, of the frequencies first; NaN where they are not known.
    """
    rng = np.random.default_rng(seed)
    drawn = rng.normal(size=(draws, len(sd))) * np.nan_to_num(sd)
    drawn[:, : (len(sd) - 2) // 3] += COMMON_SD * rng.normal(size=(draws, 1))
    return np.asarray(drawn)
