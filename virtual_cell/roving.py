"""A modal test: a hammer on some points of a structure, accelerometers on all, raw records of every blow."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from virtual_cell.modes import Modes
from virtual_cell.units import Array

_OVERSAMPLE = 8  # of the integration, whose steps hold the force


def record(
    modes: Modes, shapes: Array, reference: int, rng: np.random.Generator, *, rate: float, duration: float
) -> tuple[Array, Array]:
    """Return force (n,), N, and the accelerations (p, n), m/s², of all points after a blow on one of them.

    A half-sine of about 5 ms and 400 N after 50 ms; white noise of 0.2 % of the peak on the force, 2 % of
    its rms on each response. The pulse acts with its value in the middle of each step, so that force and
    response keep the same clock to second order.

    Parameters
    ----------
    shapes : (p, m) real mode shapes; ``modes.stiffness`` is that where the shape is 1.
    """
    from scipy import signal

    dt = 1.0 / (rate * _OVERSAMPLE)
    t = np.arange(round(duration / dt)) * dt
    width, peak = 5e-3 * rng.uniform(0.85, 1.15), 400.0 * rng.uniform(0.7, 1.3)
    since = t - 0.05 - rng.uniform(0.0, 0.01)

    def pulse(s: Array) -> Array:
        return np.where((s > 0.0) & (s < width), peak * np.sin(math.pi * s / width), 0.0)

    own = _accelerations(modes, pulse(since), pulse(since + dt / 2.0), dt)
    motion = (shapes * shapes[reference]) @ signal.resample_poly(own, 1, _OVERSAMPLE, axis=1)
    force = signal.resample_poly(pulse(since), 1, _OVERSAMPLE)
    force += 0.002 * peak * rng.standard_normal(len(force))
    motion += 0.02 * motion.std(axis=1, keepdims=True) * rng.standard_normal(motion.shape)
    return force, motion


def _accelerations(modes: Modes, force: Array, held: Array, dt: float) -> Array:
    """Acceleration (m, n) of each mode where its shape is 1, under a force ``held`` over each step."""
    from scipy import signal

    moved = []
    for step, push, w, zeta in zip(*modes.steps(dt), modes.omega, modes.damping, strict=True):
        b, a = signal.ss2tf(step, push[:, None], np.array([[-(w**2), -2.0 * zeta * w]]), np.zeros((1, 1)))
        moved.append(signal.lfilter(b[0], a, held))
    return np.array(moved) + (modes.omega**2 / modes.stiffness)[:, None] * force


def blows(
    modes: Modes,
    shapes: Array,
    references: Sequence[int],
    rng: np.random.Generator,
    *,
    hits: int = 5,
    rate: float = 2048.0,
    duration: float = 4.0,
) -> Iterator[tuple[int, int, Array, Array]]:
    """Yield reference, replicate, force (n,) and accelerations (p, n) of every blow of a test."""
    for reference in references:
        for replicate in range(1, hits + 1):
            yield reference, replicate, *record(modes, shapes, reference, rng, rate=rate, duration=duration)


def some_shapes(points: int, modes: int, rng: np.random.Generator) -> Array:
    """Shapes (p, m) of no particular structure: 1 at the first point, less than 1 elsewhere."""
    shapes = rng.uniform(-1.0, 1.0, (points, modes))
    shapes[0] = 1.0
    return shapes


def receptance(modes: Modes, shapes: Array, reference: int, frequency: Array) -> Array:
    """Receptance (n, p), complex, m/N, from the reference to all points at ``frequency`` (n,), Hz."""
    omega = 2.0 * math.pi * frequency[:, None]
    each = modes.omega**2 / modes.stiffness
    each = each / (modes.omega**2 - omega**2 + 2j * modes.damping * modes.omega * omega)
    total: Array = each @ (shapes * shapes[reference]).T
    return total
