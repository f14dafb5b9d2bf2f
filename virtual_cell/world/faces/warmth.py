"""A spindle and its tool that get warm while they turn, and cold between the faces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import UM, Array
from virtual_cell.world.draws import uniform
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence, Span

MINUTE = 60.0


@dataclass(frozen=True)
class Warmth:
    """Two bodies, the nose and the housing, each with one time constant.

    Attributes
    ----------
    lengths : m, by which each is longer when it has been warm for ever. times : s, their time constants.
    """

    lengths: tuple[float, float]
    times: tuple[float, float]

    def longer(self, t: Array, spans: tuple[Span, ...]) -> Array:
        """Return the growth (n,), m, at times of the session, s, after turning in ``spans`` of it."""
        total = np.zeros(len(t))
        for length, constant in zip(self.lengths, self.times, strict=True):
            for start, stop in spans:
                warming = -np.expm1(-np.maximum(t - start, 0.0) / constant)
                cooling = -np.expm1(-np.maximum(t - stop, 0.0) / constant)
                total += length * (warming - cooling)
        return total

    def since(self, run: FaceRun, t: Array) -> Array:
        """Return the growth (n,), m, since the face began, where the tool's length was taken anew."""
        spans = (*run.earlier, (run.started, math.inf))
        now, then = self.longer(run.started + t, spans), self.longer(np.array([run.started]), spans)
        return np.asarray(now - then)

    def at_first(self, run: FaceRun) -> float:
        """Return the mean rate of growth over the first minute of a face, m/s."""
        return float(self.since(run, np.array([MINUTE]))[0]) / MINUTE

    def mean(self, runs: Sequence[FaceRun], t: Array) -> Array:
        """Return the growth (n,), m, since a face began, the mean over faces."""
        return np.asarray(np.mean([self.since(run, t) for run in runs], axis=0))

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return a face that gets lower while the tool grows."""
        del rng

        def lower(cutting: Cutting) -> Array:
            # The growth is smooth over a pass: a line between its ends and its middle holds it to 0.1 %.
            t = np.linspace(0.0, run.duration + 1.0, 200)
            return np.asarray(-np.interp(cutting.t, t, self.since(run, t)))

        return Influence(height=lower)


def drawn(rng: np.random.Generator) -> Warmth:
    """Draw a spindle that grows by 3–15 µm in all: what is left of it after compensation.

    Time constants of the nose 1–4 min and of the housing 8–40 min (ISO 230-3 tests of spindles).
    """
    grown, quick = drawn_size(rng, 3.0, 15.0) * UM, uniform(rng, 0.1, 0.4)
    times = drawn_size(rng, 1.0, 4.0) * MINUTE, drawn_size(rng, 8.0, 40.0) * MINUTE
    return Warmth((quick * grown, (1.0 - quick) * grown), times)


def at_rate(warmth: Warmth, rate: float, runs: list[FaceRun]) -> tuple[Warmth, float]:
    """Return a spindle that grows at a ``rate``, m/s, in the first minute of faces, and how far they differ.

    The rate is the mean over the faces; they differ by its standard deviation, relative.
    """
    slopes = np.array([warmth.at_first(run) for run in runs])
    factor = rate / float(slopes.mean())
    lengths = warmth.lengths[0] * factor, warmth.lengths[1] * factor
    return replace(warmth, lengths=lengths), float(slopes.std() / abs(slopes.mean()))
