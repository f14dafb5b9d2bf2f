"""Recipes of batches that hide effects: of each observable, how a batch is made and what it can hide."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Protocol

from virtual_cell.arm_effects import ARM_EFFECTS, SHOWN
from virtual_cell.face_effects import FACE_EFFECTS
from virtual_cell.hidden import BOUNDARY_EFFECTS, EFFECTS, Parameters
from virtual_cell.recipes import arm, boundary, faces, force, force_world
from virtual_cell.world.arm.causes import ARM_CAUSES
from virtual_cell.world.arm.causes import SHOWN as WORLD_SHOWN
from virtual_cell.world.boundary.effects import HARDER_EFFECTS
from virtual_cell.world.faces.causes import FACE_CAUSES
from virtual_cell.write import Row

HARDER = ("c", "d")  # styles of the harder world
# The draws of styles a and b stay as they are when another effect can be simulated; style c draws it.
DRAWN = tuple(name for name in EFFECTS if name != "amplifier_filter")


@dataclass(frozen=True)
class Recipe:
    """``make(folder, hidden, seed, style)`` a batch that hides some of the ``effects``; return the truth.

    ``effects``: their parameters by their names, as :class:`virtual_cell.hidden.Hidden` has them; ``harder``:
    those of the harder world, where it hides others.
    """

    make: Callable[[Path, Mapping[str, Parameters | None], int, str], Row]
    effects: Mapping[str, str]
    harder: Mapping[str, str] = field(default_factory=dict)

    def hides(self, style: str) -> Mapping[str, str]:
        """Return what a batch of a style can hide, with its parameters."""
        return self.harder if style in HARDER and self.harder else self.effects


class Parametrised(Protocol):
    """What can be hidden: it names its parameters."""

    @property
    def parameters(self) -> str:
        """As :class:`virtual_cell.hidden.Hidden` has them."""
        ...


def _named(effects: Mapping[str, Parametrised], names: Iterable[str] = ()) -> dict[str, str]:
    """Return the parameters of some effects, or of all."""
    return {name: effects[name].parameters for name in names or effects}


RECIPES = {
    "force": Recipe(force.make, _named(EFFECTS, DRAWN), _named(force_world.HARDER)),
    **{
        observable: Recipe(
            partial(arm.make, about=observable),
            _named(ARM_EFFECTS, names),
            _named(ARM_CAUSES, WORLD_SHOWN[observable]),
        )
        for observable, names in SHOWN.items()
    },
    "flatness": Recipe(faces.make, _named(FACE_EFFECTS), _named(FACE_CAUSES)),
    "lobes": Recipe(boundary.make, _named(BOUNDARY_EFFECTS), _named(HARDER_EFFECTS)),
}
# What can be made: a batch of each observable, and a factorial study of faces.
KINDS = {**RECIPES, "study": Recipe(faces.make_study, _named(FACE_EFFECTS))}
