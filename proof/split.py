"""Is the split of an error right? What came with the predicted force, as stated and as it truly was.

The simulator gives the true mean force of a run, and by how much more of it moves the wall or the face. What
the predicted force adds to the error is that much of its distance from the true one. The stated part uses
only the force that the dynamometer reads: it can be close to the part by that reading, and can only state how
far the true part may be from there.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from metro.observables.cut.upstream import mean_forces
from metro.units import JSON, Array
from proof.statistics import NORMAL, Demand, Figure, median, share

WHEN = "after"
CLOSE, HELD = Demand(most=0.1), Demand(0.9)


@dataclass(frozen=True)
class Fed:
    """A held-out run whose force was measured: rms error (mm), and how much of it came with the force.

    ``stated`` by the chain of prediction, with the standard deviation ``doubt``; by the simulator, ``true``,
    and ``read`` if the force that the dynamometer reads were the true one; mm.
    """

    observable: str
    run: str
    total: float
    stated: float
    true: float
    read: float
    doubt: float

    @property
    def held(self) -> bool:
        """Whether the true part is within the 95 % interval of the stated one."""
        return abs(self.stated - self.true) <= NORMAL * self.doubt

    def off(self, other: float) -> float:
        """By how much the stated part differs from another one, in parts of the whole error."""
        return abs(self.stated - other) / self.total


def fed(processed: Path, truth: JSON) -> tuple[Fed, ...]:
    """Return the held-out runs of a batch whose error was split.

    Parameters
    ----------
    truth : by run its ``force_n`` (3,) and ``mm_per_n`` (3,), work frame.
    """
    chain: JSON = json.loads((processed / "loop.json").read_text())["chain"]
    forces = mean_forces(pd.read_parquet(processed / "comparison.parquet"))
    return tuple(
        Fed(
            observable,
            part["run"],
            part["total"],
            part["upstream"],
            came(truth[part["run"]]["mm_per_n"], truth[part["run"]]["force_n"], forces[part["run"]][WHEN]),
            came(truth[part["run"]]["mm_per_n"], forces[part["run"]]["measured"], forces[part["run"]][WHEN]),
            part["doubt"],
        )
        for observable, split in chain.items()
        for part in split["runs"]
        if part["when"] == WHEN
    )


def came(mm_per_n: Sequence[float], force: ArrayLike, predicted: Array) -> float:
    """Return what a predicted mean force (3,), N, adds to the error where the force is another one, mm."""
    return abs(float(np.array(mm_per_n) @ (np.asarray(force) - predicted)))


def split_figures(parts: Sequence[Fed]) -> list[Figure]:
    """Return how far the stated parts are from those that were read and from the true ones, by observable."""
    figures = []
    for name in sorted({one.observable for one in parts}):
        those = [one for one in parts if one.observable == name]
        read, true = [one.off(one.read) for one in those], [one.off(one.true) for one in those]
        words = f"{name}: stated part of the force less"
        figures += [
            median(f"{words} that of the force that is read, in parts of the error", read, CLOSE, "%"),
            median(f"{words} the true one, in parts of the error", true, unit="%"),
        ]
    held = [one.held for one in parts]
    return [*figures, share("part of the force: its interval holds the true one", held, HELD)]
