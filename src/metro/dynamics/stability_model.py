"""All that the stability of a cut depends on, in parts that effects replace.

Softening needs no equation of its own: with mass and damping ratio constant, modes whose stiffness is ``f``
times as large are ``sqrt(f)`` times as fast. Depth over stiffness and speed over frequency are all that the
boundary depends on, so that at ``n`` it is ``f`` times what it is without softening at ``n / sqrt(f)``. With
``f`` of each speed, every speed has its own structure, and still all are solved as one stack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.dynamics.zero_order import zero_order_boundary
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
        factor = self._factor(rpm)
        found = [stability_boundary(self.structure, cut, rpm / np.sqrt(factor)) for cut in self.cuts]
        depth = np.stack([one.depth for one in found])
        least = (depth.argmin(axis=0), np.arange(depth.shape[1]))
        chatter = np.stack([one.chatter_hz for one in found])[least]
        return factor * depth[least], np.sqrt(factor) * chatter

    def _factor(self, rpm: Array) -> Array:
        factor: Array = 1.0 + self.softening * np.asarray(rpm, dtype=float)
        if np.any(factor <= 0.0):
            raise ValueError(f"no stiffness left at {np.max(rpm):g} rev/min")
        return factor


def estimated(models: Sequence[StabilityModel], rpm: Array) -> tuple[Array, Array]:
    """Lowest depths (t, k) and chatter frequencies there (t, k) of t models, to zeroth order.

    The models have equally many modes, and cuts that differ in process damping alone.
    """
    factor = np.stack([model._factor(rpm) for model in models])
    structures = [model.structure for model in models]
    slowed = rpm / np.sqrt(factor)
    found = [
        zero_order_boundary(structures, cuts, slowed) for cuts in zip(*(m.cuts for m in models), strict=True)
    ]
    depth, chatter = (np.stack(part) for part in zip(*found, strict=True))
    least = depth.argmin(axis=0)[None]
    chosen = (np.take_along_axis(part, least, axis=0)[0] for part in (depth, chatter))
    lowest, hz = chosen
    return factor * lowest, np.sqrt(factor) * hz
