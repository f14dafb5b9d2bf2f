"""A face at the points of its path: where the rim passes, under which force, and how places become bins."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from metro.observables.flatness.path import Pace, Passages
from metro.observables.flatness.ringing import Ringing
from metro.observables.flatness.setup import bow_shapes
from metro.units import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Places across and along the feed, in radii of a disc, whose mean equals that over the disc: exactly for a
# cubic, and to 0.2 % for a wave of three radii or more.
ACROSS, AHEAD = np.sqrt(0.5) * np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class FaceSetting:
    """A face at the points of its path, and beside it.

    Attributes
    ----------
    pose : of the arm. x, y : (4 n,) places of n points, m: four about each one, which represent its disc.
    disc : half axis of the discs along the passes, m.
    first : index of the first point of each bin that is compared.
    passages : of the rim over the points. pace : their times. size : of the work along x and y, m; NaN if it
        is not known.
    force : (3,) mean force on the tool in full engagement, N, work frame.
    loaded : (3 · terms,) coefficients of the compliance from the load tests alone.
    ringing : None if the mass of the arm is not known; the tip then follows the force statically.
    unplaced : (bins, 3) orthonormal heights of an offset and two tilts, which are left out of the measured
        and the predicted heights, because the scan's place does not determine them; None where it does.
    """

    pose: str
    x: Array
    y: Array
    disc: float
    first: np.ndarray
    passages: Passages
    pace: Pace
    size: tuple[float, float]
    force: Array
    loaded: Array
    ringing: Ringing | None
    unplaced: Array | None = None

    def shape(self, values: Array) -> Array:
        """Return heights of the bins, (n,) or (n, k), without what the scan's place leaves open."""
        return values if self.unplaced is None else values - self.unplaced @ (self.unplaced.T @ values)

    @cached_property
    def middle(self) -> Passages:
        """The passages, with the axis' position along the pass for the middle of each disc."""
        ahead = np.tile(self.disc * AHEAD, len(self.x) // len(AHEAD))
        return replace(self.passages, along=self.passages.along - ahead[:, None])

    def averaged(self, weights: csr_array, values: Array) -> Array:
        """Average values at passages, (4 n, k), by :meth:`weights_of`, over the bins."""
        return np.asarray(weights @ values.T.ravel())

    def weights_of(self, share: Array) -> csr_array:
        """Weight of each passage in each bin, (bins, k 4 n), by its ``share`` of a place: few have any.

        One passage of all places comes after the other, since this is how most arrays lie in memory.
        """
        from scipy.sparse import csr_array

        places, count = share.shape
        at = np.flatnonzero(share)
        place, passage = np.divmod(at, count)
        weights = self._weights
        begins = np.searchsorted(place, weights.indptr)
        data = share.ravel()[at] * weights.data[place]
        return csr_array((data, passage * places + place, begins), shape=(len(begins) - 1, share.size))

    def mean(self, values: Array) -> Array:
        """Average the values of places, (4 n,) or (4 n, p), over the discs, and these over the bins."""
        return np.asarray(self._weights @ values)

    def binned(self, values: Array) -> Array:
        """Average the values of points, (n,) or (n, p), over the bins."""
        return np.asarray((np.add.reduceat(values, self.first, axis=0).T / self._count).T)

    @cached_property
    def plane(self) -> Array:
        """Heights of an offset and two tilts, (bins, 3), each tilt ±1 at the edges of the work."""
        across = []
        for values, size in zip((self.x, self.y), self.size, strict=True):
            at = self.mean(values)
            low, high = (0.0, size) if math.isfinite(size) else (float(at.min()), float(at.max()))
            across.append((2.0 * at - low - high) / ((high - low) or 1.0))
        return np.column_stack([np.ones_like(across[0]), *across])

    @cached_property
    def form(self) -> Array:
        """Heights of three curvatures, (bins, 3), each 1 at the edges or corners of the work."""
        _, across, along = self.plane.T
        return np.column_stack([across**2, across * along, along**2])

    def bowed(self, coefficients: Array) -> Array:
        """Means over the bins of a form of the work, (bins,) m, by its :attr:`Setup.bowed`."""
        return self._bows @ coefficients if coefficients.any() else np.zeros(len(self.first))

    @cached_property
    def _bows(self) -> Array:
        """Means of :func:`bow_shapes` over the bins, (bins, 7)."""
        return self.mean(bow_shapes(self.x, self.y, self.size))

    @property
    def _count(self) -> np.ndarray:
        """Points in each bin."""
        return np.diff(np.append(self.first, len(self.x) // len(ACROSS)))

    @cached_property
    def _weights(self) -> csr_array:
        """Weight of each place in the mean of each bin; it is cached because a fit averages many times."""
        from scipy.sparse import csr_array

        weight = np.repeat(1.0 / self._count, self._count * len(ACROSS)) / len(ACROSS)
        begins = np.append(len(ACROSS) * self.first, len(weight))
        return csr_array((weight, np.arange(len(weight)), begins))
