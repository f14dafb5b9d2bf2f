"""An optical scanner: a cloud of a face, with noise that is partly correlated, and a registration error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.noise import quantised
from virtual_cell.units import MM, UM, Array


@dataclass(frozen=True)
class Scanner:
    """An optical scanner.

    Attributes
    ----------
    spacing, sigma : m. to_work : (4, 4), mm.
    height_error, tilt_error : of registration, standard deviations, m and rad.
    correlated : share of the noise's variance that is correlated over about 1 mm; the remaining noise is
    white.
    distortion : m, how much too high a plane reads in u³, u²v, uv² and v³, u, v in −1…1 over the face.
    """

    spacing: float
    sigma: float
    to_work: Array
    height_error: float = 10.0 * UM
    tilt_error: float = 5e-5
    correlated: float = 0.5
    distortion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


def scan(
    scanner: Scanner, size: tuple[float, float], height: Callable[[Array], Array], rng: np.random.Generator
) -> Array:
    """Return a cloud (n, 3), mm, scanner coordinates, of a face with ``height(points)``."""
    grid = [np.arange(0.5, extent / scanner.spacing) * scanner.spacing for extent in size]
    points = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 2)
    points = points + rng.uniform(-0.3, 0.3, points.shape) * scanner.spacing
    points = np.clip(points, 1e-6, np.array(size) - 1e-6)
    share = scanner.correlated
    noise = math.sqrt(share) * _correlated(points, size, rng)
    noise += math.sqrt(1.0 - share) * rng.standard_normal(len(points))
    z = height(points) + scanner.sigma * noise
    tilt = scanner.tilt_error * rng.standard_normal(2)
    z += scanner.height_error * rng.standard_normal() + (points - np.array(size) / 2.0) @ tilt
    u, v = (2.0 * points / np.array(size) - 1.0).T
    z += np.stack([u**3, u * u * v, u * v * v, v**3], axis=1) @ np.array(scanner.distortion)
    inverse = np.linalg.inv(scanner.to_work)
    cloud = np.column_stack([points, z]) / MM @ inverse[:3, :3].T + inverse[:3, 3]
    return quantised(cloud, 1e-3)


def _correlated(points: Array, size: tuple[float, float], rng: np.random.Generator) -> Array:
    """Noise of unit variance (n,) at points, correlated over about 1 mm."""
    from scipy.interpolate import RegularGridInterpolator
    from scipy.ndimage import gaussian_filter

    pitch = 0.25 * MM
    shape = [math.ceil(extent / pitch) + 1 for extent in size]
    field = gaussian_filter(rng.standard_normal(shape), 1.0 * MM / pitch / math.sqrt(2.0), mode="wrap")
    axes = [np.arange(n) * pitch for n in shape]
    noise: Array = RegularGridInterpolator(axes, field / field.std())(points)
    return noise
