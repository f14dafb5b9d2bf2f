"""A tool tip that yields: a small mass on springs, marched in time, that leaves a deflected surface behind.

Within less than a tooth's passing time the surfaces that it meets are all in the past: the chips of such a
block are traced at once for a tool displaced as it was a revolution before (a raw edge of the block is met
where the displaced tool meets it), and the tip then steps through them, each chip growing by what the
deflection has grown towards it.
"""

from __future__ import annotations

import math

import numpy as np

from virtual_cell.chips import Path, chips, lags
from virtual_cell.milling import Cut, engaged
from virtual_cell.units import Array

# The tip follows forces up to far above tooth passing, as a static spring would.
TIP_FREQUENCY = 12e3  # Hz
TIP_DAMPING = 0.7
SUBSTEPS = 2  # of the march, which holds the force over a step


def yielding_force(cut: Cut, t: Array) -> Array:
    """Return the force of the peripheral edges (n, 3), N, at even times ``t`` (s); the tip starts at rest."""
    engagement = cut.engagement
    rate = (len(t) - 1) / (t[-1] - t[0]) * SUBSTEPS
    t = t[0] + np.arange(len(t) * SUBSTEPS) / rate
    shortest = float(lags(engagement.tool, engagement.slices).min()) / engagement.spindle
    revolution = 2.0 * math.pi / engagement.spindle
    block = max(1, math.floor(0.95 * shortest * rate))
    moved, force = np.zeros((len(t), 2)), np.zeros((len(t), 3))
    state: Array = np.zeros((2, 2))

    def past(time: Array) -> tuple[Array, Array]:
        x, y = engagement.motion.centre(time)
        return x + np.interp(time, t, moved[:, 0]), y + np.interp(time, t, moved[:, 1])

    for start in range(0, len(t), block):
        stop = min(start + block, len(t))
        here = slice(start, stop)
        guess = np.stack([np.interp(t[here] - revolution, t, along) for along in moved.T])
        dense = _dense(cut, t[here], past, guess)
        state = _march(cut, t[here], dense, guess, state, dt=1.0 / rate, moved=moved[here], force=force[here])
    return force[::SUBSTEPS]


def _dense(cut: Cut, t: Array, past: Path, guess: Array) -> Array:
    """Return what a tool that is displaced by ``guess`` (2, n) cuts, (4, n, N·S).

    Chip, sine and cosine of the immersion, and the width of the slice that is engaged.
    """
    engagement = cut.engagement
    teeth, levels = engagement.tool.teeth, len(engagement.slices)
    dense = np.zeros((4, len(t), teeth, levels))
    dense[0] = -np.inf
    for tooth in range(teeth):
        traced = chips(engagement, t, tooth, past, guess)
        dense[:3, traced.sample, tooth, traced.level] = traced.thickness, traced.sin, traced.cos
        dense[3, traced.sample, tooth, traced.level] = engaged(engagement, traced)
    return dense.reshape(4, len(t), teeth * levels)


def _march(
    cut: Cut, t: Array, dense: Array, guess: Array, state: Array, *, dt: float, moved: Array, force: Array
) -> Array:
    """Step the tip through one block, filling ``moved`` and ``force``; return position and velocity."""
    assert cut.compliance is not None
    worn = np.asarray(cut.coefficients.worn(cut.metres(t)))
    step, push = _propagator(dt)
    for i, (thickness, sine, cosine, width) in enumerate(zip(*dense, strict=True)):
        x, y = state[0] - guess[:, i]
        law = cut.coefficients.per_length(thickness + x * sine + y * cosine, worn[i])
        tangential, radial, axial = (width * each for each in law)
        force[i] = (
            -(tangential @ cosine + radial @ sine),
            tangential @ sine - radial @ cosine,
            axial.sum(),
        )
        moved[i] = state[0]
        state = step @ state + np.outer(push, cut.compliance @ force[i, :2])
    return state


def _propagator(dt: float) -> tuple[Array, Array]:
    """Exact step (2, 2) of (position, velocity), and effect (2,) of a static deflection held over it."""
    from scipy.linalg import expm

    omega = 2.0 * math.pi * TIP_FREQUENCY
    step = expm(np.array([[0.0, 1.0], [-(omega**2), -2.0 * TIP_DAMPING * omega]]) * dt)
    return step, np.array([1.0 - step[0, 0], -step[1, 0]])
