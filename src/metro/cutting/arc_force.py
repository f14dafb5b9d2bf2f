"""A force of each tooth that follows its immersion angle, not the chip: its orders."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.floor import floor_at, floor_of
from metro.cutting.force import Cut
from metro.units import Array, ComplexArray

NODES = 64  # of a Gauss rule over the arc, beside two for each order: the floor of a helix bends most


def arc_force(cutter: Cutter, cut: Cut, multiple: int, highest: int) -> ComplexArray:
    """Return the orders of a force cos(mφ) per unit of edge on every tooth in the cut, φ its immersion angle.

    A tooth ψ ahead of tooth 0 is at φ = α + ψ − κz at the height z, with α the angle of tooth 0. So each
    order is a sum over the teeth times an integral over the arc, of the integral over the height, which is
    known. All teeth go through the arc that is declared: runout does not change it.

    Parameters
    ----------
    multiple : m. highest : H.

    Returns
    -------
    (H+1, 3, 2) m: amplitudes (:func:`metro.signals.orders.amplitudes`) of the force on the tool in the feed
    frame, of a tangential and of a radial force of 1 N/m.
    """
    single = replace(cutter, tooth_angles=(0.0,), runout_radius=0.0, runout_angle=0.0, reach=())
    each = _arc_force(single, replace(cut, feed_per_tooth=0.0), multiple, highest)
    teeth = np.exp(1j * np.arange(highest + 1)[:, None] * np.array(cutter.tooth_angles)).sum(axis=1)
    return np.asarray(teeth[:, None, None] * each)


@lru_cache(maxsize=512)
def _arc_force(cutter: Cutter, cut: Cut, multiple: int, highest: int) -> ComplexArray:
    """Return :func:`arc_force` of a tool of one tooth, on which neither runout nor feed acts: read-only."""
    orders = np.arange(highest + 1)[:, None]
    entry, leave = cut.engagement.entry, cut.engagement.exit
    nodes, weights = _nodes(NODES + 2 * highest)
    phi, weights = entry + 0.5 * (leave - entry) * (1.0 + nodes), 0.5 * (leave - entry) * weights
    cosine, sine = np.cos(phi), np.sin(phi)
    floor, height = floor_of(cutter, cut), np.full(len(phi), cut.axial_depth)
    if floor.pitch:
        left = [floor_at(floor, s, c) for s, c in zip(sine, cosine, strict=True)]
        height = np.minimum(height, np.maximum(left, 0.0))
    lag = orders * cutter.lag_per_depth * height
    along = height * np.exp(-0.5j * lag) * np.sinc(0.5 * lag / math.pi)
    scale = np.where(orders > 0, math.sqrt(2.0), 1.0) / (2.0 * math.pi)
    wave = scale * along * np.exp(-1j * orders * phi) * (weights * np.cos(multiple * phi))
    axes = np.array([[-cosine, -sine], [sine, -cosine], [np.zeros_like(phi)] * 2])  # 3, 2, nodes
    result = np.einsum("hn,acn->hac", wave, axes)
    result.flags.writeable = False
    return np.asarray(result)


@lru_cache(maxsize=16)
def _nodes(count: int) -> tuple[Array, Array]:
    """Nodes and weights of a Gauss rule; finding them takes longer than all that is done with them."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return nodes, weights
