"""What the runs of a batch vary: an effect that depends on what is constant over them cannot be shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from metro.effects.effect import Effect
from metro.observables.force.shapes import CIRCUMSTANCES
from metro.observables.problem import Block, Problem, Refusal
from metro.units import Array

VARIES = 1e-2  # relative range that is more than how true settings scatter about the stated ones


def values_of(name: str, model: Any, blocks: Iterable[Block]) -> list[Array]:
    """Return the values of a circumstance of the cut in each record, (blocks,) or (1,), in its unit."""
    known = CIRCUMSTANCES[name]
    return [
        np.atleast_1d(np.asarray(known.of(model, block.setting), dtype=float)) / known.si for block in blocks
    ]


def varies(name: str, records: list[Array]) -> bool:
    """Whether a circumstance differs by more than its scatter: between runs, or within records."""
    values = records if CIRCUMSTANCES[name].within else [record.mean(keepdims=True) for record in records]
    together = np.concatenate(values)
    return bool(np.ptp(together) > VARIES * np.abs(together).max())


def varying(*names: str) -> Callable[[Effect, Problem], Effect | Refusal]:
    """Return the ``adapt`` of an effect of the force that needs these circumstances to differ."""

    def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
        for name in names:
            if not varies(name, values_of(name, problem.base, problem.role("identify"))):
                return Refusal(f"all runs have nearly the same {CIRCUMSTANCES[name].words}")
        return effect

    return adapt
