"""Dust on a stylus trace: spikes that are narrow, and stand out of what is beside them."""

from __future__ import annotations

import numpy as np

from metro.units import MM, Array

WINDOW = 1 * MM  # of the running median; waves that are longer pass it
WIDEST = 0.4 * MM  # grains and fibres are 0.05 to 0.2 mm wide, and the stylus adds its radius
STANDS_OUT = (
    5.0  # deviations from the median; marks of a feed reach two to three, noise five in a million points
)
BESIDE = 2.5  # deviations down to which the flanks belong to a spike
FLANK = 0.1 * MM  # on either side, which belongs to a spike although it no longer stands out
LEAST_POINTS = 9  # in the window
NEAR = 6 * MM  # of trace about a point, of which grains cover a few hundredths and marks of a tool tenths
COVERED = 0.1  # share of the trace nearby that stands out as far only where marks of the tool do
NORMAL = 1.645  # deviations that a tenth of normal noise exceeds on either side


def dust(x: Array, z: Array) -> np.ndarray:
    """Mark the points of a trace that lie on a narrow spike, (n,).

    A spike counts against the scatter of the whole trace about its running median (median absolute
    deviation), so that a rough wall has none because it is rough; and against what a tenth of the trace
    nearby exceeds, so that marks of chatter, which start half-way and are as sharp, are none: a grain is
    alone. What is wider than 0.4 mm is no dust.

    Parameters
    ----------
    x, z : (n,) position along the trace, m, in order, and height, m.
    """
    from scipy.ndimage import binary_dilation, label, median_filter, percentile_filter

    none = np.zeros(len(x), dtype=bool)
    spacing = float(np.median(np.diff(x))) if len(x) > 1 else 0.0
    points = 2 * round(WINDOW / spacing / 2) + 1 if spacing > 0.0 else 0
    if points < LEAST_POINTS or len(x) < 2 * points:
        return none
    stands = z - median_filter(z, points, mode="nearest")
    scatter = 1.4826 * float(np.median(np.abs(stands - np.median(stands))))
    if scatter == 0.0:
        return none
    far = np.abs(stands)
    nearby = percentile_filter(far, 100.0 * (1.0 - COVERED), round(NEAR / spacing), mode="reflect") / NORMAL
    far /= np.maximum(scatter, nearby)
    spikes, count = label(far > BESIDE)
    highest = np.zeros(count + 1)
    np.maximum.at(highest, spikes, far)
    wide = np.bincount(spikes, minlength=count + 1) * spacing > WIDEST
    is_dust = (highest > STANDS_OUT) & ~wide
    is_dust[0] = False
    return np.asarray(binary_dilation(is_dust[spikes], iterations=max(round(FLANK / spacing), 1)))
