"""What people do: cut repeats one after another, touch off badly, record too late, stop too early."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_signed, drawn_size
from virtual_cell.session import Condition, spread
from virtual_cell.units import MM, UM


@dataclass(frozen=True)
class Habits:
    """Habits of a session.

    Attributes
    ----------
    clumps : whether repeats are cut one after another. depth_off, width_off : by how much the tool cuts
        deeper and wider than is written down, m. again, again_from : what the depth is off after the tool was
        touched off again, m, and after what share of the session (1: it was not). by_run : deviation of a
        run's own, m.
    reached : share of the feed that is reached in short cuts. ramp_s : lag with which it comes up, s.
    no_air, stops_early : probabilities that a record begins in the cut, and that it ends before it should.
    """

    clumps: bool
    depth_off: float
    width_off: float
    again: float
    again_from: float
    by_run: float
    reached: float
    ramp_s: float
    no_air: float
    stops_early: float

    def depth(self, share: float) -> float:
        """By how much the tool cuts too deep after a share of the session, m."""
        return self.again if share >= self.again_from else self.depth_off


def drawn_habits(rng: np.random.Generator, *, clumped: float) -> Habits:
    """Draw habits; ``clumped``: probability that repeats come in clumps."""
    return Habits(
        clumps=bool(rng.uniform() < clumped),
        depth_off=drawn_signed(rng, 10.0, 100.0) * UM,
        width_off=drawn_signed(rng, 10.0, 100.0) * UM,
        again=drawn_signed(rng, 10.0, 100.0) * UM,
        again_from=float(rng.uniform(0.3, 0.8)) if rng.uniform() < 0.2 else 1.0,
        by_run=drawn_size(rng, 1.0, 4.0) * UM,
        reached=float(rng.uniform(0.93, 1.0)),
        ramp_s=drawn_size(rng, 0.008, 0.05),
        no_air=float(rng.choice([0.0, 0.05, 0.15, 1.0], p=[0.4, 0.25, 0.2, 0.15])),
        stops_early=float(rng.choice([0.0, 0.1], p=[0.6, 0.4])),
    )


SHORT = 45.0 * MM  # cuts in which the feed may not be reached


def order(
    plans: Sequence[Condition], habits: Habits, rng: np.random.Generator
) -> list[tuple[Condition, int]]:
    """Order of cutting: in clumps of one condition, or replicate after replicate in random order."""
    if not habits.clumps:
        return spread(plans, rng)
    return [
        (plans[i], replicate)
        for i in rng.permutation(len(plans))
        for replicate in range(1, plans[i].replicates + 1)
    ]
