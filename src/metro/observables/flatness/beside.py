"""Modes of the arm that swing beside those of M and K: what each of them gives to the heights of a face."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from metro.observables.flatness.dynamics import ArmMode
from metro.observables.problem import Parameter
from metro.units import Array

if TYPE_CHECKING:
    from metro.observables.flatness.model import FaceSetting
    from metro.observables.flatness.ringing import Ringing


@dataclass(frozen=True)
class Beside:
    """The modes that impacts at a pose show and that M and K do not have."""

    pose: str
    modes: tuple[ArmMode, ...]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Of each mode, the reach along each axis that shows it times that along z, over what blows say.

        Those across z are 1 or −1, since blows along one axis at a time do not show a sign, or between them
        where the mode turns over the face.
        """
        return tuple(
            Parameter(f"swing_{number}_{axis}_{self.pose}", "1")
            for number, mode in enumerate(self.modes, start=1)
            for axis, reach in zip("xyz", mode.reach, strict=True)
            if reach
        )


@lru_cache(maxsize=64)
def swung(modes: tuple[ArmMode, ...], setting: FaceSetting) -> Array:
    """Return the height (n, k, parameters), m, that each parameter of :class:`Beside` gives to passages."""
    ringing = setting.ringing
    assert ringing is not None
    heights = [
        ringing.at(swing, setting.middle)
        for mode in modes
        for swing, reach in zip(_swings(ringing, mode), mode.reach, strict=True)
        if reach
    ]
    return np.stack(heights, axis=-1)


@lru_cache(maxsize=256)
def _swings(ringing: Ringing, mode: ArmMode) -> Array:
    """Keep what a mode does: repeats of a cut have the same forces."""
    return ringing.swung(mode)
