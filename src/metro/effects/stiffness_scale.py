"""Stiffness in the cut that is not the stiffness of the load tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from metro.effects.effect import Effect, EffectParameter


def apply(model: Any, values: Mapping[str, float]) -> Any:
    """Multiply the stiffness that a model has in the cut by ``factor``; load tests are left as they are."""
    scaled = replace(model.structure, stiffness_factor=model.structure.stiffness_factor * values["factor"])
    return replace(model, structure=scaled)


EFFECT = Effect(
    name="stiffness_scale",
    observables=("deformation", "flatness"),
    parameters=(EffectParameter("factor", "1", 0.2, 5.0, 0.05, starts=(0.8, 1.2)),),
    apply=apply,
    signature=(
        "Deformation or deviation in proportion to the predicted one, over all runs and places. "
        "A force that is wrong by the same factor looks the same."
    ),
    literature="Abele et al., Prod. Eng. 1 (2007) 387: stiffness under process load against static tests",
    experiment=(
        "load tests at the force level of the cut, and a dynamometer in one cut to part force from stiffness"
    ),
)
