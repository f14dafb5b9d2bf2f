"""What the teeth add to the mean force: the tip's motion at their rhythm, as the rim leaves it in the face.

A tooth comes to a place on the rim always at the same turn of the spindle, so that the tip is there at
the same height each time: what is fast in time is fixed along the rim.
"""

from __future__ import annotations

import numpy as np

from metro.surface.tip_response import TipModes
from metro.units import Array

SLOW = 10.0  # times the highest mode of the tip, below which the teeth count


def tooth_heights(modes: TipModes, ratio: Array, force: Array, rate: float) -> Array:
    """Height of the tip about its mean over a revolution, (s, n) m.

    Parameters
    ----------
    ratio : damping ratio of each mode, (s, 3), or one that broadcasts to it.
    force : (n, 3) N on the tip, at even angles of the spindle. rate : of the spindle, rad/s.
    """
    spectrum = np.fft.rfft(force, axis=0)
    spectrum[0] = 0.0
    turn = (rate * np.arange(len(spectrum)))[:, None]
    modal = np.einsum("kj,sji->ski", spectrum, modes.shape)
    own = modes.frequency[:, None]
    moved = modal / (
        own**2 - turn**2 + 2j * np.broadcast_to(ratio, modes.frequency.shape)[:, None] * own * turn
    )
    height = np.einsum("ski,si->sk", moved, modes.shape[:, 2])
    return np.asarray(np.fft.irfft(height, n=len(force), axis=1))


def at_rim(heights: Array, segment: np.ndarray, rim: Array, teeth: Array) -> Array:
    """Height that the lowest tooth leaves at places on the rim, in the shape of ``rim``.

    Parameters
    ----------
    heights : (s, n) as of :func:`tooth_heights`, by the angle of tooth 0. segment : which of the s.
    rim : angle of the place, as angles of teeth are counted, rad.
    teeth : (N,) angle of each tooth clockwise from tooth 0, rad: how far back tooth 0 is when it comes there.
    """
    count = heights.shape[1]
    place = (rim[..., None] - teeth) / (2 * np.pi) * count
    before = np.floor(place).astype(np.intp)
    low, high = heights[segment[..., None], before % count], heights[segment[..., None], (before + 1) % count]
    return np.asarray((low + (place - before) * (high - low)).min(axis=-1))
