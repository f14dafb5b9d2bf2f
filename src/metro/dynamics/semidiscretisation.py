"""First-order semi-discretisation with exact interval means: the independent check of the default method.

Insperger and Stépán, Semi-Discretization for Time-Delay Systems (2011). The delayed displacement is linear
over each step; the directional factors are their exact means over it, so that entry and exit may fall between
the steps.
"""

from __future__ import annotations

import numpy as np

from metro.dynamics.system import Cut, Structure
from metro.units import Array


def spectral_radius(structure: Structure, cut: Cut, rpm: float, depth: float, steps: int) -> float:
    """Largest modulus of the Floquet multipliers by ``steps`` steps per tooth period; unstable above 1.

    The error falls with the square of ``steps``, of which about 45 per vibration cycle are needed for 0.5 %.
    """
    from scipy.linalg import expm

    free, force_in, displacement_out = state_space(structure)
    n = len(free)
    dt = float(cut.tooth_period(np.array(rpm))) / steps
    # z: modal state now, then the displacements at the last 'steps' + 1 instants, newest first
    total = np.zeros((n + 2 * (steps + 1),) * 2)
    total[:] = np.eye(len(total))
    total[n : n + 2] = 0.0
    total[n : n + 2, :n] = displacement_out
    for factor in mean_directional_factors(cut, steps):
        regenerative = depth * force_in @ factor
        exponent = np.zeros((n + 4, n + 4))
        exponent[:n, :n] = free + regenerative @ displacement_out
        exponent[:n, n : n + 2] = -regenerative
        exponent[n : n + 2, n + 2 :] = np.eye(2)
        step = expm(exponent * dt)[:n]
        from_start, from_slope = step[:, n : n + 2], step[:, n + 2 :] / dt
        oldest, next_oldest = total[-2:], total[-4:-2]
        state = step[:, :n] @ total[:n] + (from_start - from_slope) @ oldest + from_slope @ next_oldest
        total = np.concatenate([state, displacement_out @ state, total[n:-2]])
    return float(np.abs(np.linalg.eigvals(total)).max())


def state_space(structure: Structure) -> tuple[Array, Array, Array]:
    """Matrices (2m, 2m), (2m, 2), (2, 2m) of z' = A z + B F, displacement = C z; z is q, then q'."""
    m = len(structure.omega)
    direction = np.eye(2)[structure.axis]
    damping = np.diag(2.0 * structure.zeta * structure.omega)
    free = np.block([[np.zeros((m, m)), np.eye(m)], [-np.diag(structure.omega**2), -damping]])
    force_in = np.concatenate(
        [np.zeros((m, 2)), direction * (structure.omega**2 / structure.stiffness)[:, None]]
    )
    displacement_out = np.concatenate([direction.T, np.zeros((2, m))], axis=1)
    return free, force_in, displacement_out


def mean_directional_factors(cut: Cut, steps: int) -> Array:
    """Return the means (steps, 2, 2) over each step of force per depth and displacement, N/m²."""
    edges = cut.pitch * np.arange(steps + 1) / steps
    total = np.zeros((steps, 2, 2))
    for tooth in range(cut.teeth):
        phi = np.clip(edges + tooth * cut.pitch, cut.entry, cut.exit)
        ss, sc, cc = phi / 2 - np.sin(2 * phi) / 4, np.sin(phi) ** 2 / 2, phi / 2 + np.sin(2 * phi) / 4
        rows = [-(cut.ktc * sc + cut.krc * ss), -(cut.ktc * cc + cut.krc * sc)]
        rows += [cut.ktc * ss - cut.krc * sc, cut.ktc * sc - cut.krc * cc]
        total += np.diff(np.stack(rows, axis=1), axis=0).reshape(steps, 2, 2)
    return total * steps / cut.pitch
