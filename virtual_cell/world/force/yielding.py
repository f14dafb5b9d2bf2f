"""A tool that swings on its holder: two modes along skew axes, excited by the chips that they change.

Within less than a tooth's passing time, all surfaces that the tool meets are in the past. The chips of such a
stretch are traced for a tool displaced as it was a revolution before; forces and their slopes with the
displacement make a linear march through it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.chips import lags
from virtual_cell.units import UM, Array
from virtual_cell.world.force.cutting import Pass, Traced, on_points, summed, traced

PROBE = 0.01 * UM  # of a chip, to take the slope of the force


@dataclass(frozen=True)
class Holder:
    """Two modes at the tip: ``stiffness`` N/m, ``frequency`` Hz, ``damping``; the first along ``skew`` (rad).

    ``skew`` is counter-clockwise from work x; the second mode moves at right angles to the first.
    """

    stiffness: tuple[float, float]
    frequency: tuple[float, float]
    damping: tuple[float, float]
    skew: float

    def directions(self, turn: float) -> Array:
        """Rows: directions of the modes in a frame turned by ``turn`` (rad) against the work."""
        angle = self.skew - turn
        c, s = math.cos(angle), math.sin(angle)
        return np.array([[c, s], [-s, c]])

    @property
    def compliance(self) -> Array:
        """Static compliance (2, 2), m/N, in the work frame."""
        rows = self.directions(0.0)
        return np.asarray(rows.T @ np.diag(1.0 / np.array(self.stiffness)) @ rows)


def swinging_force(one: Pass, t: Array, holder: Holder, turn: float) -> Array:
    """Return the force of the edges (n, 3), N, at even times ``t``; the tool starts at rest, undeflected."""
    engagement = one.engagement
    dt = float(t[-1] - t[0]) / (len(t) - 1)
    rows, steps = holder.directions(turn), [propagator(holder, mode, dt) for mode in (0, 1)]
    shortest = float(lags(engagement.tool, engagement.slices).min()) / engagement.spindle
    turnaround = 2.0 * math.pi / engagement.spindle
    block = max(1, math.floor(0.9 * shortest / dt))
    moved, force = np.zeros((2, len(t))), np.zeros((len(t), 3))
    state = [0.0, 0.0, 0.0, 0.0]

    def past(time: Array) -> tuple[Array, Array]:
        x, y = engagement.motion.centre(time)
        return x + np.interp(time, t, moved[0]), y + np.interp(time, t, moved[1])

    for start in range(0, len(t), block):
        here = slice(start, min(start + block, len(t)))
        guess = np.stack([np.interp(t[here] - turnaround, t, along) for along in moved])
        cut, count = traced(one, t[here], past, guess), guess.shape[1]
        push, slope = _linear(one, cut, count)
        moved[:, here], state = march(push, slope, guess, state, rows=rows, steps=steps)
        thickness = cut.chips.thickness + _towards(cut, moved[:, here] - guess)
        force[here] = summed(cut, on_points(one, cut, thickness), count).T
    return force


def _towards(cut: Traced, shift: Array) -> Array:
    """By how much a shift (2, n) of the tool thickens the chips."""
    found = cut.chips
    return np.asarray(shift[0, found.sample] * found.sin + shift[1, found.sample] * found.cos)


def _linear(one: Pass, cut: Traced, count: int) -> tuple[Array, Array]:
    """Force in the plane (2, n), N, and its slopes (2, 2, n) with a displacement of the tool."""
    found = cut.chips
    parts = on_points(one, cut, found.thickness)[:2]
    change = (on_points(one, cut, found.thickness + PROBE)[:2] - parts) / PROBE
    slope = [summed(cut, change * along, count) for along in (found.sin, found.cos)]
    return summed(cut, parts, count), np.stack(slope, axis=1)


def march(
    push: Array,
    slope: Array,
    about: Array,
    state: list[float],
    *,
    rows: Array,
    steps: list[tuple[float, ...]],
) -> tuple[Array, list[float]]:
    """Step both modes under the force ``push`` + ``slope`` · (displacement − ``about``); (2, n) and the end.

    Over a step acts the mean of the forces at both its ends, of which the later one depends on where the step
    leads: so a stiff cut on a fast mode stays as stable as it is. Plain numbers: a step is too small for
    arrays.
    """
    # In the directions of the modes: force, and its slope.
    bend = np.einsum("ia,abn,jb->ijn", rows, slope, rows)
    base = (rows @ push - np.einsum("ijn,jn->in", bend, rows @ about)).T.tolist()
    gains = bend.transpose(2, 0, 1).reshape(-1, 4).tolist()
    (a, b, c, d, p, q), (e, f, g, h, r, s) = steps
    x, u, y, v = state
    out = []
    later = zip([*base[1:], base[-1]], [*gains[1:], gains[-1]], strict=True)
    for (f1, f2), (k11, k12, k21, k22), ((n1, n2), gain) in zip(base, gains, later, strict=True):
        m11, m12, m21, m22 = gain
        out.append((x, y))
        one, two = f1 + k11 * x + k12 * y, f2 + k21 * x + k22 * y
        # x' = free + p/2 (now + then), and then depends on x' and y': two equations.
        free, aside = a * x + b * u + 0.5 * p * (one + n1), e * y + f * v + 0.5 * r * (two + n2)
        xx, xy, yx, yy = 1.0 - 0.5 * p * m11, -0.5 * p * m12, -0.5 * r * m21, 1.0 - 0.5 * r * m22
        whole = xx * yy - xy * yx
        new, beside = (free * yy - xy * aside) / whole, (xx * aside - yx * free) / whole
        one, two = 0.5 * (one + n1 + m11 * new + m12 * beside), 0.5 * (two + n2 + m21 * new + m22 * beside)
        u, v = c * x + d * u + q * one, g * y + h * v + s * two
        x, y = new, beside
    return rows.T @ np.array(out).T, [x, u, y, v]


def propagator(holder: Holder, mode: int, dt: float) -> tuple[float, ...]:
    """Exact step of (position, velocity) over ``dt``, by rows, and effect (2,) of a force held over it."""
    from scipy.linalg import expm

    omega, damping = 2.0 * math.pi * holder.frequency[mode], holder.damping[mode]
    step = expm(np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]]) * dt)
    push = np.array([1.0 - step[0, 0], -step[1, 0]]) / holder.stiffness[mode]
    return (*step.ravel().tolist(), *push.tolist())
