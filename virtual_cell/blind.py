"""Recipes of batches that hide effects: of each observable, how a batch is made and what it can hide."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from virtual_cell.arm_effects import SHOWN
from virtual_cell.face_effects import FACE_EFFECTS
from virtual_cell.hidden import BOUNDARY_EFFECTS, EFFECTS, Parameters
from virtual_cell.recipes import arm, boundary, faces, force
from virtual_cell.write import Row


@dataclass(frozen=True)
class Recipe:
    """``make(folder, hidden, seed, style)`` a batch that hides some of the ``effects``; return the truth."""

    make: Callable[[Path, Mapping[str, Parameters | None], int, str], Row]
    effects: tuple[str, ...]


RECIPES = {
    "force": Recipe(force.make, tuple(EFFECTS)),
    "lobes": Recipe(boundary.make, tuple(BOUNDARY_EFFECTS)),
    "flatness": Recipe(faces.make, tuple(FACE_EFFECTS)),
    **{observable: Recipe(arm.make, effects) for observable, effects in SHOWN.items()},
}
