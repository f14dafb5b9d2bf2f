"""What is believed of scanner, force and tip before a face is looked at: parameters and their errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.observables.flatness.beside import Beside
from metro.observables.problem import Block, Parameter
from metro.units import UM

FORCE = "force_off"
PLACE = ("place_height", "place_tilt_x", "place_tilt_y")  # tilts as the height at the edges of the work
FORM = ("form_xx", "form_xy", "form_yy")  # of the scanner: curvatures, as the height at the edges of the work

# Of the tip's frequencies: the reduced mass is declared, and known to some 5 % (drawings, or a hammer).
FREQUENCY_SD = 0.025
FORCE_SD = 0.04  # of the force by the coefficients: those of another bar, and corners that are not sharp
PLACE_SD = 100 * UM  # of the declared place, in which all scans share an error: height, tilts at the edges
FORM_SD = 5 * UM  # of the scanner's form over the work: how straight its axes are, and its field is flat
# Of a mode beside those of M and K: its sign across z is not known; its reach is that where it was struck.
SIGN_SD, REACH_SD = 1.0, 0.2


@dataclass(frozen=True)
class BelievedSetting:
    """What is believed beforehand of a face's base parameters: evidence on these alone."""


def parameters(*, placed: bool, beside: Sequence[Beside], ringing: Sequence[str]) -> tuple[Parameter, ...]:
    """Return parameters of scanner, force, the tip's other modes and, by pose, of its frequencies."""
    place = [Parameter(name, "um", UM) for name in (*(PLACE if placed else ()), *FORM)]
    swings = [one for each in beside for one in each.parameters]
    tuned = [Parameter(f"ringing_off_{pose}", "%", 0.01) for pose in ringing]
    return (*place, Parameter(FORCE, "%", 0.01), *swings, *tuned)


def believed_block(believed: Sequence[Parameter], beside: Sequence[Beside], held: float) -> Block:
    """Return what is believed of parameters beforehand as evidence on them.

    ``held``: share of the force in a cut that may move the tip by less, or by more, than load tests say.
    """
    known = (
        dict.fromkeys(PLACE, PLACE_SD) | dict.fromkeys(FORM, FORM_SD) | {FORCE: math.hypot(FORCE_SD, held)}
    )
    swings = [one.name for each in beside for one in each.parameters]
    along = {name: name.split("_")[2] == "z" for name in swings}
    known |= {name: REACH_SD if of_z else SIGN_SD for name, of_z in along.items()}
    sigma = np.array([known.get(one.name, FREQUENCY_SD) for one in believed])
    measured = np.array([float(along.get(one.name, False)) for one in believed])
    names, zeros, none = [one.name for one in believed], np.zeros((len(sigma), 0)), np.zeros(0)
    return Block(
        *("believed", "believed", "calibrate", 0, measured, sigma, BelievedSetting()),
        *(np.array(names), zeros, none, {}),
        belief=True,
    )
