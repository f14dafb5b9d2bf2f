"""Mode coupling: the modes do not vibrate along the directions in which the structure was hit."""

from __future__ import annotations

from dataclasses import replace

from metro.dynamics.stability_model import StabilityModel
from metro.effects.effect import Effect, EffectParameter, Values
from metro.units import DEG


def apply(model: StabilityModel, values: Values) -> StabilityModel:
    """Turn all modes by ``angle_deg``: those of x towards y, and those of y likewise."""
    return replace(model, structure=model.structure.turned(values["angle_deg"] * DEG))


EFFECT = Effect(
    name="mode_coupling",
    observables=("lobes",),
    parameters=(
        EffectParameter(
            "angle_deg",
            "deg",
            -90.0,
            90.0,
            10.0,
            starts=(-30.0, 30.0),
            period=180.0,
            plausible=25.0,
        ),
    ),
    apply=apply,
    signature=(
        "The boundary moves up or down as a whole, by another factor for up than for down milling. A slot "
        "with many teeth, which pushes alike in all directions, does not show it."
    ),
    literature="Pan et al., J. Mater. Process. Technol. 173 (2006) 301: mode coupling of a milling robot",
    experiment="impact tests with the cross receptances xy; tests of up and of down milling at one speed",
    remedy="measure the cross receptances xy, and predict stability with them",
)
