"""Modes of the arm that swing beside those of M and K: what each of them gives to the heights of a face."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from metro.observables.flatness.dynamics import ArmMode
from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.ringing import Ringing
from metro.observables.problem import Parameter
from metro.units import Array

# Of a mode beside those of M and K: its sign across z is not known; its reach is that where it was struck.
SIGN_SD, REACH_SD = 1.0, 0.2
# Of the compliance, what follows a force at once where nothing was struck: a fifth, at two standard
# deviations, lies outside of the joints (Schneider et al. 2014).
AT_ONCE_SD = 0.1


@dataclass(frozen=True)
class Beside:
    """The modes that impacts at a pose show and that M and K do not have, or what follows at once instead."""

    pose: str
    modes: tuple[ArmMode, ...]

    @cached_property
    def believed(self) -> tuple[tuple[Parameter, float, float], ...]:
        """Parameters with their values and standard deviations before a face is looked at.

        Of each mode that blows show, the reach along each axis that shows it times that along z, over what
        blows say. Those across z are 1 or −1, since blows along one axis at a time do not show a sign, or
        between them where the mode turns over the face. Where no blow was made, the share of the compliance
        that follows a force along each axis at once.
        """
        said: list[tuple[Parameter, float, float]] = []
        for number, mode in enumerate(self.modes, start=1):
            at_once = math.isinf(mode.frequency)
            for axis, reach in zip("xyz", mode.reach, strict=True):
                if reach and at_once:
                    said.append((Parameter(f"at_once_{axis}_{self.pose}", "%", 0.01), 0.0, AT_ONCE_SD))
                elif reach:
                    one = Parameter(f"swing_{number}_{axis}_{self.pose}", "1")
                    said.append((one, 1.0, REACH_SD) if axis == "z" else (one, 0.0, SIGN_SD))
        return tuple(said)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters alone."""
        return tuple(one for one, _, _ in self.believed)


@lru_cache(maxsize=64)
def swung(modes: tuple[ArmMode, ...], setting: FaceSetting) -> Array:
    """Return the height (n, k, parameters), m, that each parameter of :class:`Beside` gives to passages."""
    ringing = setting.ringing
    assert ringing is not None
    heights = [
        ringing.at(swing, setting.middle).T
        for mode in modes
        for swing, reach in zip(_swings(ringing, mode), mode.reach, strict=True)
        if reach
    ]
    return np.stack(heights).T


@lru_cache(maxsize=256)
def _swings(ringing: Ringing, mode: ArmMode) -> Array:
    """Keep what a mode does: repeats of a cut have the same forces."""
    return ringing.swung(mode)
