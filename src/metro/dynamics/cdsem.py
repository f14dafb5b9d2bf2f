"""The published method of the helical-milling machine: complete discretisation with Euler's method (CDSEM).

State, delayed state and derivative are all differenced; an interpolation between the ends of the step makes
it explicit (0), the midpoint rule (1/2) or implicit (1). Each mode is solved alone and the lowest boundary
counts: neither is exact, and neither bounds what the coupled modes do.
"""

from __future__ import annotations

import math

import numpy as np

from metro.dynamics import periodmap
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.periodmap import PeriodMap
from metro.dynamics.system import Cut, Structure, chip_direction
from metro.units import Array

MIDPOINT = 0.5
_NODES, _BETWEEN_NODES = 720, 1.05  # nodes per pitch, and how much a factor may exceed the largest at a node


def single_mode_depths(structure: Structure, cut: Cut, rpm: Array) -> Array:
    """Lowest depths (m, k) in metres of each of the m modes solved alone, at speeds (k,) rev/min."""
    alone = [structure.mode(i) for i in range(len(structure.omega))]
    return np.stack([stability_boundary(one, cut, rpm).depth for one in alone])


def governing_depths(structure: Structure, cut: Cut, rpm: Array) -> Array:
    """Return the same, but infinite where another mode alone is surely lower: stiff modes cost nothing."""
    safe = surely_stable_alone(structure, cut)
    depths = np.full((len(safe), len(rpm)), np.inf)
    for mode in np.argsort(safe):
        asked = safe[mode] < depths.min(axis=0)
        if asked.any():
            depths[mode, asked] = stability_boundary(structure.mode(mode), cut, rpm[asked]).depth
    return depths


def surely_stable_alone(structure: Structure, cut: Cut) -> Array:
    """Depths (m,) in metres below which each mode alone is stable at any speed, by the small-gain theorem.

    A mode answers a force by its resonance peak at most, and the chip by twice its displacement at most.
    """
    zeta = np.minimum(structure.zeta, math.sqrt(0.5))
    peak = 1.0 / (2.0 * structure.stiffness * zeta * np.sqrt(1.0 - zeta**2))
    factor = np.abs(_node_factors(cut, _NODES, structure.directions)).max(axis=0)[structure.axis]
    safe: Array = 1.0 / (2.0 * _BETWEEN_NODES * factor * peak)
    return safe


def steps_for_stability(structure: Structure, cut: Cut, rpm: float) -> int:
    """Return the steps per tooth period above which explicit Euler steps do not make free vibration grow."""
    return int(_steps_needed(structure, cut, np.array(rpm)).max())


def cdsem_depths(structure: Structure, cut: Cut, rpm: Array, exact: Array) -> Array:
    """Depths (m, k) in metres at which CDSEM has each mode alone become unstable, near ``exact`` (m, k).

    By the midpoint rule, with as many steps as the explicit rule would need to be stable, or up to twice as
    many; infinite where ``exact`` is.
    """
    mode, speed = np.nonzero(np.isfinite(exact))
    depths = np.full(exact.shape, np.inf)
    needed = _steps_needed(structure, cut, rpm[speed])[mode, np.arange(len(mode))]
    for rows in periodmap.stacks(needed, 2.0):
        i, k = mode[rows], speed[rows]
        depths[i, k] = _depths(structure, cut, i, rpm[k], exact[i, k], steps=int(needed[rows].max()))
    return depths


def _depths(
    structure: Structure, cut: Cut, mode: np.ndarray, rpm: Array, near: Array, *, steps: int
) -> Array:
    """Depths (c,) at which modes ``mode`` (c,) alone become unstable at speeds (c,), near ``near`` (c,)."""
    return periodmap.unit_radius(
        lambda depth: spectral_radius(structure, cut, mode, rpm, depth, steps=steps), near
    )


def _steps_needed(structure: Structure, cut: Cut, rpm: Array) -> np.ndarray:
    """(m, k) or (m,) steps per tooth period that explicit Euler steps need for each mode to decay."""
    ratio = np.multiply.outer(structure.omega / (2.0 * structure.zeta), cut.tooth_period(rpm))
    return np.floor(ratio).astype(int) + 1


def spectral_radius(
    structure: Structure,
    cut: Cut,
    mode: np.ndarray,
    rpm: Array,
    depth: Array,
    *,
    steps: int,
    interpolation: float = MIDPOINT,
) -> Array:
    """Largest modulus of the multipliers of modes ``mode`` (c,) alone, at speeds and depths (c,)."""
    axis, omega, zeta = structure.axis[mode], structure.omega[mode], structure.zeta[mode]
    factor = _node_factors(cut, steps, structure.directions)[:, axis].T  # (c, steps + 1)
    between = (1.0 - interpolation) * factor[:, :-1] + interpolation * factor[:, 1:]
    dt = cut.tooth_period(rpm) / steps
    regenerative = depth[:, None] * between * (omega / structure.stiffness[mode])[:, None]
    rate = np.zeros((len(mode), steps, 2, 2))  # of the states q and q' / omega
    rate[..., 0, 1] = omega[:, None]
    rate[..., 1, 0] = regenerative - omega[:, None]
    rate[..., 1, 1] = -2.0 * (zeta * omega)[:, None]
    rate *= dt[:, None, None, None]
    solve = np.linalg.inv(np.eye(2) - interpolation * rate)
    push = solve @ np.stack([np.zeros_like(regenerative), -dt[:, None] * regenerative], axis=-1)[..., None]
    delayed = np.stack([interpolation * push, (1.0 - interpolation) * push], axis=2)
    state = solve @ (np.eye(2) + (1.0 - interpolation) * rate)
    out = np.array([[1.0, 0.0]])
    return periodmap.spectral_radius(PeriodMap(state, delayed, np.array([steps, steps + 1]), out))


def _node_factors(cut: Cut, steps: int, along: Array) -> Array:
    """Force along each of the directions (d, 2) per depth and displacement along itself: (steps + 1, d)."""
    phi = cut.pitch * (np.arange(steps + 1)[:, None] / steps + np.arange(-cut.teeth, cut.teeth))
    inside = (phi > cut.entry - 1e-9) & (phi < cut.exit - 1e-9)  # of two teeth that change places, one
    force, chip = cut.force_direction(phi) @ along.T, chip_direction(phi) @ along.T
    factors: Array = (inside[..., None] * force * chip).sum(axis=1)
    return factors
