"""Drives that droop under a sudden load and come back by their integral action."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import UM, Array
from virtual_cell.world.draws import either_sign
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence

_STEPS = 1500  # along a pass


@dataclass(frozen=True)
class Servo:
    """Position loops seen at the tip: what changes in the force moves it, and is taken back.

    Attributes
    ----------
    give : (3,) m/N, droop along z under sudden forces along work x, y, z. time : s, in which the integral
        action takes back all but 1/e.
    """

    give: tuple[float, float, float]
    time: float

    def droop(self, run: FaceRun) -> tuple[Array, Array]:
        """Return places of the axis along a pass and the height of the tip there, both (n,), m."""
        from scipy.signal import lfilter

        s = np.linspace(-run.passes.lead, run.passes.length + run.passes.lead, _STEPS)
        push = run.force(s) @ np.array(self.give)
        step = float(s[1] - s[0]) / run.passes.speed
        kept = np.exp(-step / self.time)
        jumps = np.diff(push, prepend=push[0])
        return s, np.asarray(lfilter([np.sqrt(kept)], [1.0, -kept], jumps))

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return the droop, the same in all passes of a face."""
        del rng
        s, z = self.droop(run)

        def drooping(cutting: Cutting) -> Array:
            return np.asarray(np.interp(cutting.s, s, z))

        return Influence(height=drooping)


def drawn(rng: np.random.Generator, usual: Array) -> Servo:
    """Draw drives that droop by 0.2–1.5 µm under the ``usual`` force (3,), N, for 0.05–0.5 s."""
    return _towards(rng, usual, either_sign(rng) * drawn_size(rng, 0.2, 1.5) * UM, drawn_size(rng, 0.05, 0.5))


def _towards(rng: np.random.Generator, usual: Array, droop: float, time: float) -> Servo:
    """Draw give mostly along z, with some of the other axes."""
    row = np.array([0.0, 0.0, 1.0]) + rng.normal(0.0, 0.1, 3)
    give = row * (droop / float(row @ usual))
    return Servo((float(give[0]), float(give[1]), float(give[2])), time)


def decaying(
    rng: np.random.Generator, amplitude: float, length: float, runs: list[FaceRun]
) -> tuple[Servo, float]:
    """Return drives whose droop is ``amplitude`` exp(−s/``length``), m, in least squares, and its error.

    The amplitude is the mean over the faces; the error is what they differ by and what is no exponential,
    relative to it.
    """
    usual = np.mean([run.force(np.array([0.5 * run.passes.length]))[0] for run in runs], axis=0)
    unit = _towards(rng, usual, amplitude, length / runs[0].passes.speed)
    fits = [_fitted(unit, run, length) for run in runs]
    sizes = np.array([size for size, _ in fits])
    factor = amplitude / float(sizes.mean())
    x, y, z = (float(part * factor) for part in unit.give)
    misfit = float(np.mean([rest for _, rest in fits]))
    return replace(unit, give=(x, y, z)), float(np.hypot(sizes.std() / abs(sizes.mean()), misfit))


def _fitted(servo: Servo, run: FaceRun, length: float) -> tuple[float, float]:
    """Amplitude of the exponential behind the edge, and the rest over it."""
    s, z = servo.droop(run)
    inside = (s >= 0.0) & (s <= run.passes.length - 2.0 * run.passes.radius)
    shape = np.exp(-s[inside] / length)
    size = float(shape @ z[inside] / (shape @ shape))
    rest = z[inside] - size * shape
    return size, float(np.sqrt(rest @ rest / (size**2 * (shape @ shape))))
