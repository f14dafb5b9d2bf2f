"""How a face is finished: what causes do while it is cut, and the surface that the rim leaves.

A cause is asked once for each face what it does there. What it does is a height that depends on where and
when the rim cuts, a factor on the force, or an error of the scanner.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from virtual_cell.face import Passes
from virtual_cell.units import Array

Span = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Cutting:
    """The rim at some points, n of them, in one pass.

    Attributes
    ----------
    number : of the pass. s : (n,) place of the axis along the pass, m from the plate's edge.
    t : (n,) s since the first pass began. points : (n, 2) m, that are cut. offset : (n, 2) m, from the axis
        to them.
    """

    number: int
    s: Array
    t: Array
    points: Array
    offset: Array


@dataclass(frozen=True, eq=False)
class FaceRun:
    """A face that is to be cut: all that a cause may depend on.

    Attributes
    ----------
    order, count : place in the session, from 0, and number of its faces. started : s since the session began.
    whole : s, when its last face begins. earlier : spans (s) in which the faces before were cut.
    wrist, location : levels of the factors. passes : of the face.
    begun : (passes,) s, when each begins after the first.
    force : (n,) → (n, 3); mean force on the tool, N, work frame, at places of the axis along a pass, m.
    depth : axial, m. teeth : of the cutter. edge_share : of the axial force that no chip carries.
    """

    order: int
    count: int
    started: float
    whole: float
    earlier: tuple[Span, ...]
    wrist: str
    location: int
    passes: Passes
    begun: Array
    force: Callable[[Array], Array]
    depth: float
    teeth: int
    edge_share: float

    @property
    def share(self) -> float:
        """Share of the session that is over, 0 for the first face and 1 for the last."""
        return self.order / max(1, self.count - 1)

    @property
    def way(self) -> float:
        """Length of a pass with its leads, m."""
        return self.passes.length + 2.0 * self.passes.lead

    @property
    def duration(self) -> float:
        """Time from the first pass' begin to the last one's end, s."""
        return float(self.begun[-1]) + self.way / self.passes.speed

    def time(self, number: int, s: Array) -> Array:
        """Time (n,), s since the first pass began, at places of the axis along a pass, m."""
        return np.asarray(self.begun[number] + (s + self.passes.lead) / self.passes.speed)


@dataclass(frozen=True, eq=False)
class Influence:
    """What a cause does in one face; None: nothing of that kind.

    Attributes
    ----------
    height : how much higher the finished surface is where the rim cuts, m.
    gain : factor on the force, by number of the pass, place of the axis (m) and time (s).
    reading : how much too high the scanner reads at points (n, 2), m, of the plate.
    """

    height: Callable[[Cutting], Array] | None = None
    gain: Callable[[int, Array, Array], Array] | None = None
    reading: Callable[[Array], Array] | None = None


class Cause(Protocol):
    """Something that shapes faces, or what is read of them."""

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return what it does in a face; ``rng`` draws what differs from face to face."""
        ...


def finished(
    run: FaceRun,
    corner: float,
    heights: Sequence[tuple[Array, Array]],
    influences: Sequence[Influence],
    points: Array,
) -> Array:
    """Return the height (n,), m, of the face at ``points`` (n, 2), m: the lowest cut of all passes.

    Parameters
    ----------
    corner : radius of the teeth's corners, m: the flat rim is smaller than the cutter by it, and beyond the
        rim the cut rises along the corner.
    heights : of the tip, pass by pass: places of the axis along the pass and heights, m.
    """
    passes, lowest = run.passes, np.full(len(points), np.inf)
    rim = passes.radius - corner
    for number, (s, z) in enumerate(heights):
        across = points[:, 1 - passes.along] - passes.axes[number]
        under = np.abs(across) <= passes.radius * (1.0 + 1e-9)
        aside, cut_points = across[under], points[under]
        half = np.sqrt(np.maximum(rim**2 - aside**2, 0.0))
        beyond = np.clip(np.abs(aside) - rim, 0.0, corner)
        fillet = corner - np.sqrt(corner**2 - beyond**2)
        for side in (1.0, -1.0):  # in front of the axis, and behind it
            axis = cut_points[:, passes.along] - side * half
            offset = np.empty((len(axis), 2))
            offset[:, passes.along], offset[:, 1 - passes.along] = side * half, aside
            cutting = Cutting(number, axis, run.time(number, axis), cut_points, offset)
            cut = np.interp(axis, s, z) + fillet
            for influence in influences:
                if influence.height is not None:
                    cut = cut + influence.height(cutting)
            lowest[under] = np.minimum(lowest[under], cut)
    return lowest


def gain(influences: Sequence[Influence], number: int, s: Array, t: Array) -> Array:
    """Return the factor (n,) that all causes together put on the force of a pass."""
    factor = np.ones(len(s))
    for influence in influences:
        if influence.gain is not None:
            factor = factor * influence.gain(number, s, t)
    return factor


def over_plate(points: Array, size: tuple[float, float]) -> tuple[Array, Array]:
    """Return coordinates u, v (n,) of points (n, 2), m, from −1 to 1 over a plate."""
    u, v = (2.0 * points / np.array(size) - 1.0).T
    return u, v


def bump(distance: Array, radius: float) -> Array:
    """Return a smooth bump of height 1: 1 in its middle, 0 from ``radius`` on, by the distance from it, m."""
    away = np.clip(distance / radius, 0.0, 1.0)
    return np.asarray(0.5 + 0.5 * np.cos(math.pi * away))
