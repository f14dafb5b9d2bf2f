"""The wall that a side cut leaves, as a stylus traces it: deflection, tracking error, feed marks."""

from __future__ import annotations

import math

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.noise import quantised, sensor_noise
from virtual_cell.units import MM, UM, Array

# The first mode of the arm: the tip follows the mean force with it.
MODE_HZ, MODE_DAMPING = 14.0, 0.12


def settled(x: Array, static: Array, speed: float) -> Array:
    """Deflection (n,) along even positions ``x``, m: the static one through the arm's first mode."""
    from scipy import signal

    omega = 2.0 * math.pi * MODE_HZ
    system = ([omega**2], [1.0, 2.0 * MODE_DAMPING * omega, omega**2])
    num, den, _ = signal.cont2discrete(system, (x[1] - x[0]) / speed, method="foh")
    moved: Array = signal.lfilter(np.ravel(num), den, static)
    return moved


def feed_marks(x: Array, feed: float, tool: Tool, phase: float) -> Array:
    """Height (n,), m, of the cusps that the teeth leave, and of the runout's mark once per turn."""
    cusp = (np.mod(x / feed + phase, 1.0) - 0.5) * feed
    marks: Array = cusp**2 / (2.0 * tool.radius) + 0.1 * tool.runout * np.sin(
        2.0 * np.pi * (x / (tool.teeth * feed) + phase)
    )
    return marks


def trace(x: Array, height: Array, sigma: float, rng: np.random.Generator) -> dict[str, Array]:
    """Return the stylus record of a wall, columns of the contract: noise, and a resolution of 10 nm."""
    read = height + sensor_noise(len(x), sigma, rng)
    return {"x_mm": x / MM, "z_mm": quantised(read, 0.01 * UM) / MM}
