"""What is believed of scanner, force and tip before a face is looked at: parameters and their errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from metro.observables.flatness.beside import Beside
from metro.observables.problem import Block, Parameter
from metro.units import UM

FORCE = "force_off"
LOSS, TUNED = "loss_off_", "ringing_off_"  # and the pose: damping ratio over the known one; frequencies
PLACE = ("place_height", "place_tilt_x", "place_tilt_y")  # tilts as the height at the edges of the work
FORM = ("form_xx", "form_xy", "form_yy")  # of the scanner: curvatures, as the height at the edges of the work

# Friction h against a motion of amplitude F/k loses 4 h F/k per cycle, as a damping ratio of 2 h / (π F) does
# (2 π ζ F²/k); and before it slips it is a spring, which makes the tip stiffer by up to h / F.
LOSS_OF_FRICTION = 2.0 / math.pi
LEAST_LOSS = 0.001  # as a damping ratio: blows tell it no better
# Of the tip's frequencies: the reduced mass is declared, and known to some 5 % (drawings, or a hammer).
FREQUENCY_SD = 0.025
FORCE_SD = 0.04  # of the force by the coefficients: those of another bar, and corners that are not sharp
PLACE_SD = 100 * UM  # of the declared place, in which all scans share an error: height, tilts at the edges
FORM_SD = 5 * UM  # of the scanner's form over the work: how straight its axes are, and its field is flat


@dataclass(frozen=True)
class BelievedSetting:
    """What is believed beforehand of a face's base parameters: evidence on these alone."""


@lru_cache(maxsize=16)
def parameters(
    *, placed: bool, beside: tuple[Beside, ...], ringing: tuple[str, ...]
) -> tuple[Parameter, ...]:
    """Return parameters of scanner, force, other modes and, by pose, of the tip's damping and frequencies."""
    place = [Parameter(name, "um", UM) for name in (*(PLACE if placed else ()), *FORM)]
    swings = [one for each in beside for one in each.parameters]
    lossy = [Parameter(f"{LOSS}{pose}", "%", 0.01) for pose in ringing]
    tuned = [Parameter(f"{TUNED}{pose}", "%", 0.01) for pose in ringing]
    return (*place, Parameter(FORCE, "%", 0.01), *swings, *lossy, *tuned)


@lru_cache(maxsize=16)
def places(believed: tuple[Parameter, ...]) -> dict[str, int]:
    """Return the place of each parameter by its name; it is kept, since a fit asks for it all the time."""
    return {one.name: place for place, one in enumerate(believed)}


def believed_block(believed: Sequence[Parameter], beside: Sequence[Beside], held: float) -> Block:
    """Return what is believed of parameters beforehand as evidence on them.

    ``held``: share of the force in a cut that may move the tip by less, or by more, than load tests say.
    """
    known = (
        dict.fromkeys(PLACE, PLACE_SD) | dict.fromkeys(FORM, FORM_SD) | {FORCE: math.hypot(FORCE_SD, held)}
    )
    swings = [said for each in beside for said in each.believed]
    known |= {one.name: sd for one, _, sd in swings}
    values = {one.name: value for one, value, _ in swings}
    tuned = math.hypot(FREQUENCY_SD, 0.5 * held)
    loss = math.hypot(LEAST_LOSS, LOSS_OF_FRICTION * held)
    known |= {one.name: loss for one in believed if one.name.startswith(LOSS)}
    sigma = np.array([known.get(one.name, tuned) for one in believed])
    measured = np.array([values.get(one.name, 0.0) for one in believed])
    names, zeros, none = [one.name for one in believed], np.zeros((len(sigma), 0)), np.zeros(0)
    return Block(
        *("believed", "believed", "calibrate", 0, measured, sigma, BelievedSetting()),
        *(np.array(names), zeros, none, {}),
        belief=True,
    )
