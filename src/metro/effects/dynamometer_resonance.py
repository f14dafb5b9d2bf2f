"""Dynamometer resonance: the sensor and the work on it vibrate when the teeth excite them."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.dynamometer import Resonance
from metro.observables.force.model import ForceModel

CHANNELS = 3
LOWEST, RIGID = 100.0, 20000.0  # Hz
STARTS = tuple(round(250.0 * 1.09**i, 1) for i in range(31))


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Put one more resonance of one degree of freedom on each channel of the sensor, in series."""
    resonance = Resonance(tuple(values["frequency_hz"]), tuple(values["damping"]))
    resonances = (*model.sensor.resonances, resonance)
    return replace(model, sensor=replace(model.sensor, resonances=resonances))


def _channel(number: int) -> tuple[EffectParameter, EffectParameter]:
    # Nothing is damped by less than next to nothing. A resonance that is damped by more than the upper bound
    # magnifies by less than 2.5: what rolls off without magnifying is a filter, not a sensor that rings. Far
    # below its frequency a resonance magnifies and delays a little, as much else does: only where its damping
    # is determined do the records reach so far that they show it.
    damping = EffectParameter("damping", "1", 0.002, 0.2, 0.01, starts=(0.04,), group=number, neutral=0.04)
    return (
        EffectParameter(
            "frequency_hz",
            "Hz",
            LOWEST,
            RIGID,
            30.0,
            starts=STARTS,
            group=number,
            neutral=RIGID,
            reciprocal=True,
        ),
        replace(damping, nothing_below=True, decisive=True),
    )


EFFECT = Effect(
    name="dynamometer_resonance",
    observables=("force",),
    parameters=tuple(parameter for number in range(CHANNELS) for parameter in _channel(number)),
    apply=apply,
    belongs_to=("instrument",),
    per="axis",
    signature=(
        "High orders magnified around one frequency, whatever the order that falls there: it stays where it "
        "is when the spindle speed changes. Per channel of the sensor."
    ),
    literature="Castro, Viéville and Lipinski, Int. J. Mach. Tools Manuf. 46 (2006) 1707",
    experiment="a hammer test on the dynamometer with the work on it; slots at speeds that differ by a fifth",
    remedy=(
        "choose speeds at which no harmonic of the tooth passing is near this "
        "frequency, or mount the dynamometer more stiffly"
    ),
)
