"""A force cell while it is being made: effects are built into it one after another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from virtual_cell.session import Plan
from virtual_cell.world.force.cell import Cell


@dataclass(frozen=True)
class Making:
    """A cell that is being made, the plans that it will cut, and what draws the details of its effects."""

    cell: Cell
    plans: tuple[Plan, ...]
    rng: np.random.Generator

    def with_(self, **changes: Any) -> Making:
        """Return it with changes of the cell."""
        return replace(self, cell=replace(self.cell, **changes))
