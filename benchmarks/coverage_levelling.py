"""How often the 95 % intervals of flatness by slopes hold the true index, by shape, zeros and noise.

A union jack of 10 × 6 × 12 steps over 1.0 × 0.6 m; each reading has noise of 1 µrad, each line a zero.
Run: ``python benchmarks/coverage_levelling.py [draws]``, which prints a table.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from metro.surface.level_indices import level_indices
from metro.surface.slopes import Levelled, Readings, level
from metro.units import UM, URAD, Array

LENGTH, WIDTH = 1.0, 0.6
COUNTS = (12, 12, 10, 6, 10, 6, 10, 6)  # steps of the diagonals, the sides, and the two centre lines
W, H = LENGTH, WIDTH
ENDS = (
    *(((0, H), (W, 0)), ((W, H), (0, 0)), ((W, H), (0, H)), ((W, H), (W, 0)), ((W, 0), (0, 0))),
    *(((0, H), (0, 0)), ((W, H / 2), (0, H / 2)), ((W / 2, H), (W / 2, 0))),
)
NOISE = 1 * URAD
INDICES = ("minimum_zone", "fltt", "fltp", "fltv", "fltq")
SHAPES: dict[str, Callable[[Array, Array], Array]] = {
    "dome": lambda u, v: -3 * UM * (u**2 + v**2),
    "saddle": lambda u, v: 3 * UM * u * v,
    "waves": lambda u, v: 1 * UM * np.cos(6 * u) * np.cos(5 * v),
    "0.4 µm": lambda u, v: -0.2 * UM * (u**2 + v**2),
    "flat": lambda u, v: 0.0 * u * v,
}
# Name → whether each line has a zero of its own, and whether the noise is declared.
KINDS = {
    "autocollimator, declared": (True, True),
    "level, declared": (False, True),
    "level, by its loops": (False, False),
    "autocollimator, by its loops": (True, False),
}


def jack(*, own_zeros: bool) -> Readings:
    """Return the feet of a union jack, slopes of zero."""
    lines = [np.linspace(*ends, count + 1) for ends, count in zip(ENDS, COUNTS, strict=True)]
    first, second = np.vstack([each[:-1] for each in lines]), np.vstack([each[1:] for each in lines])
    return Readings(first, second, np.zeros(len(first)), np.repeat(np.arange(8) * own_zeros, COUNTS))


def heights(found: Levelled, shape: str) -> Array:
    """Return the heights of a shape at the stations, off their plane."""
    u, v = 2.0 * (found.places / (LENGTH, WIDTH)).T - 1.0
    z = SHAPES[shape](u, v)
    base = np.linalg.qr(np.column_stack([np.ones(len(z)), found.places]))[0]
    return np.asarray(z - base @ (base.T @ z))


def row(kind: str, shape: str, draws: int) -> list[str]:
    """Return per index the share of intervals that hold the truth and their mean half width, µm."""
    own_zeros, declared = KINDS[kind]
    readings = jack(own_zeros=own_zeros)
    still = level(readings)
    truth = replace(still, heights=heights(still, shape))
    step = np.linalg.norm(readings.second - readings.first, axis=1)
    slope = (truth.heights[still.second] - truth.heights[still.first]) / step
    true = level_indices(truth, np.nan, np.inf)
    held, width = dict.fromkeys(INDICES, 0), dict.fromkeys(INDICES, 0.0)
    for seed in range(draws):
        random = np.random.default_rng(seed)
        zeros = 100 * URAD * random.standard_normal(8)[readings.line]
        read = replace(readings, slope=slope + zeros + NOISE * random.standard_normal(len(slope)))
        found = level(read)
        sigma, dof = (NOISE, np.inf) if declared else (found.scatter, found.dof)
        for name, index in level_indices(found, sigma, dof).items():
            held[name] += index.low - 1e-12 <= true[name].value <= index.high + 1e-12
            width[name] += (index.high - index.low) / 2 / UM / draws
    return [f"{100 * held[name] / draws:.0f} ± {width[name]:.2f}" for name in INDICES]


def main() -> None:
    """Print the table."""
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    print("| readings | shape | minimum zone | FLTt | FLTp | FLTv | FLTq |\n|" + " --- |" * 7)
    for kind in KINDS:
        for shape in SHAPES:
            print("|", " | ".join([kind, shape, *row(kind, shape, draws)]), "|", flush=True)


if __name__ == "__main__":
    main()
