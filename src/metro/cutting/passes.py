"""The chip that each earlier pass leaves to a tooth, as a function of the immersion at one angle of the tool.

Along a helical edge the immersion determines the height, κz = θ + α_j − φ, κ the lag per depth; so at one
angle θ of the tool the deviation of a tooth from the radius, a sinusoid of κz, is one of the immersion, and
the chip that pass m = 1…N leaves to a tooth is A sin φ + B cos φ on circular paths.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from metro.cutting.chip import Cut, curve_excess, feed_per_radian, path_excess
from metro.cutting.cutter import Cutter
from metro.units import Array

ALIKE = 1e-12
Index = tuple[npt.NDArray[np.intp] | slice | None, ...]


@dataclass(frozen=True)
class Passes:
    """Earlier passes, one an element of arrays of one shape: from :func:`passes` (passes, angles, teeth).

    Attributes
    ----------
    feed : m/rad. radius : m. true_path : whether the paths are trochoids, else circles.
    pitch : angle from the tooth to the one that made the pass, rad.
    sine, cosine : A and B of the chip, m.
    off_sine, off_cosine : the same of the deviation from the radius of the tooth that made the pass, m.
    """

    feed: float
    radius: float
    true_path: bool
    pitch: Array
    sine: Array
    cosine: Array
    off_sine: Array
    off_cosine: Array

    def __getitem__(self, index: Index) -> Passes:
        """Return the passes at an index of the arrays."""
        return self._each(lambda part: part[index])

    def before(self, angle: npt.NDArray[np.intp], tooth: npt.NDArray[np.intp]) -> Passes:
        """Return the passes (passes, n) before teeth (n,) at angles (n,); equal ones are stored once."""
        count, angles, teeth = self.sine.shape
        place = (angle % angles) * teeth + tooth % teeth
        return self._each(lambda part: part.reshape(count, -1).take(place, axis=1))

    def _each(self, select: Callable[[Array], Array]) -> Passes:
        parts = (self.pitch, self.sine, self.cosine, self.off_sine, self.off_cosine)
        return Passes(self.feed, self.radius, self.true_path, *map(select, parts))

    def chip(self, sine: Array, cosine: Array) -> Array:
        """Chip that each pass leaves at an immersion given by its sine and cosine, m."""
        thickness = self.sine * sine + self.cosine * cosine
        if self.true_path:
            radius = self.off_sine * sine + self.off_cosine * cosine + self.radius
            thickness += path_excess(self.feed, self.pitch, radius, sine, cosine)
        return np.asarray(thickness)

    def slope(self, sine: Array, cosine: Array) -> Array:
        """Change of the chip with the immersion, m/rad; on true paths to second order of feed/radius."""
        slope = self.sine * cosine - self.cosine * sine
        if self.true_path:
            turned = (self.pitch * sine + cosine) * cosine - sine**2
            slope -= (self.feed**2 / self.radius) * self.pitch * turned
        return np.asarray(slope)


def passes(cutter: Cutter, cut: Cut, true_path: bool, angle: Array, *, every: bool = False) -> Passes:
    """Return the passes before each tooth at angles (n,) of tooth 0's tip, rad.

    (N or 1, n or 1, N or 1): without deviations of the radius the angles are alike, and the last pass counts
    alone unless the path is curved, or ``every`` one is wanted; where pitch and deviations are equal as
    well, the teeth are alike.
    """
    deviation = _deviation(cutter, cut)
    off = deviation.any()
    curvature = cut.curvature if true_path else 0.0
    steps = range(1, cutter.teeth + 1 if off or curvature or every else 2)
    pitch = np.stack([cutter.pitch(m) for m in steps])
    # Where tooth j has immersion φ, tooth j+m deviates by the real part of earlier × exp i(θ − φ).
    here = np.exp(1j * np.asarray(cutter.tooth_angles))
    earlier = here * np.stack([np.roll(deviation, -m) for m in steps])
    apart = max(np.ptp(pitch, axis=1).max(), np.abs(earlier.T - earlier[:, 0]).max() / cutter.radius)
    if apart < ALIKE:
        pitch, earlier = pitch[:, :1], earlier[:, :1]
    turned = np.exp(1j * (angle if off else np.zeros(1)))[:, None] * earlier[:, None, :]
    change = turned[-1] - turned  # the last pass is the tooth's own
    feed, pitch = feed_per_radian(cutter, cut), np.broadcast_to(pitch[:, None, :], turned.shape)
    sine, cosine, off_sine, off_cosine = (
        np.ascontiguousarray(part) for part in (change.imag, change.real, turned.imag, turned.real)
    )
    sine, cosine = sine + feed * pitch, cosine + curve_excess(curvature, feed * pitch)
    return Passes(feed, cutter.radius, true_path, pitch, sine, cosine, off_sine, off_cosine)


def _deviation(cutter: Cutter, cut: Cut) -> npt.NDArray[np.complex128]:
    """Complex amplitude (N,) m of the deviation of each tooth from the radius: the real part of it × exp iκz.

    How far a tooth reaches is the same at all heights: it is taken as such a wave with its crest at half the
    depth, too little by 1 − cos(κ × depth / 2) at both ends.
    """
    even = replace(cutter, reach=(), helix=cutter.helix or 0.25 * math.pi)  # no helix: all is at height 0
    start, quarter = even.radius_deviation(np.array([0.0, 0.5 * math.pi / even.lag_per_depth])).T
    reach = np.array(cutter.reach or (0.0,)) * np.exp(-0.5j * cutter.lag_per_depth * cut.axial_depth)
    return np.asarray(start - 1j * quarter + reach)
