"""What the end of a descent says: intervals, whether it is the end, and which parameters a bound holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.covariance import between_runs, wider_than
from metro.loop.fitting.descent import farthest, free
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.system import (
    State,
    condition,
    inverse,
    linearised,
    normal_equations,
    solution,
)
from metro.observables.problem import Block
from metro.units import Array

# Where a prediction is rough (that of a tool too soft to be in balance) no step leads on down, although the
# derivatives promise one. An interval that is off by half a deviation holds the truth in 92 cases of 100.
CONVERGED = 0.5


class End(NamedTuple):
    """What a linearisation at the end of a descent says of it; see :class:`metro.loop.fitting.fit.Fit`."""

    covariance: Array
    wider: Array
    pressed: Array
    step: float
    condition: float


def end_of(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    state: State,
    slopes: Sequence[Array] | None = None,
) -> End:
    """Covariance of base and effect parameters, (p + q, p + q), and how well the end was reached.

    The base parameters scatter from run to run, and the runs say how far that leaves them off. What the model
    gets wrong where an effect shows may be the same in all runs: the variances of the effect parameters allow
    for that, and their intervals are wider still where the runs differ by more. Whether an effect is there is
    no question of how much of it there is in which run: conditions left out answer that. ``slopes``: of each
    block, derivatives that hold there.
    """
    system, wide = (
        linearised(candidate, blocks, kind, state, slopes=slopes)
        for kind in (noise, noise_room.all_alike(noise))
    )
    normal, right = normal_equations(system)
    covariance, alike = inverse(normal), inverse(normal_equations(wide)[0])
    p = len(state.beta)
    factor = between_runs(system)
    wider = wider_than(np.diag(alike)[p:], np.diag(covariance)[p:] * factor[p:] ** 2)
    factor[p:] = 1.0
    covariance *= np.outer(factor, factor)
    covariance[p:, p:] = alike[p:, p:]
    moving = free(candidate, state, right)
    still, downhill = normal[np.ix_(moving, moving)], right[moving]
    step = float((np.abs(solution(still, downhill)) / np.sqrt(np.diag(inverse(still)))).max(initial=0.0))
    if step > CONVERGED:
        step *= farthest(candidate, blocks, state, system)
    return End(covariance, wider, _pressed(normal, right, moving)[p:], step, condition(normal))


def _pressed(normal: Array, right: Array, moving: np.ndarray) -> Array:
    """Return by how many deviations each parameter at a bound, freed alone, would go beyond it, (p + q,).

    The bound keeps it from there, so that its own interval says nothing of how sure the runs are of that.
    """
    beyond = np.zeros(len(right))
    for place in np.flatnonzero(~moving):
        freed = moving.copy()
        freed[place] = True
        part, at = normal[np.ix_(freed, freed)], np.count_nonzero(freed[:place])
        variance = inverse(part)[at, at]
        step = float(solution(part, right[freed])[at])
        beyond[place] = abs(step) / math.sqrt(variance) if 0.0 < variance < np.inf else 0.0
    return beyond
