"""Dynamometer resonance: the sensor with the work on it swings where the teeth excite it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from metro.effects.effect import Effect, EffectParameter, Values

CHANNELS = 3
LOWEST, RIGID = 100.0, 20000.0  # Hz
STARTS = tuple(round(250.0 * 1.09**i, 1) for i in range(31))


def apply(model: Any, values: Values) -> Any:
    """Put a resonance of one degree of freedom on each channel of the sensor."""
    sensor = replace(model.sensor, frequency=tuple(values["frequency_hz"]), damping=tuple(values["damping"]))
    return replace(model, sensor=sensor)


def _channel(number: int) -> tuple[EffectParameter, EffectParameter]:
    return (
        EffectParameter(
            "frequency_hz", "Hz", LOWEST, RIGID, 30.0, starts=STARTS, group=number, neutral=RIGID
        ),
        EffectParameter("damping", "1", 0.002, 0.7, 0.01, starts=(0.04,), group=number, neutral=0.04),
    )


EFFECT = Effect(
    name="dynamometer_resonance",
    observables=("force",),
    parameters=tuple(parameter for number in range(CHANNELS) for parameter in _channel(number)),
    apply=apply,
    signature=(
        "High orders magnified around one frequency, whatever the order that falls there: it stays where it "
        "is when the spindle speed changes. Per channel of the sensor."
    ),
    literature="Castro, Viéville and Lipinski, Int. J. Mach. Tools Manuf. 46 (2006) 1707",
    experiment="a hammer test on the dynamometer with the work on it; slots at speeds that differ by a fifth",
)
