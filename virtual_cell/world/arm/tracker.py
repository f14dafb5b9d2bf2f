"""A laser tracker that reads load tests: noise by distance and angle, refraction, beams that were broken.

Accuracy by makers' statements (ISO 10360-10): 5 to 40 µm in all, a part along the beam and one across it that
grows with the distance; air that is not as warm as it is taken to be, 1 µm/m per kelvin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.units import UM, Array
from virtual_cell.world.draws import between, towards


@dataclass(frozen=True, eq=False)
class Tracker:
    """``station`` (3,) m in the base. ``along`` m; ``across`` rad: noise of one reading.

    ``air`` relative, by which distances change within a test. ``outliers`` share of the readings that a
    broken beam shifted by about ``jump`` m.
    """

    station: Array
    along: float
    across: float
    air: float
    outliers: float
    jump: float

    def read(self, place: Array, moved: Array, rng: np.random.Generator) -> Array:
        """Displacement (3,), m, of a point at ``place`` (3,), both in the base: loaded less unloaded."""
        beam = place - self.station
        distance = float(np.linalg.norm(beam))
        beam = beam / distance
        noise = np.sqrt(2.0) * distance * self.across * rng.standard_normal(3)
        noise += beam * (np.sqrt(2.0) * self.along * rng.standard_normal() - beam @ noise)
        noise += beam * distance * self.air * rng.standard_normal()
        if rng.uniform() < self.outliers:
            noise += self.jump * rng.exponential() * towards(rng)
        return np.asarray(moved + noise)


def drawn(rng: np.random.Generator) -> Tracker:
    """Draw an instrument, and where it stands: 3 to 6 m from the arm."""
    bearing, away = rng.uniform(-1.0, 1.0), rng.uniform(3.0, 6.0)
    return Tracker(
        np.array([away * np.cos(bearing), away * np.sin(bearing), rng.uniform(0.8, 1.8)]),
        along=between(rng, 2.0, 10.0) * UM,
        across=between(rng, 1.0, 6.0) * UM,
        air=between(rng, 0.1, 1.0) * UM,
        outliers=between(rng, 0.002, 0.02),
        jump=between(rng, 40.0, 300.0) * UM,
    )
