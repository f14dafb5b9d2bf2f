"""The chips that passes leave, on grids of immersions: for tests that search them for ends and kinks."""

import math

import numpy as np

from metro.compiled import compiled_with_arrays
from metro.cutting.arcs import EVERYWHERE, empty_arc, find_arc
from metro.cutting.corners import RawHere
from metro.cutting.passes import chip_left, chip_slope, row_of


@compiled_with_arrays
def chips_left(scale, rows, immersion):
    """Chip (passes, n) that passes (passes, 7) leave at immersions (n,), m."""
    chips = np.empty((len(rows), len(immersion)))
    for m in range(len(rows)):
        for i, phi in enumerate(immersion):
            chips[m, i] = chip_left(scale, row_of(rows, m), math.sin(phi), math.cos(phi))
    return chips


@compiled_with_arrays
def chip_slopes(scale, rows, immersion):
    """Change (passes, n) of that with the immersion, m/rad."""
    slopes = np.empty((len(rows), len(immersion)))
    for m in range(len(rows)):
        for i, phi in enumerate(immersion):
            slopes[m, i] = chip_slope(scale, row_of(rows, m), math.sin(phi), math.cos(phi))
    return slopes


def bounds_of(before, raw, angle, tooth):
    """Bounds of the arc of a tooth at an angle of the tool, rad, and what corners there are."""
    rows = before.rows[angle % len(before.rows), tooth % before.rows.shape[1]]
    at, arc = angle % raw.line.shape[1], empty_arc(len(rows))
    here = RawHere(tuple(raw.immersion[:, at].tolist()), tuple(raw.line[:, at].tolist()))
    count = find_arc(before.scale, rows, here, EVERYWHERE, arc)
    return arc.bounds[:count], arc.corner
