"""Rounding of joint readings, or of the set-points in their place: its step, and what it moves points by.

Where all readings of a joint are multiples of what the closest two are apart by, that is the step: by chance
each would be so with a probability of one fifth.
"""

from __future__ import annotations

import numpy as np

from metro.robot.calibration.fit import Fit
from metro.robot.calibration.measured import seen
from metro.robot.calibration.model import jacobian, turning
from metro.robot.calibration.poses import Poses
from metro.units import DEG, Array

LARGEST = 0.2 * DEG  # of a step (m of a joint that shifts: 3.5 mm); coarser ones are those of a programme
FEWEST = 12  # readings that differ: that all are multiples by chance is less likely than 1 in 10⁸
OFF = 0.1  # of a step by which a multiple of it may be off: digits of a file


def steps(q: Array) -> Array:
    """Return the step of each joint's readings ``q`` (m, n), rad or m; 0 of those that have none."""
    found = np.zeros(q.shape[1])
    for joint, values in enumerate(q.T):
        distinct = np.unique(values)
        if len(distinct) < FEWEST:
            continue
        apart = np.diff(distinct)
        tiny = 1e-6 * float(np.median(apart))
        step = float(apart[apart > tiny].min())
        multiples = (distinct - distinct[0]) / step
        if step < LARGEST and bool(np.all(np.abs(multiples - np.round(multiples)) < OFF)):
            found[joint] = float(np.ptp(distinct)) / float(np.round(multiples[-1]))
    return found


def moved_by_rounding(fit: Fit, poses: Poses) -> tuple[Array, float]:
    """Return the steps (n,) of the readings, and what they move a coordinate or the distance by, rms, m.

    A rounded reading is off by anything within half a step: by the step over the root of twelve, rms.
    """
    found = steps(poses.q)
    at, derivatives = jacobian(fit.state, poses.q)
    moves = seen(fit.state, at, poses, turning(fit.state, derivatives)) * found / np.sqrt(12.0)
    return found, float(np.sqrt(np.mean(np.sum(moves**2, axis=2))))
