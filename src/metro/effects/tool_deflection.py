"""Tool deflection: the tool bends under the force of the cut, so that it cuts beside its programmed path."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.units import N_UM


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Put a spring of ``kx_n_um``, ``ky_n_um`` along work x and y in series with what yields already."""
    x, y = model.structure.compliance
    compliance = (x + 1.0 / (values["kx_n_um"] * N_UM), y + 1.0 / (values["ky_n_um"] * N_UM))
    return replace(model, structure=replace(model.structure, compliance=compliance))


def _stiffness(name: str) -> EffectParameter:
    return EffectParameter(name, "N/um", 0.8, 200.0, 1.0, starts=(6.0,), neutral=200.0, reciprocal=True)


EFFECT = Effect(
    name="tool_deflection",
    observables=("force",),
    parameters=(_stiffness("kx_n_um"), _stiffness("ky_n_um")),
    apply=apply,
    belongs_to=("tool",),
    slow=True,
    signature=(
        "What runout and pitch errors make of the force is smaller than their chips would make it, at every "
        "feed; side cuts change as the tool is pushed away from the free edge or pulled over it. A slot with "
        "a good tool hardly shows it."
    ),
    literature=(
        "Sutherland and DeVor, J. Eng. Ind. 108 (1986) 269: force and deflection balanced through the chip; "
        "here over a steady revolution, against all earlier passes"
    ),
    experiment=(
        "side cuts both ways at the largest depth and feed, along x and along y; "
        "or push the tool's tip with a load cell and a dial gauge"
    ),
    remedy="clamp the tool shorter or take a stiffer one; otherwise lower the radial depth or the feed",
)
