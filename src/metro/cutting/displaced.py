"""A tool that is displaced from its path, and was when the teeth before cut: where its teeth are in the work.

The chip that an earlier pass leaves gains q(θ) − q(θ − pitch) towards the tooth, q the displacement over a
revolution of a steady cut; and the tool is nearer to a raw edge of the work that begins or ends the arc, or
farther. With equal teeth q repeats with every tooth: then only the raw edge shows the displacement, and that
a tip which moves sweeps another path than one that does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.cutting.arcs import TURN
from metro.cutting.chip import Cut
from metro.cutting.corners import RawEdges, raw_edges, shifted
from metro.cutting.cutter import Cutter, pitches
from metro.cutting.edges import Pieces, edges, pieces
from metro.cutting.force import placed
from metro.cutting.passes import ALIKE, COSINE, MOVED_X, MOVED_Y, SINE, Passes, passes
from metro.units import Array, ComplexArray

QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])  # turn, counter-clockwise


@dataclass(frozen=True, eq=False)
class Displaced:
    """A tool at n even angles, rad, and the passes before it while nothing is displaced.

    ``delay`` (orders, passes, N): factor from the spectrum of the displacement, as far as it goes, to that of
    what it was when the earlier passes were made. ``turn`` (2, 2, passes, N): by what it had turned since;
    None on a straight path: not at all.
    """

    cutter: Cutter
    cut: Cut
    angle: Array
    before: Passes
    delay: ComplexArray
    turn: Array | None

    def pieces(self, bent: Array, swept: bool = False) -> tuple[Pieces, RawEdges]:
        """Cut the edges of a tool displaced by ``bent`` into engaged pieces.

        Parameters
        ----------
        bent : (n, 2) m, feed frame. swept : whether the path that the tip sweeps counts, on true paths.

        Returns
        -------
        pieces
        raw edges : as they are with the tool displaced.
        """
        before = self._passes(bent, swept)
        along = edges(self.cutter, self.cut, self.angle, step=TURN / len(bent))
        arc, radius = self.cut.engagement, self.cutter.radius
        if swept:
            raw = raw_edges(arc, radius, self.before.scale.true_path, bent[:, 1])
        else:
            raw = shifted(raw_edges(arc, radius, False), radius, bent[:, 1])
        return pieces(before, raw, along), raw

    def _passes(self, bent: Array, swept: bool) -> Passes:
        order = np.arange(len(self.delay))[:, None, None]
        spectrum = np.fft.rfft(bent, axis=0)[: len(order)].T
        earlier = self.delay * spectrum[:, :, None, None]
        if self.turn is not None:
            earlier = np.einsum("abmj,bomj->aomj", self.turn, earlier)
        nearer = bent.T[:, None, :, None] - _waves(earlier, len(bent))
        rows = np.empty((*nearer.shape[2:], nearer.shape[1], self.before.rows.shape[3]))
        rows[:] = self.before.rows
        rows[..., [SINE, COSINE]] += nearer.transpose(2, 3, 1, 0)
        if swept:
            moved = _waves(1j * order * earlier, len(bent))
            rows[..., [MOVED_X, MOVED_Y]] = moved.transpose(2, 3, 1, 0)
        return self.before._replace(rows=rows)


def displaced(
    cutter: Cutter, cut: Cut, compliance: Array, count: int, true_path: bool, *, orders: int | None = None
) -> Displaced:
    """Return a tool on springs of a ``compliance`` (2, 2), m/N in the feed frame, at ``count`` even angles.

    On a curve the feed has turned since an earlier pass: a tooth met the same ray that much longer ago, and
    the force has turned with the feed while the springs have not, so that the displacement was C R C⁻¹ q.

    Parameters
    ----------
    orders : of the displacement, from 0 on, that there are. None: as many as the angles can show.
    """
    angle = TURN * np.arange(count) / count
    cutter = placed(cutter, cut, true_path)
    uneven = bool(np.ptp(cutter.pitch(1)) > ALIKE)  # then earlier teeth than the last one matter, too
    before = passes(cutter, cut, true_path, angle, every=uneven)
    pitch = pitches(cutter.tooth_angles, before.rows.shape[2])
    turned = (cut.curvature if true_path else 0.0) * before.scale.feed * pitch
    order = np.arange(orders or count // 2 + 1)[:, None, None]
    delay = np.exp(-1j * order * (pitch + turned))
    if not turned.any():
        return Displaced(cutter, cut, angle, before, delay, None)
    quarter = compliance @ QUARTER @ np.linalg.inv(compliance)
    turn = np.multiply.outer(np.eye(2), np.ones_like(pitch)) - np.multiply.outer(quarter, turned)
    return Displaced(cutter, cut, angle, before, delay, turn)


def _waves(spectrum: ComplexArray, count: int) -> Array:
    """Waves (2, passes, count, N) of spectra (2, orders, passes, N)."""
    return np.asarray(np.fft.irfft(spectrum, count, axis=1).swapaxes(1, 2))
