"""An effect of the contract's library that is made as it comes about, with what translates it back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import Hidden, Parameters
from virtual_cell.units import Array
from virtual_cell.world.arm.cause import During
from virtual_cell.world.arm.robot import Robot

Translated = tuple[Parameters, dict[str, float]]


@dataclass(frozen=True)
class Made(Hidden[Robot]):
    """An effect with its translation: the contract's parameters by what it did in the cuts, and their errors.

    ``translate(robot, cuts, parameters)``; errors are in the unit of their parameter. None: it is exact.
    """

    translate: Callable[[Robot, Sequence[During], Parameters], Translated] | None = None


def drawn_joint(rng: np.random.Generator, among: Sequence[int]) -> int:
    """Draw a joint, 1 … 6, among indices 0 … 5; of none, any."""
    some = list(among) or list(range(6))
    return some[int(rng.integers(len(some)))] + 1


def moving(robot: Robot) -> list[int]:
    """Joints (0 … 5) that move by a third of what the one that moves most does."""
    travel = robot.moves.travel
    return [joint for joint in range(6) if travel[joint] > 0.33 * max(travel)]


def leading(sizes: Array, among: Sequence[int] = range(6)) -> list[int]:
    """Joints among indices 0 … 5 in which a size is at least half of the largest of these."""
    largest = max(float(sizes[joint]) for joint in among)
    return [joint for joint in among if sizes[joint] >= 0.5 * largest]


def put(values: Array, joint: int, value: float | Array) -> Array:
    """Put a value at a joint, 1 … 6."""
    changed = np.array(values)
    changed[joint - 1] = value
    return changed
