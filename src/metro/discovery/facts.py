"""What the runs of a batch vary, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.effects.varying import values_of, varies
from metro.observables.force.shapes import CIRCUMSTANCES
from metro.observables.problem import Block, Model
from metro.units import Array

PLACES = (0.2, 0.4, 0.6, 0.8)  # shares of the runs after which a step may come


@dataclass(frozen=True, eq=False)
class Fact:
    """Values of a circumstance, in its unit: (blocks,) of all records, and the mean of each run."""

    values: Array
    by_run: Array

    @property
    def middle(self) -> float:
        """Three digits of the mean: a reference that a person can read."""
        return rounded(float(self.by_run.mean()))

    @property
    def span(self) -> float:
        """Range of the values."""
        return float(np.ptp(self.values))

    def places(self, *, within: bool) -> list[float]:
        """Return places between runs at which a step may be; or ``within`` records, between their blocks."""
        levels = np.unique(self.values if within else self.by_run)
        gaps = 0.5 * (levels[:-1] + levels[1:])
        return sorted({rounded(float(gaps[int(share * (len(gaps) - 1))])) for share in PLACES})


def facts_of(model: Model, blocks: Sequence[Block]) -> dict[str, Fact]:
    """Return what varies over runs, or within them, by the name of the circumstance."""
    each = {name: values_of(name, model, blocks) for name in CIRCUMSTANCES}
    return {
        name: Fact(np.concatenate(records), np.array([record.mean() for record in records]))
        for name, records in each.items()
        if varies(name, records)
    }


def rounded(value: float) -> float:
    """Return a number with three digits."""
    return float(f"{value:.3g}")
