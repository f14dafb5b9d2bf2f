"""Hammer tests: a pulse on the tip, the acceleration that follows, and the noise of both channels."""

from __future__ import annotations

import math

import numpy as np

from virtual_cell.modes import Modes
from virtual_cell.noise import sensor_noise
from virtual_cell.units import Array

_OVERSAMPLE = 16  # of the integration, whose steps hold the force


def hit(modes: Modes, rate: float, duration: float, rng: np.random.Generator) -> dict[str, Array]:
    """Return one driving-point record, columns of the contract: force, N, and acceleration, m/s².

    A half-sine of about 5 ms and 400 N after 50 ms; noise 0.2 % of the peak on the force, 2 % of its rms on
    the response.
    """
    from scipy import signal

    fine = rate * _OVERSAMPLE
    t = np.arange(round(duration * fine)) / fine
    width, peak = 5e-3 * rng.uniform(0.85, 1.15), 400.0 * rng.uniform(0.7, 1.3)
    since = t - 0.05 - rng.uniform(0.0, 0.01)
    force = np.where((since > 0.0) & (since < width), peak * np.sin(math.pi * since / width), 0.0)
    motion = acceleration(modes, force, 1.0 / fine)
    force, motion = (signal.resample_poly(channel, 1, _OVERSAMPLE) for channel in (force, motion))
    force += sensor_noise(len(force), 0.002 * peak, rng, pink=0.1)
    motion += sensor_noise(len(motion), 0.02 * float(motion.std()), rng, pink=0.1)
    return {"t_s": np.arange(len(force)) / rate, "force_n": force, "response": motion}


def acceleration(modes: Modes, force: Array, dt: float) -> Array:
    """Acceleration (n,), m/s², of the tip under a force (n,), N, sampled every ``dt`` s, from rest."""
    step, push = modes.steps(dt)
    states = np.zeros((len(force) + 1, len(modes.damped), 2))
    for i, f in enumerate(force):
        states[i + 1] = (step @ states[i][:, :, None])[:, :, 0] + push * f
    x, v = states[:-1, :, 0], states[:-1, :, 1]
    per_mass = modes.omega**2 / modes.stiffness
    # the force is held over each step: at a sample it has just jumped, and acts with the mean of both sides
    jumping = 0.5 * (force + np.concatenate([[0.0], force[:-1]]))
    total: Array = (
        per_mass * jumping[:, None] - 2.0 * modes.damping * modes.omega * v - modes.omega**2 * x
    ).sum(axis=1)
    return total


def receptance(modes: Modes, frequency: Array) -> Array:
    """Receptance (n,), complex, m/N, at ``frequency`` (n,), Hz, e^{+iωt}."""
    omega = 2.0 * math.pi * frequency[:, None]
    shape = modes.omega**2 - omega**2 + 2j * modes.damping * modes.omega * omega
    total: Array = (modes.omega**2 / modes.stiffness / shape).sum(axis=1)
    return total
