"""First-order semi-discretisation with exact interval means: the independent check of the default method.

Insperger and Stépán, Semi-Discretization for Time-Delay Systems (2011). The delayed displacement is linear
over each step; the directional factors are their exact means over it and over the height of the cut, so that
entry and exit may fall between the steps. It takes helix, unequal pitch and runout
(:mod:`metro.dynamics.teeth`), which the default method does not, and process damping, which both do.
"""

from __future__ import annotations

import numpy as np

from metro.dynamics import periodmap
from metro.dynamics.periodmap import PeriodMap
from metro.dynamics.system import Structure
from metro.dynamics.teeth import Engagement, mean_damping_factors, mean_directional_factors
from metro.units import Array

_TOGETHER = 16  # speeds in one stack
_WHOLE = 1e-9  # rounding of a delay of whole steps


def spectral_radius(
    structure: Structure, engagement: Engagement, rpm: Array, depth: Array, steps: int
) -> Array:
    """Largest modulus of the Floquet multipliers at speeds (k,) rev/min and depths (k,) m; unstable above 1.

    The period of ``engagement`` is cut into ``steps``. The error falls with their square; about 45 per
    vibration cycle are needed for 0.5 %.
    """
    rpm, depth = np.broadcast_arrays(np.asarray(rpm, dtype=float), np.asarray(depth, dtype=float))
    stacks = np.array_split(np.arange(len(rpm)), -(-len(rpm) // _TOGETHER))
    maps = (period_map(structure, engagement, rpm[i], depth[i], steps) for i in stacks)
    return np.concatenate([periodmap.spectral_radius(one) for one in maps])


def boundary_near(
    structure: Structure, engagement: Engagement, rpm: Array, start: Array, steps: int
) -> Array:
    """Depths (k,) m at which the largest multiplier has modulus 1, each near ``start`` (k,)."""
    return periodmap.unit_radius(
        lambda depth: spectral_radius(structure, engagement, rpm, depth, steps), np.asarray(start)
    )


def lowest_boundary(
    structure: Structure, engagement: Engagement, rpm: Array, around: Array, steps: int
) -> Array:
    """Lowest depths (k,) m at which the cut turns unstable, sought from 0.4 to 2.5 times ``around`` (k,).

    NaN where it does not within these, or where that is not known of one of the depths tried.
    """
    shares = np.geomspace(0.4, 2.5, 14)
    radius = np.stack(
        [spectral_radius(structure, engagement, rpm, share * around, steps) for share in shares]
    )
    first = (radius > 1.0).argmax(axis=0)
    start = around * np.sqrt(shares[first] * shares[np.maximum(first - 1, 0)])
    depth = boundary_near(structure, engagement, rpm, start, steps)
    return np.where((first > 0) & np.isfinite(radius).all(axis=0), depth, np.nan)


def period_map(
    structure: Structure, engagement: Engagement, rpm: Array, depth: Array, steps: int
) -> PeriodMap:
    """Discretise one period at speeds and depths (k,)."""
    from scipy.linalg import expm

    free, force_in, displacement_out = state_space(structure)
    n = len(free)
    spindle = 2.0 * np.pi * rpm / 60.0
    dt = (engagement.turn / (spindle * steps))[:, None]
    factors, delays = mean_directional_factors(engagement, depth, steps)
    factors = depth[:, None, None, None, None] * factors
    acting = factors.sum(axis=2) @ displacement_out
    if engagement.cut.damping:
        per_speed = mean_damping_factors(engagement, depth, steps) * (depth / spindle)[:, None, None, None]
        acting += per_speed @ displacement_out @ free  # a force does not change the displacement at once
    # the force of the delayed displacements, linear over the step, is carried as two more pairs of states
    exponent = np.zeros((len(rpm), steps, n + 4, n + 4))
    exponent[..., :n, :n] = free + force_in @ acting
    exponent[..., :n, n : n + 2] = force_in
    exponent[..., n : n + 2, n + 2 :] = np.eye(2)
    step = expm(exponent * dt[..., None, None])[..., :n, :]
    from_end = step[..., n + 2 :] / dt[..., None, None]
    from_start = step[..., n : n + 2] - from_end
    whole, part = np.divmod(delays / engagement.turn * steps + _WHOLE, 1.0)
    part[part < 2.0 * _WHOLE] = 0.0
    lags = np.unique(np.concatenate([whole, whole + 1, whole[part > 0.0] + 2]).astype(int))
    delayed = np.zeros((len(rpm), steps, len(lags), n, 2))
    for j in range(len(delays)):
        start, end = -from_start @ factors[:, :, j], -from_end @ factors[:, :, j]
        first = int(np.searchsorted(lags, whole[j]))
        delayed[:, :, first] += (1.0 - part[j]) * end
        delayed[:, :, first + 1] += part[j] * end + (1.0 - part[j]) * start
        if part[j] > 0.0:
            delayed[:, :, first + 2] += part[j] * start
    return PeriodMap(step[..., :n], delayed, lags, displacement_out)


def state_space(structure: Structure) -> tuple[Array, Array, Array]:
    """Matrices (2m, 2m), (2m, 2), (2, 2m) of z' = A z + B F, displacement = C z; z is q, then q' / omega."""
    m = len(structure.omega)
    direction = structure.along
    omega = np.diag(structure.omega)
    free = np.block([[np.zeros((m, m)), omega], [-omega, -2.0 * structure.zeta * omega]])
    force_in = np.concatenate(
        [np.zeros((m, 2)), direction * (structure.omega / structure.stiffness)[:, None]]
    )
    displacement_out = np.concatenate([direction.T, np.zeros((2, m))], axis=1)
    return free, force_in, displacement_out
