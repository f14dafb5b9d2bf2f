"""Standard error of the compared heights of a face from the noise of the scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import pandas as pd

from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.placing import plane_directions
from metro.observables.problem import Block
from metro.surface.footprint import RADIUS
from metro.units import MM, Array

LAG = 2  # bins: discs and noise of neighbouring bins overlap, those of the next but one do not
LEAST = 20  # differences from which the noise can be estimated
SAME = 1e-12  # m: heights that differ by less are of one file
MEDIAN = 1.4826  # standard deviation over median absolute deviation of a normal distribution


def bin_sigma(measured: Array, table: pd.DataFrame, setting: FaceSetting) -> Array:
    """Return the standard error of the mean height in each bin, (n,) m.

    The scatter within a disc is a poor estimate if it has only a few points that share their noise. So the
    estimate is the median of the second differences between bins along the lines of the path. A smooth face
    has none, and the ringing of the tip behind the entry does not change the median. The error scales with
    the number of discs in a bin. With too few bins, the errors of the discs are used.

    Parameters
    ----------
    measured : (n,) mean heights, m. table : rows of the points, one line of the path after another.
    """
    discs = np.diff(np.append(setting.first, len(table)))
    line = np.cumsum(np.diff(table["pass"].to_numpy(), prepend=-1) != 0)[setting.first]
    before, after = slice(None, -2 * LAG), slice(2 * LAG, None)
    middle = slice(LAG, -LAG)
    second = measured[before] - 2.0 * measured[middle] + measured[after]
    scale = np.sqrt(1.0 / discs[before] + 4.0 / discs[middle] + 1.0 / discs[after])
    within = line[before] == line[after]
    alone = np.sqrt(setting.binned((table["sigma_mm"].to_numpy() * MM) ** 2) / discs)
    if within.sum() < LEAST:
        return np.asarray(alone)
    one = MEDIAN * float(np.median(np.abs(second / scale)[within]))
    return np.asarray(max(one, float(np.spacing(np.abs(measured).max()))) / np.sqrt(discs))


def without_what_repeats(blocks: Sequence[Block]) -> list[Block]:
    """Return the blocks with standard errors that are no larger than repeats of their condition differ by.

    Ringing with short waves and steps between passes are no noise, but :func:`bin_sigma` takes them for it;
    they come again in every repeat. A larger difference does not count, because it may be of a cause that is
    sought: a vibration has another phase in every face. Runs of one role are compared among themselves.
    """
    squares: dict[tuple[str, str], list[float]] = {}
    for one, other in combinations(blocks, 2):
        if (one.condition, one.role) == (other.condition, other.role):
            squares.setdefault((one.condition, one.role), []).extend(_differing(one, other))
    smaller = {
        key: min(1.0, float(np.sqrt(np.mean(found)))) if found else 1.0 for key, found in squares.items()
    }
    return [
        replace(block, sigma=block.sigma * smaller.get((block.condition, block.role), 1.0))
        for block in blocks
    ]


def _differing(one: Block, other: Block) -> list[float]:
    """Return the variance of the difference of two faces over what their errors say, robust; or nothing.

    Each face has a place of its own: height and tilts of the difference do not count. One scan in two runs is
    no repeat, and says nothing.
    """
    from scipy.spatial import cKDTree

    here, there = (np.column_stack([b.coordinates["x_mm"], b.coordinates["y_mm"]]) for b in (one, other))
    away, nearest = cKDTree(there).query(here, distance_upper_bound=RADIUS / MM)
    both = np.isfinite(away)
    if both.sum() < LEAST:
        return []
    nearest = nearest[both]
    if np.median(np.abs(one.measured[both] - other.measured[nearest])) < SAME:
        return []
    error = np.hypot(one.sigma[both], other.sigma[nearest])
    apart = (one.measured[both] - other.measured[nearest]) / error
    plane = plane_directions(*here[both].T) / error[:, None]
    apart = apart - plane @ np.linalg.lstsq(plane, apart, rcond=None)[0]
    return [(MEDIAN * float(np.median(np.abs(apart)))) ** 2]
