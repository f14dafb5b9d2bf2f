"""Chatter tests by brute force: modes of the tip marched through a slot, straight or along a whole orbit.

All tests march together. Each keeps the surface that the teeth left, direction by direction, in a frame that
moves with the tool: a tooth cuts what lies beyond the surface, and nothing where it has jumped clear of it.
"""

from __future__ import annotations

import math

import numpy as np

from virtual_cell.milling import Coefficients
from virtual_cell.modes import Modes
from virtual_cell.regeneration import cleared
from virtual_cell.units import Array

_PER_TURN = 240  # steps of the spindle's turn
_SETTLING = 40  # turns after entry that do not count
_CHATTER = 0.25  # of the feed per tooth: change from tooth to tooth that an operator calls chatter


def stable(
    modes: tuple[Modes, Modes],
    coefficients: Coefficients,
    *,
    teeth: int,
    feed: float,
    rpm: Array,
    depth: Array,
    turns: int,
    orbit: float = 0.0,
) -> np.ndarray:
    """Return whether each test (n,) at ``rpm`` and ``depth`` (m) runs without chatter for ``turns``.

    ``modes`` of the two directions of the plane of cutting; ``feed`` per tooth, m; meanwhile the direction of
    feed turns by ``orbit``, rad, counter-clockwise, from x.
    """
    dt = 60.0 / (rpm * _PER_TURN)
    step, push = zip(*(m.steps(dt) for m in modes), strict=True)
    state = [np.zeros((len(rpm), len(m.damped), 2)) for m in modes]
    surface = np.zeros((len(rpm), _PER_TURN))
    angle = 2.0 * math.pi * np.arange(_PER_TURN) / _PER_TURN
    sine, cosine = np.sin(angle), np.cos(angle)
    offsets = np.arange(teeth) * (_PER_TURN // teeth)
    period = _PER_TURN // teeth  # chatter may be locked to the turns: who compares these does not see it
    trail = np.zeros((period, len(rpm), 2))
    worst = np.zeros(len(rpm))
    for i in range(turns * _PER_TURN):
        at = (i + offsets) % _PER_TURN
        ahead = np.sin(angle[at] + orbit * i / (turns * _PER_TURN))
        tip = np.stack([s[:, :, 0].sum(axis=1) for s in state], axis=1)
        force = _cut(surface, at, tip, advance=feed * ahead, ray=(sine[at], cosine[at]), k=coefficients)
        force *= depth[:, None]
        for axis in (0, 1):
            moved = (step[axis] @ state[axis][:, :, :, None])[:, :, :, 0]
            state[axis] = moved + push[axis] * force[:, axis, None, None]
        if i > _SETTLING * _PER_TURN:
            worst = np.maximum(worst, np.abs(tip - trail[i % period]).max(axis=1))
        trail[i % period] = tip
    return worst < _CHATTER * feed


def _cut(
    surface: Array, at: np.ndarray, tip: Array, *, advance: Array, ray: tuple[Array, Array], k: Coefficients
) -> Array:
    """Force (n, 2), N/m of depth, of the teeth now at directions ``at``; leaves the new surface."""
    sine, cosine = ray
    h = cleared(surface, at, tip[:, :1] * sine + tip[:, 1:] * cosine, advance)
    force = np.empty_like(tip)
    force[:, 0] = -(h * (k.ktc * cosine + k.krc * sine)).sum(axis=1)
    force[:, 1] = (h * (k.ktc * sine - k.krc * cosine)).sum(axis=1)
    return force
