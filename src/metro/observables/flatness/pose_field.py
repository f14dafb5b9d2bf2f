"""The compliance of the arm at a pose, whose coefficients are parameters, and the load tests that show it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from metro.surface.tip_stiffness import Basis, Rows
from metro.units import Array


@dataclass(frozen=True, eq=False)
class PoseField:
    """The z row of the tip compliance over the face at one pose; ``entries`` (3,): those that loads show."""

    pose: str
    basis: Basis
    entries: tuple[bool, ...]

    @property
    def used(self) -> np.ndarray:
        """Mask of the coefficients (3 · terms) that are parameters of the model."""
        return np.repeat(self.entries, self.basis.terms)


@dataclass(frozen=True, eq=False)
class LoadSetting:
    """The static load tests of one pose."""

    pose: str
    rows: Rows


def own_columns(part: PoseField, pose: str, columns: Array) -> Array:
    """Return those ``columns``, (n, 3 · terms) of a face at ``pose``, that are parameters; else zeros."""
    count = int(part.used.sum())
    return columns[:, part.used] if part.pose == pose else np.zeros((len(columns), count))


@lru_cache(maxsize=16)
def loaded_columns(fields: tuple[PoseField, ...], setting: LoadSetting) -> Array:
    """Return the matrix of load tests, which no effect of a cut changes."""
    rows = {part.pose: setting.rows.design(part.basis) for part in fields if part.pose == setting.pose}
    none = np.zeros((len(setting.rows.displacement), 0))
    return np.hstack([own_columns(part, setting.pose, rows.get(part.pose, none)) for part in fields])
