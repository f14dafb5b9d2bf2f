"""Something that a batch of faces of the harder world may hide, and how its size is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import Parameters
from virtual_cell.recipes.faces_world_draws import Workshop
from virtual_cell.units import MM
from virtual_cell.world.draws import either_sign, log_uniform
from virtual_cell.world.finish import FaceRun

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


def towards(rng: np.random.Generator, names: str, low: float, high: float) -> Parameters:
    """Draw entries with a log-uniform size and any direction."""
    towards = rng.standard_normal(len(names.split()))
    entries = towards / np.linalg.norm(towards) * log_uniform(rng, low, high)
    return {name: float(f"{value:.3g}") for name, value in zip(names.split(), entries.tolist(), strict=True)}


def signed(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a log-uniform size of either sign."""
    return either_sign(rng) * log_uniform(rng, low, high)


def wave(rng: np.random.Generator, cell: Workshop, low: float, high: float) -> float:
    """Draw a frequency, Hz, whose waves on the face are ``low`` to ``high`` mm long."""
    return float(f"{cell.milling.speed / (log_uniform(rng, low, high) * MM):.4g}")
