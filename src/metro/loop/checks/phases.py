"""Whether an effect that nothing ties to the program has the same phase whenever a cut is repeated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from metro.loop.fitting.fit import Fit

TIED = 0.01  # chance that free phases agree as well over the repeats


@dataclass(frozen=True)
class Tied:
    """An effect whose phases agree in repeats: over ``pairs`` of runs the mean cosine of their difference."""

    effect: str
    pairs: int
    cosine: float


def tied(fitted: Fit) -> Tied | None:
    """Return the first effect of a fit whose phases agree in repeats of a condition; None: there is none.

    What is a function of time alone begins at any phase. What comes again in each pass, or stands at one
    place of the way, has the lines of a vibration too, but the same phase in every repeat. Of free phases the
    cosines of the n differences are uncorrelated, with mean zero and variance ½, so that their sum over
    √(n/2) is nearly normal; of two pairs or fewer it never reaches the level. An effect whose frequency runs
    of other speeds share is one in time, whatever started it.
    """
    from scipy.stats import norm

    free = [effect for effect in fitted.candidate.effects for _ in range(effect.own)]
    phases: dict[str, list[np.ndarray]] = {}
    for block in fitted.blocks:
        if block.role != "calibrate" and len(fitted.nuisance[block.run]) >= len(free):
            last = fitted.nuisance[block.run][len(fitted.nuisance[block.run]) - len(free) :]
            phases.setdefault(block.condition, []).append(last)
    apart = [one - other for runs in phases.values() for one, other in combinations(runs, 2)]
    for place, effect in enumerate(free):
        if effect.timed:
            continue
        cosines = np.cos([difference[place] for difference in apart])
        if len(cosines) and norm.sf(cosines.sum() / math.sqrt(0.5 * len(cosines))) < TIED:
            return Tied(effect.name, len(cosines), float(cosines.mean()))
    return None
