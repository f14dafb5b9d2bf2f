"""A stylus instrument on a wall: the form of its traverse, levelling, zero, dust, and its own noise.

Traverse units are straight to 0.2 to 2 µm over 100 mm, are levelled by eye to some 0.01 mrad against the zero
of the programmed wall, and meet dust and chips (ISO 25178-601; makers' catalogues).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.noise import quantised, sensor_noise
from virtual_cell.units import MM, UM, Array
from virtual_cell.world.draws import between


@dataclass(frozen=True)
class Stylus:
    """The instrument; lengths in m.

    ``noise`` of the pick-up; ``form`` amplitude of the traverse's bow over ``stroke``; ``level`` rad,
    standard deviation of the slope of a trace; ``zero`` that of its height, ``slide`` that of its start along
    the wall; ``dust`` grains per metre, of heights about ``grain``; ``step`` between readings.
    """

    noise: float
    form: float
    bow: tuple[float, float]
    level: float
    zero: float
    slide: float
    dust: float
    grain: float
    step: float
    stroke: float = 120.0 * MM

    def places(self, length: float) -> Array:
        """Places (n,), m, at which a wall of some length is read."""
        return np.arange(0.4 * MM, length - 0.8 * MM, self.step)

    def read(self, x: Array, height: Array, rng: np.random.Generator) -> dict[str, Array]:
        """Trace of heights (n,), m, at places ``x`` (n,): columns of the contract."""
        u = x / self.stroke
        straight = self.form * (np.sin(np.pi * u + self.bow[0]) + 0.3 * np.sin(3.4 * np.pi * u + self.bow[1]))
        settled = rng.normal(0.0, self.zero) + rng.normal(0.0, self.level) * (x - x.mean())
        z = (
            height
            + straight
            + settled
            + self.specks(x, rng)
            + sensor_noise(len(x), self.noise, rng, pink=0.6)
        )
        return {"x_mm": (x + rng.normal(0.0, self.slide)) / MM, "z_mm": quantised(z, 0.01 * UM) / MM}

    def specks(self, x: Array, rng: np.random.Generator) -> Array:
        """Dust (n,), m, over which the stylus rides."""
        count = rng.poisson(self.dust * float(x[-1] - x[0]))
        at = rng.uniform(x[0], x[-1], count)
        high, wide = rng.exponential(self.grain, count), rng.uniform(0.05, 0.25, count) * MM
        bumps: Array = (high * np.exp(-(((x[:, None] - at) / wide) ** 2))).sum(axis=1)
        return bumps


def drawn(rng: np.random.Generator) -> Stylus:
    """Draw an instrument."""
    return Stylus(
        noise=round(between(rng, 0.15, 1.5), 2) * UM,
        form=between(rng, 0.1, 1.0) * UM,
        bow=(float(rng.uniform(0.0, 6.3)), float(rng.uniform(0.0, 6.3))),
        level=between(rng, 4e-6, 4e-5),
        zero=between(rng, 1.5, 12.0) * UM,
        slide=between(rng, 0.02, 0.2) * MM,
        dust=between(rng, 1.0, 12.0),
        grain=between(rng, 0.4, 3.0) * UM,
        step=float(rng.choice([0.01, 0.02])) * MM,
    )
