"""Values of single joints of an arm of any number: as many entries as needed, the rest as ``none``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from metro.units import Array


def of_joints(values: Sequence[float], count: int, none: float = 0.0) -> Array:
    """Return the values of ``count`` joints, (n,); those beyond the last entry are ``none``."""
    return np.array([*values[:count], *[none] * (count - len(values))], dtype=float)


def raised(values: Sequence[float], joint: int, by: float) -> tuple[float, ...]:
    """Return values with more at one joint, from 0."""
    whole = of_joints(values, max(len(values), joint + 1))
    whole[joint] += by
    return tuple(whole.tolist())


def put(values: Sequence[float], joint: int, value: float, none: float = 0.0) -> tuple[float, ...]:
    """Return values with another one at one joint, from 0; those of joints that had none are ``none``."""
    whole = [*values, *[none] * (joint + 1 - len(values))]
    whole[joint] = value
    return tuple(whole)


def scaled(values: Sequence[float], joint: int, by: float) -> tuple[float, ...]:
    """Return factors of joints with that of one joint, from 0, times ``by``."""
    whole = of_joints(values, max(len(values), joint + 1), 1.0)
    whole[joint] *= by
    return tuple(whole.tolist())
