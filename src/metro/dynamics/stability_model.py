"""All that the stability of a cut depends on, in parts that effects replace.

Softening needs no equation of its own: with mass and damping ratio constant, modes whose stiffness is ``f``
times as large are ``sqrt(f)`` times as fast. Depth over stiffness and speed over frequency are all that the
boundary depends on, so that at ``n`` it is ``f`` times what it is without softening at ``n / sqrt(f)``. With
``f`` of each speed, every speed has its own structure, and still all are solved as one stack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.units import Array


@dataclass(frozen=True)
class StabilityModel:
    """Structure and cut at one place.

    Attributes
    ----------
    structure : modes of the tip, at standstill.
    cuts : the cut in each direction in which it is fed; the least stable counts.
    radius : of the tool, m.
    softening : relative change of every stiffness per rev/min; mass and damping ratio are constant.
    """

    structure: Structure
    cuts: tuple[Cut, ...]
    radius: float
    softening: float = 0.0

    def boundary(self, rpm: Array) -> tuple[Array, Array]:
        """Lowest depths (k,), m, and chatter frequencies there (k,), Hz, at speeds (k,), rev/min.

        Raises
        ------
        ValueError
            When nothing is left of the stiffness at one of the speeds.
        """
        factor = 1.0 + self.softening * np.asarray(rpm, dtype=float)
        if np.any(factor <= 0.0):
            raise ValueError(f"no stiffness left at {np.max(rpm):g} rev/min")
        found = [stability_boundary(self.structure, cut, rpm / np.sqrt(factor)) for cut in self.cuts]
        depth = np.stack([one.depth for one in found])
        least = (depth.argmin(axis=0), np.arange(depth.shape[1]))
        chatter = np.stack([one.chatter_hz for one in found])[least]
        return factor * depth[least], np.sqrt(factor) * chatter
