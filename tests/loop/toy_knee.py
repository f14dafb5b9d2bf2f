"""Two effects of the toy that differ at large feed alone."""

from dataclasses import dataclass

import numpy as np
from toy import ANGLE, Wave, effect

KNEE = 4.0


@dataclass(frozen=True)
class Knee(Wave):
    """A wave whose ``stop`` bends it like ``bend`` up to a feed of four, and no further."""

    stop: float = 0.0

    def design(self, block, nuisance, beta=None):
        matrix, offset = super().design(block, nuisance, beta)
        tau = ANGLE - (nuisance[0] if len(nuisance) else 0.0)
        matrix[:, 0] += self.stop * min(block.setting.feed, KNEE) * np.cos(3 * tau)
        return matrix, offset


STOP = effect("stop", "stop")
