"""Something that a batch of faces of the harder world may hide, and how its size is drawn."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import Parameters, drawn_size
from virtual_cell.recipes.faces_world_draws import Workshop
from virtual_cell.units import MM, UM
from virtual_cell.world.faces.finish import FaceRun

Applied = tuple[Workshop, float]


@dataclass(frozen=True)
class Hideable:
    """Something to hide.

    ``parameters`` as :class:`virtual_cell.hidden.Hidden` names them. ``draw(rng, cell)`` draws them.
    ``apply(cell, session, values, rng)`` returns the cell that hides it and the error of the translation.
    """

    parameters: str
    draw: Callable[[np.random.Generator, Workshop], Parameters]
    apply: Callable[[Workshop, list[FaceRun], Parameters, np.random.Generator], Applied]


def seen_noise(cell: Workshop) -> float:
    """Return about how far measured and predicted faces of a batch differ if nothing is hidden, um.

    That is the noise of the mean over a disc, and where a place is declared the error of that place, both
    as a fit that knows the causes leaves them on held-out faces.
    """
    scanner = cell.scanner
    placed = scanner.shift if scanner.place == "declared" else 0.0
    return _over_disc(math.hypot(scanner.sigma, placed)) / UM


def disc_noise(cell: Workshop) -> float:
    """Return the noise of the mean over a disc, m."""
    return _over_disc(cell.scanner.sigma)


def _over_disc(noise: float) -> float:
    return 0.45 * noise


def sized(rng: np.random.Generator, cell: Workshop, shown: float, most: float) -> float:
    """Draw a size of 0.9 to 12 times the noise of a batch, but at most what is realistic.

    ``shown``: micrometres (rms over a face) that one unit changes in faces, once all else is fitted again.
    """
    return min(float(f"{drawn_size(rng, 0.9, 12.0) * seen_noise(cell) / shown:.3g}"), most)


def towards(rng: np.random.Generator, names: str, size: float) -> Parameters:
    """Draw entries of a size and any direction."""
    entries = rng.standard_normal(len(names.split()))
    entries *= size / float(np.linalg.norm(entries))
    return {name: float(f"{value:.3g}") for name, value in zip(names.split(), entries.tolist(), strict=True)}


def wave(rng: np.random.Generator, cell: Workshop, low: float, high: float) -> float:
    """Draw a frequency, Hz, whose waves on the face are ``low`` to ``high`` mm long."""
    return float(f"{cell.milling.speed / (drawn_size(rng, low, high) * MM):.4g}")
