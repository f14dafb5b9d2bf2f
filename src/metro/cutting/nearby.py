"""Where the cutting edges are at each angle of the tool, and which immersions they reach."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter
from metro.units import Array

LARGEST_STEP = 0.3  # rad, from a bound to first order towards the true one


@dataclass(frozen=True, eq=False)
class Edges:
    """Where the edges are at angles of the tool: ``top`` and a ``span`` below it.

    Attributes
    ----------
    top : (angles, N) immersion of the leading end of each edge, rad. span : what an edge spans, > 0, rad.
    depth : what a radian of edge spans, m/rad.
    """

    top: Array
    span: float
    depth: float


def edges(cutter: Cutter, cut: Cut, angle: Array, *, step: float) -> Edges:
    """Return the edges at angles (n,) of tooth 0, a ``step`` apart, rad.

    One that lags by less than a step is spread over what it turns through in the step.
    """
    lag = cutter.lag_per_depth * cut.axial_depth
    span = max(abs(lag), step)
    top = angle[:, None] + np.asarray(cutter.tooth_angles) + 0.5 * (span - lag)
    return Edges(top, span, cut.axial_depth / span)


@dataclass(frozen=True, eq=False)
class Nearby:
    """Sine, cosine (angles, teeth) of each edge's middle, and cosine of how far from it bounds matter."""

    sine: Array
    cosine: Array
    least: float

    def covers(self, sine: Array, cosine: Array) -> npt.NDArray[np.bool_]:
        """Whether immersions (…, angles, teeth) given by their sine and cosine matter."""
        return np.asarray(self.sine * sine + self.cosine * cosine > self.least)


def nearby(edges: Edges | None, shape: tuple[int, ...]) -> Nearby:
    """Return what edges reach of bounds of a shape (angles, teeth).

    Bounds that are alike for several edges, or of edges that are not given, matter all around.
    """
    if edges is None or edges.top.shape != shape:
        return Nearby(np.zeros(1), np.zeros(1), -1.0)
    middle = edges.top - 0.5 * edges.span
    least = math.cos(min(0.5 * edges.span + LARGEST_STEP, math.pi)) - 1e-9
    return Nearby(np.sin(middle), np.cos(middle), least)
