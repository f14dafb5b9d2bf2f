"""Whether runs scatter far beyond what runs of a sound session do.

The scatter of the base parameters from run to run is estimated with each fit, so that it takes up whatever
makes runs differ, be it a machine that warms up while repeats are cut in random order. Such a model has no
residual that is more than its noise, and is wrong all the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.noise import Noise


@dataclass(frozen=True)
class Restless:
    """Scatter beyond the usual.

    ``relative``: rms of what the scatter changes in the prediction, over the signal; ``times`` the usual one;
    ``p_value`` of a scatter as large if it were the usual one.
    """

    relative: float
    times: float
    p_value: float


def restless(fitted: Fit, prior: Noise) -> Restless | None:
    """Compare the scatter that a fit estimates with the usual one, ``prior``; None without base parameters.

    The usual scatter is worth as many runs as the estimate is drawn towards it with: F has these degrees of
    freedom below, and the runs' above.
    """
    from scipy.stats import f

    runs = [block for block in fitted.blocks if block.role != "calibrate"]
    if not len(at := prior.scattering) or not runs:
        return None
    times = float(np.mean(fitted.noise.scatter[at] / prior.scatter[at]))
    known = noise_room.PRIOR_RUNS
    own = ((known + len(runs)) * times**2 - known) / len(runs)
    model = fitted.candidate.model(fitted.theta)
    moved, signal = 0.0, 0.0
    for block in runs:
        matrix, _ = model.design(block, fitted.nuisance[block.run], fitted.beta)
        moved += float(np.sum((matrix * (fitted.beta * fitted.noise.scatter)) ** 2))
        signal += float(np.sum(block.measured**2))
    return Restless(math.sqrt(moved / signal), times, float(f.sf(max(own, 0.0), len(runs), known)))
