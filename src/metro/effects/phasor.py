"""What effects with a size and a direction share: how two of them add up."""

from __future__ import annotations

import math


def phasor_sum(size: float, angle: float, more: float, towards: float) -> tuple[float, float]:
    """Return size and angle, rad, of the sum of two plane vectors that are given by theirs.

    Where the first has no size, the second is returned as it is, whatever its sign and turn: a fit on a model
    without the effect sees its own parameters, to the last digit.
    """
    if size == 0.0:
        return more, towards
    x = size * math.cos(angle) + more * math.cos(towards)
    y = size * math.sin(angle) + more * math.sin(towards)
    return math.hypot(x, y), math.atan2(y, x)
