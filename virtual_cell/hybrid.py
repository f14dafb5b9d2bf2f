"""A hybrid machine over its workspace: end stiffness, modes at the tip, and their shapes along the structure.

The source prints coordinates of seven positions and the modes of the first of them; it draws the end
stiffness of 73 positions without numbers. All else of this simulated machine is made up after what is said of
it: y is by far the stiffest direction, each stiffness is largest in the middle and falls towards the border,
and modes change from position to position.
"""

from __future__ import annotations

import numpy as np

from virtual_cell.modes import Modes
from virtual_cell.units import N_UM, Array

MIDDLE_MM = np.array([0.0, 0.0, -60.0])  # where the end is stiffest
HALF_MM = np.array([550.0, 300.0, 400.0])  # half the workspace's extent along x, y, z
STIFFEST_N_UM = np.array([0.935, 31.2, 9.35])
FALL = np.outer([1.0, 1.05, 1.1], [0.40, 0.25, 0.25])  # of the logarithm, by the squared way to the border
LEAN = 0.05  # rad at the border: the principal axes of the stiffness turn as the limbs lean
# Logarithmic change of a mode from the middle to the border: of its frequency, damping and compliance.
CHANGE = (0.08, 0.15, 0.25)
POINTS = ("1", "2", "3", "4", "5", "6")  # tip, wrist, platform, limb low and high, base
DISTANCE_M = np.array([0.0, 0.25, 0.5, 0.9, 1.3, 1.7])  # of each from the tip, along the structure
REMOTE_M = 0.9  # over which the motion falls by e
WAVE_M = 3.0  # wavelength of the second mode along the structure; the others' is as their number


def positions(named: dict[str, tuple[float, float, float]]) -> dict[str, Array]:
    """Return places (3,), mm, of the named positions, and of others around them: 73 for seven named.

    Three slices across y, each with its middle, an inner ring of seven and an outer one of fourteen.
    """
    rings = [(0.0, 1), (0.5, 7), (0.95, 14)]
    places = {name: np.array(place, dtype=float) for name, place in named.items()}
    for y in (-200.0, 0.0, 200.0):
        for radius, count in rings:
            for turn in 2.0 * np.pi * np.arange(count) / count:
                across = MIDDLE_MM + radius * HALF_MM * np.array([np.cos(turn), 0.0, np.sin(turn)])
                places[f"s{len(places) + 1:02d}"] = np.round(across + np.array([0.0, y, 0.0]), 1)
    return places


def end_stiffness(place_mm: Array) -> Array:
    """Stiffness (3, 3), N/m, of the end at a place (3,), mm: force = stiffness @ deflection, base axes."""
    way = (place_mm - MIDDLE_MM) / HALF_MM
    principal = STIFFEST_N_UM * N_UM * np.exp(-FALL @ way**2)
    z, x, y = (
        LEAN * way
    )  # turned about x by the way along z, about y by that along x, about z by that along y
    turn = _about(0, y) @ _about(1, z) @ _about(2, x)
    matrix: Array = turn @ np.diag(principal) @ turn.T
    return matrix


def _about(axis: int, angle: float) -> Array:
    i, j = (k for k in range(3) if k != axis)
    turn = np.eye(3)
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
    return turn


def modes_at(place_mm: Array, at_first: dict[str, Modes], first_mm: Array) -> dict[str, Modes]:
    """Modes at a place from those at the first position; their static compliance is that of the end.

    Each property of each mode changes along a direction of its own.
    """
    rng = np.random.default_rng(1879)
    way = (place_mm - first_mm) / HALF_MM
    here, first = (np.diag(np.linalg.inv(end_stiffness(place))) for place in (place_mm, first_mm))
    found = {}
    for direction, modes in at_first.items():
        axis = "xyz".index(direction)
        along = rng.normal(size=(len(CHANGE), len(modes.damped), 3)) / np.sqrt(3.0)
        frequency, damping, share = (
            np.exp(size * part @ way) for size, part in zip(CHANGE, along, strict=True)
        )
        soft = share / modes.stiffness
        soft *= np.sum(1.0 / modes.stiffness) / soft.sum() * here[axis] / first[axis]
        found[direction] = Modes(modes.damped * frequency, modes.damping * damping, 1.0 / soft)
    return found


def shapes(place_mm: Array, modes: int) -> Array:
    """Shapes (points, modes) of the modes of a direction: 1 at the tip, small at the base."""
    longer = 1.0 + 0.1 * (place_mm[0] - MIDDLE_MM[0]) / HALF_MM[0]
    way = DISTANCE_M[:, None] / longer
    waves: Array = np.exp(-way / REMOTE_M) * np.cos(2.0 * np.pi * np.arange(modes) * way / WAVE_M)
    return waves
