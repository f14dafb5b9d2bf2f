"""The tip of a milling arm that yields: how it moves in z under the mean cutting force, pass by pass.

Teeth pass far above the arm's modes, so that the mean force alone drives the tip's mass, on a stiffness that
depends on where on the plate the tip is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.face import Passes
from virtual_cell.units import Array

_STEP = 0.002  # s, of the motion of the tip


@dataclass(frozen=True)
class Tip:
    """Dynamics of the tip: ``mass`` (3, 3), kg; C = a0 M + a1 K; ``stiffness`` (n, 2) → (n, 3, 3), N/m."""

    mass: Array
    a0: float
    a1: float
    stiffness: Callable[[Array], Array]


def tip_heights(
    passes: Passes, tip: Tip, force: Callable[[Array], Array], gains: Array | None = None
) -> list[tuple[Array, Array]]:
    """Return, pass by pass, lengths ``s`` (n,) and the tip's height (n,), both m.

    ``force(s)`` (n, 3), N, work frame, acts on it, in pass k ``gains[k]`` times; the tip goes on ringing on
    its way back.
    """
    state = np.zeros(9)
    count = round(passes.period / _STEP)
    s = -passes.lead + passes.speed * _STEP * np.arange(count)
    cutting = s < passes.length + passes.lead
    load = np.where(cutting[:, None], force(s), 0.0)
    inside = np.clip(s, 0.0, passes.length)
    heights: list[tuple[Array, Array]] = []
    for number in range(len(passes.axes)):
        gain = 1.0 if gains is None else float(gains[number])
        step, push = _newmark(tip, tip.stiffness(passes.points(inside, number)), gain * load)
        z = np.empty(count)
        for i in range(count):
            state = step[i] @ state + push[i]
            z[i] = state[2]
        heights.append((s[cutting], z[cutting]))
    return heights


def _newmark(tip: Tip, stiffness: Array, load: Array) -> tuple[Array, Array]:
    """Average-acceleration steps of position, velocity and acceleration: (n, 9, 9) and (n, 9).

    Newmark, J. Eng. Mech. Div. 85 (1959) 67, with β = 1/4, γ = 1/2.
    """
    h, one, none = _STEP, np.eye(3), np.zeros((3, 3))
    mass = np.broadcast_to(tip.mass, stiffness.shape)
    damping = tip.a0 * mass + tip.a1 * stiffness
    inverse = np.linalg.inv(mass * (4.0 / h**2) + damping * (2.0 / h) + stiffness)
    rows = np.concatenate(
        [mass * (4.0 / h**2) + damping * (2.0 / h), mass * (4.0 / h) + damping, mass], axis=2
    )
    x, dx = inverse @ rows, (inverse @ load[:, :, None])[:, :, 0]
    v = x * (2.0 / h) - np.hstack([one * (2.0 / h), one, none])
    a = v * (2.0 / h) - np.hstack([none, one * (2.0 / h), one])
    return np.concatenate([x, v, a], axis=1), np.hstack([dx, dx * (2.0 / h), dx * (4.0 / h**2)])
