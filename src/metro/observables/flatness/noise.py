"""Standard error of the compared heights of a face from the noise of the scan."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.observables.flatness.model import FaceSetting
from metro.units import MM, Array

LAG = 2  # bins: discs and noise of neighbouring bins overlap, those of the next but one do not
LEAST = 20  # differences from which the noise can be estimated
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
