"""Draws over published ranges."""

from __future__ import annotations

import numpy as np


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw log-uniformly, three digits."""
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.3g}")


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw uniformly, three digits."""
    return float(f"{rng.uniform(low, high):.3g}")


def either_sign(rng: np.random.Generator) -> float:
    """Draw −1 or 1."""
    return float(rng.choice([-1.0, 1.0]))
