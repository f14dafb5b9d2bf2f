"""Shapes that a face's residual is tested for: from pass to pass, along the passes, over the work, spots."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from metro.units import MM, Array

MODES = 4  # cosines along a pass
SPOT = 10 * MM  # radius at which a bump falls to 1/e^½
MOST_SPOTS = 60


def patterns(x: Array, y: Array, number: np.ndarray, along: Array) -> dict[str, Array]:
    """Return shapes (n, k) by their names in the report.

    Parameters
    ----------
    x, y : (n,) places, m. number : (n,) of the pass along which they lie, from one. along : (n,) position
        along the feed, m.
    """
    return dict([*_of_passes(number), *_along(along), *_over(x, y), *_spots(x, y)])


def _of_passes(number: np.ndarray) -> Iterator[tuple[str, Array]]:
    passes = np.unique(number)
    if len(passes) < 3:
        return
    rank = _to_unit(number.astype(float))
    yield "grows with the pass number", rank[:, None]
    yield "grows with the pass number, along a bent line", np.column_stack([rank**2, rank**3])
    for one in passes[1:-1]:
        yield f"pass {one} differs from the others", (number == one).astype(float)[:, None]
    for one in passes[2:-1]:
        yield f"steps at pass {one}", (number >= one).astype(float)[:, None]
    yield "differs from pass to pass", (number[:, None] == passes).astype(float)


def _along(along: Array) -> Iterator[tuple[str, Array]]:
    place = 0.5 * (_to_unit(along) + 1.0)
    waves = np.cos(math.pi * place[:, None] * np.arange(1, MODES + 1))
    for half, wave in enumerate(waves.T, start=1):
        yield f"goes along every pass like {half} half wave{'s' * (half > 1)} of a cosine", wave[:, None]


def _over(x: Array, y: Array) -> Iterator[tuple[str, Array]]:
    u, v = _to_unit(x), _to_unit(y)
    named = {"bows along x": u**2, "twists": u * v, "bows along y": v**2}
    named |= {"is cubic along x": u**3 - 0.6 * u, "is cubic along y": v**3 - 0.6 * v}
    for name, shape in named.items():
        yield name, shape[:, None]


def _spots(x: Array, y: Array) -> Iterator[tuple[str, Array]]:
    """Bumps two radii apart over the face, or further apart if these would be too many."""
    extent = [float(np.ptp(x)), float(np.ptp(y))]
    apart = max(2 * SPOT, math.sqrt(extent[0] * extent[1] / MOST_SPOTS))
    grids = [np.arange(c.min() + apart / 2, c.max(), apart) for c in (x, y)]
    for at_x in grids[0]:
        for at_y in grids[1]:
            bump = np.exp(-0.5 * ((x - at_x) ** 2 + (y - at_y) ** 2) / (apart / 2) ** 2)
            yield f"bulges at x {at_x / MM:.0f} mm, y {at_y / MM:.0f} mm", bump[:, None]


def _to_unit(values: Array) -> Array:
    """Scale values to −1 … 1."""
    return np.asarray(2.0 * (values - values.min()) / (np.ptp(values) or 1.0) - 1.0)
