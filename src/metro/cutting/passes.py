"""The chip that each earlier pass leaves to a tooth, as a function of the immersion at one angle of the tool.

Along a helical edge the immersion determines the height, κz = θ + α_j − φ, κ the lag per depth; so at one
angle θ of the tool the deviation of a tooth from the radius, a sinusoid of κz, is one of the immersion, and
the chip that pass m = 1…N leaves to a tooth is A sin φ + B cos φ on circular paths.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from metro.compiled import compiled
from metro.cutting.chip import Cut, curve_excess, feed_per_radian, path_excess
from metro.cutting.cutter import Cutter, pitches
from metro.units import Array

ALIKE = 1e-12
_path_excess = compiled(path_excess)


class Scale(NamedTuple):
    """What all passes have in common: ``feed``, m/rad, ``radius``, m, and whether they are trochoids."""

    feed: float
    radius: float
    true_path: bool


class Row(NamedTuple):
    """A pass before a tooth at an angle of the tool.

    Attributes
    ----------
    pitch : angle from the tooth to the one that made the pass, rad.
    sine, cosine : A and B of the chip, m.
    off_sine, off_cosine : the same of the deviation from the radius of the tooth that made the pass, m.
    moved_x, moved_y : how the tip moved along x and y as it made the pass, m/rad.
    level, off_level : what chip and deviation have beside these waves, at any immersion alike, m.
    """

    pitch: float
    sine: float
    cosine: float
    off_sine: float
    off_cosine: float
    moved_x: float
    moved_y: float
    level: float
    off_level: float


PITCH, SINE, COSINE, OFF_SINE, OFF_COSINE, MOVED_X, MOVED_Y, LEVEL, OFF_LEVEL = range(len(Row._fields))


class Passes(NamedTuple):
    """Earlier passes before the teeth at angles of the tool.

    Attributes
    ----------
    scale : of all of them. rows : (angles, teeth, passes, 9) of each a ``Row``, the last pass of a turn last.
        Angles or teeth that are alike are stored once; heights in the place of angles
        (:func:`passes_at`).
    """

    scale: Scale
    rows: Array


@compiled
def row_of(rows: Array, at: int) -> Row:
    """Return ``rows[at]`` as numbers, which compiled functions hand on faster than arrays."""
    return Row(
        rows[at, PITCH],
        rows[at, SINE],
        rows[at, COSINE],
        rows[at, OFF_SINE],
        rows[at, OFF_COSINE],
        rows[at, MOVED_X],
        rows[at, MOVED_Y],
        rows[at, LEVEL],
        rows[at, OFF_LEVEL],
    )


@compiled
def chip_left(scale: Scale, row: Row, sine: float, cosine: float) -> float:
    """Chip that a pass leaves at an immersion given by its sine and cosine, m.

    A later tooth meets a tip that moved where that was δ = feed × pitch cos φ / radius later than a pitch
    ago.
    """
    chip = row.sine * sine + row.cosine * cosine + row.level
    if scale.true_path:
        reach = row.off_sine * sine + row.off_cosine * cosine + row.off_level + scale.radius
        later = (scale.feed / scale.radius) * row.pitch * cosine
        chip += _path_excess(scale.feed, row.pitch, reach, sine, cosine)
        chip -= later * (row.moved_x * sine + row.moved_y * cosine)
    return chip


@compiled
def chip_slope(scale: Scale, row: Row, sine: float, cosine: float) -> float:
    """Change of the chip with the immersion, m/rad; on true paths to second order of feed/radius."""
    slope = row.sine * cosine - row.cosine * sine
    if scale.true_path:
        turned = (row.pitch * sine + cosine) * cosine - sine * sine
        slope -= (scale.feed * scale.feed / scale.radius) * row.pitch * turned
    return slope


def passes(cutter: Cutter, cut: Cut, true_path: bool, angle: Array, *, every: bool = False) -> Passes:
    """Return the passes before each tooth at angles (n,) of tooth 0's tip, rad.

    Without deviations of the radius the angles are alike, and the last pass counts alone unless the path is
    curved, or ``every`` one is wanted; where pitch and deviations are equal as well, the teeth are alike.
    """
    deviation = _deviation(cutter, cut)
    off = deviation.any()
    curvature = cut.curvature if true_path else 0.0
    pitch = pitches(cutter.tooth_angles, cutter.teeth if off or curvature or every else 1)
    # Where tooth j has immersion φ, tooth j+m deviates by the real part of earlier × exp i(θ − φ).
    here = np.exp(1j * np.asarray(cutter.tooth_angles))
    steps = np.arange(1, len(pitch) + 1)[:, None]
    earlier = here * deviation[(np.arange(cutter.teeth) + steps) % cutter.teeth]
    apart = max(np.ptp(pitch, axis=1).max(), np.abs(earlier.T - earlier[:, 0]).max() / cutter.radius)
    if apart < ALIKE:
        pitch, earlier = pitch[:, :1], earlier[:, :1]
    turned = np.exp(1j * (angle if off else np.zeros(1)))[:, None, None] * earlier.T
    change = turned[..., -1:] - turned  # the last pass is the tooth's own
    feed, pitch = feed_per_radian(cutter, cut), pitch.T
    rows = np.zeros((*turned.shape, len(Row._fields)))
    rows[..., PITCH] = pitch
    rows[..., SINE], rows[..., COSINE] = change.imag, change.real
    rows[..., SINE] += feed * pitch
    rows[..., COSINE] += curve_excess(curvature, feed * pitch)
    rows[..., OFF_SINE], rows[..., OFF_COSINE] = turned.imag, turned.real
    return Passes(Scale(feed, cutter.radius, true_path), rows)


def passes_at(cutter: Cutter, cut: Cut, true_path: bool, height: Array) -> Passes:
    """Return the passes before each tooth at heights (n,) above the tip, m, whatever the angle of the tool.

    At one height a tooth's deviation is one number. Where nothing deviates, one height is returned for all.
    """
    deviation = cutter.radius_deviation(height)
    off = deviation.any()
    deviation = deviation if off else deviation[:, :1]
    curvature = cut.curvature if true_path else 0.0
    pitch = pitches(cutter.tooth_angles, cutter.teeth if off or curvature else 1)
    steps = np.arange(1, len(pitch) + 1)[:, None]
    earlier = deviation[(np.arange(cutter.teeth) + steps) % cutter.teeth]
    feed = feed_per_radian(cutter, cut)
    rows = np.zeros((deviation.shape[1], cutter.teeth, len(pitch), len(Row._fields)))
    rows[..., PITCH] = pitch.T
    rows[..., SINE] = feed * pitch.T
    rows[..., COSINE] = curve_excess(curvature, feed * pitch.T)
    rows[..., LEVEL] = (deviation - earlier).T
    rows[..., OFF_LEVEL] = earlier.T
    return Passes(Scale(feed, cutter.radius, true_path), rows)


def _deviation(cutter: Cutter, cut: Cut) -> npt.NDArray[np.complex128]:
    """Complex amplitude (N,) m of the deviation of each tooth from the radius: the real part of it × exp iκz.

    How far a tooth reaches is the same at all heights: it is taken as such a wave with its crest at half the
    depth, too little by 1 − cos(κ × depth / 2) at both ends.
    """
    even = replace(cutter, reach=(), helix=cutter.helix or 0.25 * math.pi)  # no helix: all is at height 0
    start, quarter = even.radius_deviation(np.array([0.0, 0.5 * math.pi / even.lag_per_depth])).T
    reach = np.array(cutter.reach or (0.0,)) * np.exp(-0.5j * cutter.lag_per_depth * cut.axial_depth)
    return np.asarray(start - 1j * quarter + reach)
