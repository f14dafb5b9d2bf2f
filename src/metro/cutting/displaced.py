"""A tool that is displaced from its path, and was when the teeth before cut: where its teeth are in the work.

The chip that an earlier pass leaves gains q(θ) − q(θ − pitch) towards the tooth, q the displacement over a
revolution of a steady cut; and the tool is nearer to a raw edge of the work that begins or ends the arc, or
farther. With equal teeth q repeats with every tooth: then only the raw edge shows the displacement, and that
a tip which moves sweeps another path than one that does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from metro.cutting.arcs import arcs
from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter
from metro.cutting.edges import TURN, Pieces, pieces
from metro.cutting.engagement import Engagement
from metro.cutting.force import engaged, placed
from metro.cutting.nearby import edges
from metro.cutting.passes import ALIKE, Passes, passes
from metro.units import Array, ComplexArray

WHOLE = Engagement(0.0, math.pi)
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])  # turn, counter-clockwise


@dataclass(frozen=True, eq=False)
class Displaced:
    """A tool at n even angles, rad, and the passes before it while nothing is displaced.

    ``delay`` (2, 2, orders, passes, N): map from the spectrum of the displacement to that of what it was when
    the earlier passes were made.
    """

    cutter: Cutter
    cut: Cut
    angle: Array
    before: Passes
    delay: ComplexArray

    def pieces(self, bent: Array, swept: bool = False) -> tuple[Pieces, Array]:
        """Cut the edges of a tool displaced by ``bent`` into engaged pieces.

        Parameters
        ----------
        bent : (n, 2) m, feed frame. swept : whether the path that the tip sweeps counts, on true paths.

        Returns
        -------
        pieces
        raw edges : (2, n) immersion at which they begin and end the arc, rad; infinite where there is none.
        """
        before = self._passes(bent, swept)
        along = edges(self.cutter, self.cut, self.angle, step=TURN / len(bent))
        raw = np.full((2, len(bent)), math.inf)
        if swept:
            return engaged(before, self.cut.engagement, along, bent[:, 1:]), raw
        bounds = arcs(before, WHOLE, along)
        if self.cut.engagement.entry > 0.0:
            raw[0] = self._shifted(self.cut.engagement.entry, bent)
            bounds = np.maximum(bounds, raw[0, :, None])
        if self.cut.engagement.exit < math.pi:
            raw[1] = self._shifted(self.cut.engagement.exit, bent)
            bounds = np.minimum(bounds, raw[1, :, None])
        return pieces(before, bounds, along), raw

    def _shifted(self, immersion: float, bent: Array) -> Array:
        """Immersion (n,) of an edge along the feed, which stays where it is while the tool is displaced."""
        cosine = math.cos(immersion) - bent[:, 1] / self.cutter.radius
        return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def _passes(self, bent: Array, swept: bool) -> Passes:
        order = np.arange(self.delay.shape[2])[:, None, None]
        earlier = np.einsum("abomj,ob->aomj", self.delay, np.fft.rfft(bent, axis=0))
        nearer = bent.T[:, None, :, None] - _waves(earlier, len(bent))
        moved = _waves(1j * order * earlier, len(bent)) if swept else np.zeros_like(nearer)
        shape, before = nearer.shape[1:], self.before
        pitch, off_sine, off_cosine = (
            np.broadcast_to(part, shape) for part in (before.pitch, before.off_sine, before.off_cosine)
        )
        sine, cosine = before.sine + nearer[0], before.cosine + nearer[1]
        scale = (before.feed, before.radius, before.true_path)
        return _Swept(*scale, pitch, sine, cosine, off_sine, off_cosine, *moved)


def displaced(cutter: Cutter, cut: Cut, compliance: Array, count: int, true_path: bool) -> Displaced:
    """Return a tool on springs of a ``compliance`` (2, 2), m/N in the feed frame, at ``count`` even angles.

    On a curve the feed has turned since an earlier pass: a tooth met the same ray that much longer ago, and
    the force has turned with the feed while the springs have not, so that the displacement was C R C⁻¹ q.
    """
    angle = TURN * np.arange(count) / count
    cutter = placed(cutter, cut, true_path)
    uneven = bool(np.ptp(cutter.pitch(1)) > ALIKE)  # then earlier teeth than the last one matter, too
    before = passes(cutter, cut, true_path, angle, every=uneven)
    pitch = np.stack([cutter.pitch(m) for m in range(1, len(before.sine) + 1)])
    turned = (cut.curvature if true_path else 0.0) * before.feed * pitch
    delay = np.exp(-1j * np.arange(count // 2 + 1)[:, None, None] * (pitch + turned))
    quarter = compliance @ QUARTER @ np.linalg.inv(compliance)
    turn = np.multiply.outer(np.eye(2), np.ones_like(pitch)) - np.multiply.outer(quarter, turned)
    return Displaced(cutter, cut, angle, before, turn[:, :, None] * delay)


@dataclass(frozen=True)
class _Swept(Passes):
    """Passes of a tip that moved along x and y, m/rad, as it made them.

    The later tooth meets each where it was δ = feed × pitch cos φ / radius later than a pitch ago.
    """

    moved_x: Array
    moved_y: Array

    def _each(self, select: Callable[[Array], Array]) -> _Swept:
        return _Swept(
            **vars(super()._each(select)), moved_x=select(self.moved_x), moved_y=select(self.moved_y)
        )

    def chip(self, sine: Array, cosine: Array) -> Array:
        """Chip that each pass leaves at an immersion given by its sine and cosine, m."""
        later = (self.feed / self.radius) * self.pitch * cosine
        return super().chip(sine, cosine) - later * (self.moved_x * sine + self.moved_y * cosine)


def _waves(spectrum: ComplexArray, count: int) -> Array:
    """Waves (2, passes, count, N) of spectra (2, orders, passes, N)."""
    return np.asarray(np.fft.irfft(spectrum, count, axis=1).swapaxes(1, 2))
