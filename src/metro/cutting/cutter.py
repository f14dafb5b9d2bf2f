"""The rotating tool: teeth, helix, and how far its axis is from the axis of rotation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.units import Array


@dataclass(frozen=True)
class Cutter:
    """A cutter (SI): cylindrical, or with a corner radius, a ball end or an inclined flank.

    Attributes
    ----------
    radius : m: of the cylinder; of a tapered tool where its flank would begin without a corner, at the tip.
    helix : rad.
    tooth_angles : angle of each tooth from tooth 0, clockwise, rad. Tooth j+1 cuts before tooth j.
    runout_radius, runout_angle : offset of the tool's axis, m, and its direction from tooth 0, clockwise,
        rad.
    reach : (N,) how much farther each tooth reaches than the radius, m; empty: none does.
    corner : radius of the corner at the tip, m: the radius itself for a ball end.
    taper : angle between flank and tool axis, rad: 90° less the cutting edge angle of inserts.
    """

    radius: float
    helix: float
    tooth_angles: tuple[float, ...]
    runout_radius: float = 0.0
    runout_angle: float = 0.0
    reach: tuple[float, ...] = ()
    corner: float = 0.0
    taper: float = 0.0

    @property
    def cylindrical(self) -> bool:
        """Whether the edges are on a cylinder down to the tip."""
        return self.corner == 0.0 and self.taper == 0.0

    @property
    def teeth(self) -> int:
        """Number of teeth."""
        return len(self.tooth_angles)

    @property
    def lag_per_depth(self) -> float:
        """Angle by which the edge lags per metre of height, rad/m: tan(helix)/radius."""
        return math.tan(self.helix) / self.radius

    def pitch(self, steps: int) -> Array:
        """Angle from each tooth clockwise to the one ``steps`` on, which cut here before it, (N,) rad."""
        return np.asarray(pitches(self.tooth_angles, steps)[-1])

    def radius_deviation(self, height: Array) -> Array:
        """Return how far each tooth is from the axis of rotation, less the radius: (N, heights) m."""
        angles = np.asarray(self.tooth_angles)[:, None]
        towards = self.runout_angle - angles + self.lag_per_depth * height[None, :]
        return self.runout_radius * np.cos(towards) + (np.array(self.reach)[:, None] if self.reach else 0.0)

    def about_axis(self, height: float) -> Cutter:
        """Return the cutter with each tooth at its angle about the axis of rotation, at a height, m.

        Runout moves a tooth along its circle as well, by ρ/R sin(λ − α_j + κz): it comes early or late.
        """
        angles = np.asarray(self.tooth_angles)
        towards = self.runout_angle - angles + self.lag_per_depth * height
        angles = angles + (self.runout_radius / self.radius) * np.sin(towards)
        return replace(self, tooth_angles=tuple(angles.tolist()))


def evenly_pitched(teeth: int) -> tuple[float, ...]:
    """Tooth angles of a cutter with equal pitch, rad."""
    return tuple(2.0 * math.pi * j / teeth for j in range(teeth))


@lru_cache(maxsize=256)
def pitches(tooth_angles: tuple[float, ...], passes: int) -> Array:
    """Angles (passes, N) from each tooth clockwise to those that cut here 1… passes before it, rad."""
    angles = np.asarray(tooth_angles)
    ahead = np.arange(len(angles)) + np.arange(1, passes + 1)[:, None]
    turns, tooth = np.divmod(ahead, len(angles))
    pitch = np.asarray(angles[tooth] + 2.0 * math.pi * turns - angles)
    pitch.flags.writeable = False
    return pitch
