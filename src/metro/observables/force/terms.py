"""Terms: what a force model may have beside its parts, each a quantity that a few functions change.

A term changes the force before the sensor reads it, or the reading. Effects of a user's own are made of
these (docs/discovery.md); ``metro propose`` searches them. Each changes nothing where its size is zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from metro.cutting.arc_force import arc_force
from metro.cutting.force import COEFFICIENTS
from metro.observables.force.shapes import Shape, product
from metro.observables.problem import Block
from metro.signals.orders import order_matrix
from metro.units import Array, ComplexArray

DEPTH_STEP = 0.02  # relative change of the depth by which the force's derivative is taken
ALONG: Mapping[str, tuple[tuple[int, float], ...]] = {  # multiples of the immersion angle, and their weights
    "constant": ((0, 1.0),),
    "cosine": ((1, 1.0),),
    "ends": ((0, 0.5), (2, 0.5)),
}
SAMPLES = 4  # of a waveform for each of its highest order, where the reading is bent


class Term:
    """A term that changes nothing; others override what they change. ``model`` is the force model."""

    def force(self, force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
        """Return the force (feeds, blocks or 1, orders, 3, p) with the term, feed frame, per coefficient."""
        del model, setting
        return force

    def gain(self, model: Any, setting: Any, orders: int) -> ComplexArray | None:
        """Return the factor (orders, 3) of the reading at the orders 0…, work frame; None: one."""
        del model, setting, orders
        return None

    def push(self, model: Any, block: Block) -> Array | float:
        """Return what is added to the reading, (n,) N."""
        del model, block
        return 0.0

    def bend(self, read: Array, block: Block) -> tuple[Array, Array] | None:
        """Return what is added to readings (k, blocks, 3, angles), and its slope; None: nothing."""
        del read, block
        return None


def _places(columns: tuple[str, ...]) -> list[int]:
    return [COEFFICIENTS.index(name) for name in columns]


@dataclass(frozen=True)
class Factor(Term):
    """Coefficients have the factor 1 + size × g₁ × g₂; with ``power`` exp(size × g₁ × g₂).

    With a logarithm, ``power`` is the power law (x/x₀)^size.
    """

    columns: tuple[str, ...]
    shapes: tuple[Shape, ...]
    size: float
    power: bool = False

    def force(self, force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
        """Multiply the columns of the coefficients."""
        change = self.size * product(self.shapes, model, setting)
        factor = np.exp(change) if self.power else 1.0 + change
        columns = np.ones((len(factor), force.shape[-1]))
        columns[:, _places(self.columns)] = factor[:, None]
        return np.asarray(force * columns[:, None, None, :])


@dataclass(frozen=True)
class Depth(Term):
    """The tool cuts deeper than stated by size × g₁ × g₂ (m); a hole has no depth of its own."""

    shapes: tuple[Shape, ...]
    size: float

    def force(self, force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
        """Add the derivative of the force by the depth times the change."""
        if setting.helix is not None:
            return force
        deeper = self.size * product(self.shapes, model, setting)
        step = DEPTH_STEP * setting.cut.axial_depth
        depths = (setting.cut.axial_depth + step, setting.cut.axial_depth - step)
        more, less = (model.of_cut(setting, replace(setting.cut, axial_depth=depth)) for depth in depths)
        return _with(force, deeper, (more - less) / (2.0 * step))


@dataclass(frozen=True)
class Layer(Term):
    """The shear force has the factor 1 + size in a layer ``thick`` m, at ``top`` or at the tip."""

    thick: float
    size: float
    top: bool = True

    def force(self, force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
        """Add the shear force of the heights that are in the layer."""
        if setting.helix is not None:
            return force
        depth = setting.cut.axial_depth
        height = min(max(depth - self.thick, 0.0) if self.top else self.thick, depth)
        below = model.of_cut(setting, replace(setting.cut, axial_depth=height)) if height > 0.0 else 0.0
        layer = np.asarray(model.of_cut(setting, setting.cut) - below if self.top else below)
        return _with(force, np.array([self.size]), layer * np.repeat([1.0, 0.0], 3))


@dataclass(frozen=True)
class Tooth(Term):
    """Coefficients of one ``tooth`` have the factor 1 + size × g; the teeth are no longer alike."""

    tooth: int
    columns: tuple[str, ...]
    shapes: tuple[Shape, ...]
    size: float

    def force(self, force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
        """Add the force of one tooth, whose chip is as thick as that of the others."""
        if setting.helix is not None:
            return force
        alone = replace(model.cutter, tooth_angles=(model.cutter.tooth_angles[self.tooth],), reach=())
        alone = replace(alone, runout_radius=0.0)
        kept = np.zeros(6)
        kept[_places(self.columns)] = 1.0
        own = model.of_cut(setting, setting.cut, alone) * kept
        return _with(force, self.size * product(self.shapes, model, setting), own)


@dataclass(frozen=True)
class AlongArc(Term):
    """Each tooth has a force K_tc × feed × g(φ) of its own, ``tangential`` and ``radial``; φ: immersion.

    ``form`` of g: constant 1, cosine cos φ, ends cos²φ. The force is in proportion to the feed like the shear
    force, and does not vanish with the chip where a tooth enters and leaves.
    """

    form: Literal["constant", "cosine", "ends"]
    tangential: float
    radial: float

    def force(self, force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
        """Add it to the column of K_tc."""
        waves = [
            weight * arc_force(model.cutter, setting.cut, multiple, setting.highest)
            for multiple, weight in ALONG[self.form]
        ]
        feed = setting.cut.feed_per_tooth * setting.feed_ratio
        changed = force.astype(complex)
        along = np.sum(waves, axis=0) @ np.array([self.tangential, self.radial])
        changed[..., COEFFICIENTS.index("ktc")] += feed * along
        return changed


@dataclass(frozen=True)
class Wave(Term):
    """The shear force has the factor 1 + cosine × cos kα + sine × sin kα; α is the angle of tooth 0."""

    order: int
    cosine: float
    sine: float

    def force(self, force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
        """Multiply waveforms, in orders: each order is moved up and down by k."""
        del model, setting
        k, half = self.order, 0.5 * (self.cosine - 1j * self.sine)
        shear = _two_sided(force[..., :3])
        moved = half * np.roll(shear, k, axis=2) + half.conjugate() * np.roll(shear, -k, axis=2)
        changed = force.astype(complex)
        changed[..., :3] += _one_sided(moved)
        return changed


def _two_sided(amplitudes: ComplexArray) -> ComplexArray:
    """Fourier coefficients (…, −H…H padded, 3, p) of waves whose orders 0…H are given; orders on axis 2."""
    high = amplitudes.shape[2] - 1
    up = amplitudes[:, :, 1:] / math.sqrt(2.0)
    zero = amplitudes[:, :, :1].real.astype(complex)
    padding = np.zeros((*up.shape[:2], high, *up.shape[3:]), complex)
    return np.concatenate([padding, up[:, :, ::-1].conj(), zero, up, padding], axis=2)


def _one_sided(coefficients: ComplexArray) -> ComplexArray:
    """Return the inverse of :func:`_two_sided`."""
    high = (coefficients.shape[2] - 1) // 4
    middle = 2 * high
    up = coefficients[:, :, middle + 1 : middle + high + 1] * math.sqrt(2.0)
    return np.concatenate([coefficients[:, :, middle : middle + 1].real.astype(complex), up], axis=2)


@dataclass(frozen=True)
class Push(Term):
    """A force of its own along work ``axis`` x, y or z: size × g₁ × g₂ (N), whatever is cut."""

    axis: str
    shapes: tuple[Shape, ...]
    size: float

    def push(self, model: Any, block: Block) -> Array | float:
        """Return it in the means of the time blocks."""
        change = self.size * product(self.shapes, model, block.setting)
        middles = len(block.setting.recording.middles)
        by_block = np.broadcast_to(change, (middles,))
        along = block.zeros[:, "xyz".index(self.axis)]
        return np.asarray(np.repeat(by_block, len(along) // middles) * along)


@dataclass(frozen=True)
class Bend(Term):
    """Beyond ``preload`` (N) of one ``sign``, the reading of an ``axis`` has the factor 1 − share."""

    axis: str
    sign: float
    preload: float
    share: float

    def bend(self, read: Array, block: Block) -> tuple[Array, Array] | None:
        """Return the change of the waveform, and its slope."""
        if block.setting.helix is not None:
            return None
        change, slope = np.zeros_like(read), np.zeros_like(read)
        at = "xyz".index(self.axis)
        beyond = self.sign * read[..., at, :] - self.preload
        change[..., at, :] = -self.sign * self.share * np.maximum(beyond, 0.0)
        slope[..., at, :] = -self.share * (beyond > 0.0)
        return change, slope


@dataclass(frozen=True)
class Lag(Term):
    """The reading of ``axes`` lags by ``time`` (s): a low pass of first order, or second (``damping``)."""

    axes: str
    time: float
    damping: float = 0.0

    def gain(self, model: Any, setting: Any, orders: int) -> ComplexArray | None:
        """Return the response at the orders of the spindle: the frame of a hole turns slowly against it."""
        del model
        beat = 2j * math.pi * setting.recording.speed * self.time * np.arange(orders)
        second = self.damping > 0.0
        response = 1.0 / (1.0 + (2.0 * self.damping * beat + beat**2 if second else beat))
        result = np.ones((orders, 3), complex)
        for axis in self.axes:
            result[:, "xyz".index(axis)] = response
        return result


def _with(force: ComplexArray, size: Array, basis: ComplexArray) -> ComplexArray:
    """Add a force (orders, 3, 6), times a size of each time block, to the columns of six coefficients."""
    more = np.zeros((len(size), *force.shape[2:]), complex)
    more[..., :6] = size[:, None, None, None] * basis
    return np.asarray(force + more)


def acted(terms: tuple[Term, ...], force: ComplexArray, model: Any, setting: Any) -> ComplexArray:
    """Return the force (feeds, orders, 3, p) with all terms, for each time block: (feeds, blocks, …)."""
    changed = force[:, None]
    for term in terms:
        changed = term.force(changed, model, setting)
    return changed


def seen(terms: tuple[Term, ...], response: ComplexArray, model: Any, setting: Any) -> ComplexArray:
    """Return a sensor's response (blocks, orders, 3, 3) with those of all terms."""
    for term in terms:
        gain = term.gain(model, setting, response.shape[1])
        response = response if gain is None else response * gain[:, :, None]
    return response


def pushed(terms: tuple[Term, ...], model: Any, block: Block) -> Array | float:
    """Return what all terms add to the reading of a block, (n,) N."""
    return sum((term.push(model, block) for term in terms), 0.0)


def bent(terms: tuple[Term, ...], readings: Array, block: Block) -> tuple[Array, Array] | None:
    """Return what terms add to readings (k, n) that depends on these, and its slope (k, samples); or None."""
    if not any(isinstance(term, Bend) for term in terms):
        return None
    matrix, back = _waveforms(block.setting.highest)
    shape = (len(readings), block.repeats, 3, -1)
    waves = readings.reshape(shape) @ matrix.T
    total, slope = np.zeros_like(waves), np.zeros_like(waves)
    for term in terms:
        found = term.bend(waves, block)
        if found:
            total, slope = total + found[0], slope + found[1]
    return (total @ back.T).reshape(len(readings), -1), slope


def bent_columns(slope: Array, columns: Array, block: Block) -> Array:
    """Return what a slope (blocks, 3, angles) of the reading adds to the columns (n, p) of a design."""
    matrix, back = _waveforms(block.setting.highest)
    waves = columns.T.reshape(columns.shape[1], block.repeats, 3, -1) @ matrix.T
    return np.asarray((waves * slope) @ back.T).reshape(columns.shape[1], -1).T


@lru_cache
def _waveforms(highest: int) -> tuple[Array, Array]:
    """Return the maps from order coefficients to samples of the waveform, and back."""
    count = SAMPLES * highest
    matrix = order_matrix(2.0 * math.pi * np.arange(count) / count, highest)
    return matrix, matrix.T / count
