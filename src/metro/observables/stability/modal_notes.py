"""What the modes of a test leave in doubt, in words: not resolved, moved between files, no driving point."""

from __future__ import annotations

import math
from collections.abc import Iterator

from metro.dynamics.driving import Standing
from metro.dynamics.modal import ModalModel
from metro.dynamics.modes import Mode
from metro.observables.stability.receptance import Receptance
from metro.units import N_UM

# Of the half width of a resonance: a shift by a hundredth of it changes the response by 1 % at most.
_WORTH_SAYING = 0.01
_BY_CHANCE = 1e-3  # of a test of fifty modes that do not move, one in twenty has such a note


def doubts(model: ModalModel) -> Iterator[str]:
    """Say which modes the data do not resolve, with their intervals."""
    for mode in model.modes:
        if not mode.resolved:
            yield f"the mode at {_in_words(mode)}, is not resolved"
    if model.doubtful is not None:
        yield f"a further mode at {_in_words(model.doubtful)}, is not resolved and was left out"


def of_files(model: ModalModel) -> Iterator[str]:
    """Say which modes differ between the files by more than the files' own errors, if that is worth it."""
    shifts = [
        f"{mode.frequency:.5g} Hz by {mode.frequency * moved.frequency.scatter:.2g} Hz "
        f"(damping by {100.0 * moved.damping.scatter:.2g} %, {moved.frequency.files} files)"
        for mode, moved in zip(model.modes, model.moved, strict=True)
        if moved is not None
        and moved.frequency.chance < _BY_CHANCE
        and moved.frequency.scatter > _WORTH_SAYING * mode.damping
    ]
    if shifts:
        yield (
            "the modes differ between the files by more than the noise of a file, as standard deviation: "
            f"{'; '.join(shifts)}. Their intervals contain it. The hammer's place, the mass of a sensor that "
            "is moved, or the temperature shift modes; to know which, repeat one place at the end of a test"
        )


def of_point(group: list[Receptance], model: ModalModel) -> Iterator[str]:
    """Say why a declared driving point is none, and what to do."""
    for column, standing in model.declared.items():
        point = group[column].reference
        if standing is Standing.REVERSED:
            yield (
                f"{point} to {point} has the wrong sign in all its modes: the sensor or the hammer points "
                "the other way, so that it gives no stiffness. Turn the sign of its channel (scale: -1 under "
                "files in batch.yaml)"
            )
        elif standing is Standing.ELSEWHERE:
            yield (
                f"{point} to {point} is no driving point: its modes have residues of both signs, and where a "
                "structure is hit all have one. Sensor and hammer were at different places, so that it gives "
                "no stiffness. Correct reference or response in impacts.csv, or hit where the sensor is"
            )


def _in_words(mode: Mode) -> str:
    known = [f"{_with_interval(mode.frequency, mode.frequency_sd)} Hz"]
    known.append(f"damping {_with_interval(100 * mode.damping, 100 * mode.damping_sd)} %")
    if math.isfinite(mode.stiffness):
        stiffness = _with_interval(mode.stiffness / N_UM, mode.stiffness_sd / N_UM)
        known.append(f"stiffness {stiffness} N/µm")
    return ", ".join(known)


def _with_interval(value: float, sd: float) -> str:
    """Write a value and half its 95 % interval, both to two digits of the latter, as the report does."""
    half = 1.96 * sd
    place = 1 - math.floor(math.log10(float(f"{half:.1e}"))) if 0 < half < math.inf else 3
    return " ± ".join(f"{round(number, place):.{max(0, place)}f}" for number in (value, half))
