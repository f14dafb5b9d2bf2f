"""Draws over published ranges: log-uniform where a range spans much, one value for each joint."""

from __future__ import annotations

import math

import numpy as np

from virtual_cell.units import Array


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform between two positive numbers."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def per_joint(rng: np.random.Generator, low: float, high: float) -> Array:
    """Log-uniform, (6,)."""
    return np.exp(rng.uniform(math.log(low), math.log(high), 6))


def signed(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform, of either sign."""
    return between(rng, low, high) * either_sign(rng)


def either_sign(rng: np.random.Generator) -> float:
    """Draw −1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw uniformly, three digits."""
    return float(f"{rng.uniform(low, high):.3g}")


def towards(rng: np.random.Generator) -> Array:
    """Direction (3,), evenly drawn."""
    drawn = rng.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))


def digits(value: float) -> float:
    """Round to three digits."""
    return float(f"{value:.3g}")
