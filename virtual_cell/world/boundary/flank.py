"""Wear land of a cutting edge, pressed on the wave that the edge has just left.

The work under a land of width W springs back by a little and is squeezed flat again; the force is in
proportion to the volume that is squeezed (Wu, J. Eng. Ind. 111 (1989) 105; Chiou and Liang, Int. J. Mach.
Tools Manuf. 38 (1998) 1165: about 4e14 N/m³ for carbon steel; Ahmadi and Ismail, Int. J. Mach. Tools
Manuf. 51 (2011) 296: about 1.5e14 N/m³ for an aluminium alloy). The wave is much longer than the land, so the
surface under it is a straight line whose slope is the speed into the work over that of the cut. Where the
edge leaves the work steeply the land comes free of it: the force is no linear damping.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array


@dataclass(frozen=True)
class Flank:
    """A wear land.

    Attributes
    ----------
    land : its width, m. springback : of the work behind the edge, m. pressure : force per volume, N/m³.
    friction : of the land on the work. growth : relative growth of the width over the programme.
    """

    land: float
    springback: float
    pressure: float
    friction: float
    growth: float

    @property
    def viscous(self) -> float:
        """Force (N) per depth of cut (m) and slope of the surface, of a small wave: N/m."""
        return 0.5 * self.pressure * self.land**2

    def with_viscous(self, value: float) -> float:
        """Width of the land, m, that has such a force per depth and slope, N/m."""
        return float(np.sqrt(2.0 * value / self.pressure))

    def squeezed(self, slope: Array, worn: Array | float = 1.0) -> Array:
        """Force normal to the surface per depth of cut, N/m, where the edge moves into the work at a slope.

        ``worn``: factor on the width.
        """
        land = self.land * worn
        lies = self.springback * land + 0.5 * slope * land**2
        comes_free = -self.springback / land
        with np.errstate(divide="ignore"):
            tip = 0.5 * self.springback**2 / np.abs(slope)
        force: Array = self.pressure * np.where(slope > comes_free, lies, tip)
        return force

    def effective(self, slope: float) -> float:
        """Return the force in phase with a slope of this amplitude, over that of a small wave."""
        phase = 2.0 * np.pi * (np.arange(720) + 0.5) / 720
        force = self.squeezed(slope * np.sin(phase))
        return float(2.0 * np.mean(force * np.sin(phase)) / (slope * self.viscous))
