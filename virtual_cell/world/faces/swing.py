"""A tip that swings: a pump, a fan or a drive in its limit cycle, none of which turns perfectly evenly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import Array
from virtual_cell.world.draws import uniform
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence


@dataclass(frozen=True)
class Swing:
    """A vibration along z.

    Attributes
    ----------
    hz, amplitude : mean frequency and amplitude of the fundamental, m. wander : relative amplitude of the
        frequency's slow change. slow : s, its period. beating : relative amplitude of the slow change of the
        amplitude. second : amplitude of the second harmonic over that of the fundamental.
    """

    hz: float
    amplitude: float
    wander: float
    slow: float
    beating: float
    second: float

    @property
    def impurity(self) -> float:
        """What is no pure wave, relative to the fundamental."""
        return math.hypot(self.beating / math.sqrt(2.0), self.second)

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return the swing with a phase of its own: nothing ties it to the start of a face."""
        del run
        phase, first, then = rng.uniform(0.0, 2.0 * math.pi, 3).tolist()
        w, slow = 2.0 * math.pi * self.hz, 2.0 * math.pi / self.slow

        def swinging(cutting: Cutting) -> Array:
            t = cutting.t
            angle = w * t + w * self.wander / slow * np.sin(slow * t + first) + phase
            size = self.amplitude * (1.0 + self.beating * np.sin(0.7 * slow * t + then))
            return np.asarray(size * (np.sin(angle) + self.second * np.sin(2.0 * angle)))

        return Influence(height=swinging)


def drawn(rng: np.random.Generator, hz: float, amplitude: float) -> Swing:
    """Draw how impure a vibration of a frequency, Hz, and amplitude, m, is."""
    return Swing(
        hz,
        amplitude,
        drawn_size(rng, 2e-4, 4e-3),
        uniform(rng, 15.0, 60.0),
        uniform(rng, 0.03, 0.25),
        uniform(rng, 0.0, 0.15),
    )
