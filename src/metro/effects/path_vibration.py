"""Path vibration: the tip swings at a frequency of its own while it travels."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.effects.periodogram import peaks
from metro.observables.problem import Problem, Refusal
from metro.observables.waviness_model import Vibration
from metro.units import DEG, UM, Array

LEAST_CYCLES, LEAST_POINTS = (
    2.0,
    4.0,
)  # that the shortest run must show; that a cycle of the fastest must hold
STEPS = 3.0  # per width of a line: the longest run's reciprocal
MOST = 4  # lines that are followed


def apply(model: Any, values: Values) -> Any:
    """Let the tip swing along the wall's normal; time starts with the log of each cut."""
    swing = Vibration(values["frequency_hz"], values["amplitude_um"] * UM, values["phase_deg"] * DEG)
    return replace(model, vibration=swing)


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Start from the strongest lines in time of what the base model leaves."""
    times = [block.setting.t for block in problem.role("identify")]
    if not times:
        return Refusal("no run is there to find its frequency in")
    frequencies = _resolved(times)
    if not len(frequencies):
        return Refusal("the cuts are too short to hold two cycles of anything")
    found, size = peaks(problem, _unit, frequencies, MOST)
    frequency, amplitude, phase = effect.parameters
    step = float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else frequency.scale
    start = max(float(np.median(size)) / UM, amplitude.scale)
    return replace(
        effect,
        parameters=(
            replace(
                frequency,
                lower=float(frequencies[0]) / 2,
                upper=2 * float(frequencies[-1]),
                scale=step,
                starts=tuple(found.tolist()),
            ),
            replace(amplitude, starts=(start,)),
            phase,
        ),
    )


def _resolved(times: list[Array]) -> Array:
    """Frequencies that the runs resolve, Hz."""
    spans = np.array([t[-1] - t[0] for t in times])
    low = LEAST_CYCLES / spans.min()
    high = max(len(t) / LEAST_POINTS / span for t, span in zip(times, spans, strict=True))
    return np.asarray(np.arange(low, high, 1.0 / (STEPS * spans.max())))


def _unit(model: Any, frequency: float, quarter: float) -> Any:
    return replace(model, vibration=Vibration(frequency, 1.0, quarter * math.pi / 2))


EFFECT = Effect(
    name="path_vibration",
    observables=("waviness",),  # flatness shows it too, but its model has no part for it
    parameters=(
        EffectParameter("frequency_hz", "Hz", 0.1, 500.0, 0.05, starts=(5.0,)),
        EffectParameter("amplitude_um", "um", 0.0, 500.0, 0.5, starts=(2.0,)),
        EffectParameter("phase_deg", "deg", 0.0, 360.0, 20.0, starts=(0.0, 120.0, 240.0), period=360.0),
    ),
    apply=apply,
    part="vibration",
    adapt=adapt,
    signature=(
        "Waves on the wall of one frequency in time, so that their length goes with the feed; the encoders "
        "do not show them, or only in part. Waves of one length at every feed are of a gear, or of the work."
    ),
    literature="Schneider et al., Prod. Eng. 8 (2014) 59: structural modes of industrial robots in milling",
    experiment="the same cut at two feeds that differ by a third, with an accelerometer on the spindle",
)
