"""How often the 95 % intervals of noise-corrected flatness hold the true index: shape, noise and density.

The true index is that of the same points without noise, through the same filter. Every face is 80 × 60 mm.
Run: ``python benchmarks/coverage_flatness.py [draws] [points ...]``, which prints a table.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from scipy.ndimage import gaussian_filter

from metro.surface.face import Face, measure_face
from metro.surface.face_noise import Noise, repeat_noise
from metro.surface.noise_spectrum import CORRELATION
from metro.units import MM, UM, Array

LENGTH, WIDTH = 80 * MM, 60 * MM
WHITE, CORRELATED = 15 * UM, 12 * UM
INDICES = ("xm", "xa", "xg", "fltt", "fltp", "fltv", "fltq", "minimum_zone")
DENSITIES = (2_000, 20_000, 100_000)

SHAPES: dict[str, Callable[[Array, Array], Array]] = {
    "dome": lambda u, v: 60 * UM * np.cos(np.pi * u) * np.cos(1.5 * v),
    "grooves": lambda u, v: 15 * UM * np.cos(2 * np.pi * (4.3 * u + 0.2)) + 0 * v,
    "saddle": lambda u, v: 160 * UM * u * v,
    "waves": lambda u, v: 20 * UM * np.sin(2 * np.pi * (1.3 * u + 0.7 * v)) + 30 * UM * u**2 * v,
    "near-flat": lambda u, v: 2 * UM * np.cos(np.pi * u) * np.cos(1.5 * v),
}
NOISES = ("white, known", "white, one scan", "correlated, known", "correlated, repeats")


def lattice(points: int) -> tuple[Array, Array]:
    """Return x and y of about ``points`` points on a square lattice, in m."""
    pitch = float(np.sqrt(LENGTH * WIDTH / points))
    x, y = (np.arange(pitch / 2, extent, pitch) for extent in (LENGTH, WIDTH))
    one, other = np.meshgrid(x, y, indexing="ij")
    return one, other


def scan(x: Array, y: Array, shape: str, noise: str, rng: np.random.Generator | None = None) -> Array:
    """Return points (n, 3) of a face, without noise where there is no ``rng``."""
    z = SHAPES[shape](x / LENGTH - 0.5, y / WIDTH - 0.5)
    if rng is not None:
        z = z + rng.normal(0, WHITE, x.shape)
        if noise.startswith("correlated"):
            blur = CORRELATION / float(x[1, 0] - x[0, 0])
            fine = gaussian_filter(rng.normal(size=x.shape), blur, mode="wrap")
            alone = gaussian_filter(np.pad([[1.0]], 40), blur)
            z = z + CORRELATED * fine / float(np.sqrt(np.sum(alone**2)))
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


def measure(x: Array, y: Array, shape: str, noise: str, rng: np.random.Generator) -> Face:
    """Measure a noisy scan, with the noise told as ``noise`` says."""
    first = scan(x, y, shape, noise, rng)
    repeats: Noise | None = None
    sigma = None if noise.endswith("one scan") else WHITE
    if noise.startswith("correlated"):
        sigma = float(np.hypot(WHITE, CORRELATED))
    if noise.endswith("repeats"):
        repeats = repeat_noise([first, scan(x, y, shape, noise, rng)], 2.5 * MM)
    return measure_face(first, sigma, noise, repeats=repeats)


def coverage(
    shape: str, noise: str, points: int, draws: int, seed: int = 1
) -> dict[str, tuple[float, float, float, float]]:
    """Return index → share of draws whose interval holds the true value, half width, truth, mean error."""
    x, y = lattice(points)
    rng = np.random.default_rng(seed)
    true = measure_face(scan(x, y, shape, noise), uncertainty=False).indices
    faces = [measure(x, y, shape, noise, rng).indices for _ in range(draws)]
    found = {}
    for name in INDICES:
        value = true[name].value
        ends = np.array([(face[name].low, face[name].high) for face in faces])
        held = (ends[:, 0] <= value) & (value <= ends[:, 1])
        error = float(np.mean([face[name].corrected for face in faces])) - value
        found[name] = float(held.mean()), float(np.ptp(ends, axis=1).mean() / 2), value, error
    return found


def main(draws: int, sizes: list[int]) -> None:
    """Print coverage in per cent and mean half width in µm, a row for shape, noise and density."""
    print(f"| points | shape | noise | {' | '.join(INDICES)} |")
    print("| --- " * (3 + len(INDICES)) + "|")
    for points in sizes:
        for shape in SHAPES:
            for noise in NOISES:
                found = coverage(shape, noise, points, draws)
                cells = [f"{100 * share:.0f} ± {half / UM:.2g}" for share, half, *_ in found.values()]
                print(f"| {points} | {shape} | {noise} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, [int(s) for s in sys.argv[2:]] or list(DENSITIES))
