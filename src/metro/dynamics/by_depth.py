"""Lobes of an end that is not flat, whose edge is inclined otherwise at each height.

The deeper a ball cuts the steeper is its edge in the mean, so that the radial coefficient depends on the
depth that is sought. The boundary is solved for the coefficients of several depths; that of the real edge is
where the depth for which it was solved and the depth that is found agree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics.band import depth_samples
from metro.dynamics.crossings import Candidates
from metro.dynamics.lobes import Boundary, stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.units import Array

# From a depth to the next, at most: the mean of sin κ over a shallow cut of a ball rises as the root of the
# depth, by a quarter here, and the depth is interpolated linearly between logarithms.
RATIO = 1.6
MOST = 12  # depths


@dataclass(frozen=True)
class OfEdge:
    """Boundary of a real edge at k speeds.

    Attributes
    ----------
    depth : (k,) m. chatter_hz : (k,) Hz. nearest : (k,) index of the solution whose depth is nearest.
    solved : boundaries for the coefficients of several depths. cuts : which these are.
    gain : (k,) by how much more the depth changes with a parameter than for constant coefficients.
    """

    depth: Array
    chatter_hz: Array
    nearest: np.ndarray
    solved: tuple[Boundary, ...]
    cuts: tuple[Cut, ...]
    gain: Array

    def boundary(self) -> Boundary:
        """Return it as a boundary, with all but its depths from the solutions that are nearest."""
        if len(self.solved) == 1:
            return self.solved[0]
        at = (self.nearest, np.arange(len(self.depth)))
        error, kind = (
            np.stack([getattr(one, name) for one in self.solved])[at] for name in ("error", "kind")
        )
        crossings = [
            one.crossings.take((self.nearest == i)[one.crossings.speed]) for i, one in enumerate(self.solved)
        ]
        joined = Candidates.join(crossings)
        return Boundary(self.solved[0].rpm, self.depth, self.chatter_hz, kind, error, joined)

    def samples(self, structure: Structure, deviations: Array) -> Array:
        """Lowest depths (s, k), m, under ``deviations`` as of :func:`metro.dynamics.band.depth_samples`."""
        if len(self.solved) == 1:
            return depth_samples(structure, self.cuts[0], self.solved[0], deviations)
        depths = np.full((len(deviations), len(self.depth)), np.inf)
        for i, (cut, one) in enumerate(zip(self.cuts, self.solved, strict=True)):
            here = (self.nearest == i) & np.isfinite(self.depth) & np.isfinite(one.depth)
            if here.any():
                sampled = depth_samples(structure, cut, one, deviations)[:, here]
                depths[:, here] = self.depth[here] * (sampled / one.depth[here]) ** self.gain[here]
        return depths


def boundary_of_edge(structure: Structure, cut: Cut, rpm: Array, factor: Array | float = 1.0) -> OfEdge:
    """Find the lowest depths at which a cut is unstable; ``factor`` (k,): of the depths, as the stiffness.

    Of a flat end, and of a straight flank without a corner, the coefficients are the same at all depths, and
    one solution is all there is.
    """
    rpm = np.asarray(rpm, dtype=float)
    tried = _depths(structure, cut, rpm, factor)
    cuts = tuple(cut.at_depth(depth) for depth in tried)
    solved = tuple(stability_boundary(structure, one, rpm) for one in cuts)
    found = np.stack([factor * one.depth for one in solved])
    lowest, gain = (found[0], np.ones(len(rpm))) if len(tried) == 1 else _agreed(np.array(tried), found)
    near = np.abs(np.log(np.array(tried))[:, None] - np.log(np.where(np.isfinite(lowest), lowest, tried[-1])))
    nearest = near.argmin(axis=0)
    hz = np.stack([one.chatter_hz for one in solved])[nearest, np.arange(len(rpm))]
    return OfEdge(lowest, hz, nearest, solved, cuts, gain)


def _depths(structure: Structure, cut: Cut, rpm: Array, factor: Array | float) -> list[float]:
    """Depths for whose coefficients the boundary is solved, m: about those that a first solution finds."""
    if cut.edge is None or cut.edge.tool.corner == 0.0:
        return [1.0]
    deepest = cut.edge.tool.radius
    first = factor * stability_boundary(structure, cut.at_depth(deepest), rpm).depth
    known = first[np.isfinite(first)]
    low, high = (known.min(), known.max()) if len(known) else (deepest, deepest)
    low, high = low / RATIO, high * RATIO
    count = min(MOST, max(2, 1 + int(np.ceil(np.log(high / low) / np.log(RATIO)))))
    return [float(depth) for depth in np.geomspace(low, high, count)]


def _agreed(tried: Array, found: Array) -> tuple[Array, Array]:
    """Depths (k,) that are found where they were tried (d,), of those ``found`` (d, k), and the gains.

    The least counts: the first tried depth that is unstable. Where all are on one side, the outermost.
    """
    log_tried = np.log(tried)[:, None]
    bounded = np.log(np.where(np.isfinite(found), found, 1e3 * tried[-1]))
    beyond = log_tried - bounded  # above zero where the depth is unstable
    first = np.clip(np.argmax(beyond >= 0.0, axis=0), 1, len(tried) - 1)
    first = np.where((beyond >= 0.0).any(axis=0), first, len(tried) - 1)
    at = np.arange(found.shape[1])
    step = log_tried[first, 0] - log_tried[first - 1, 0]
    slope = (bounded[first, at] - bounded[first - 1, at]) / step  # of the found depth, in logarithms
    gain = 1.0 / np.maximum(1.0 - slope, 0.1)
    depth = np.exp(log_tried[first, 0] - beyond[first, at] * gain)
    return np.where(np.isfinite(found[first, at]), depth, np.inf), gain


def depths_anew(structure: Structure, cut: Cut, rpm: Array, deviations: Array) -> Array:
    """Depths (s, k) of the same samples solved from scratch, to see what first order is worth."""
    m = len(structure.omega)
    depths = []
    for factor in np.exp(deviations):
        changed = replace(
            structure,
            omega=structure.omega * factor[:m],
            zeta=structure.zeta * factor[m : 2 * m],
            stiffness=structure.stiffness * factor[2 * m : 3 * m],
        )
        harder = cut.harder(float(factor[3 * m]), float(factor[3 * m + 1]))
        depths.append(boundary_of_edge(changed, harder, rpm).depth)
    return np.stack(depths)
