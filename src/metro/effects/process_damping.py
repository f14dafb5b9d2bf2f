"""Process damping: the flank of a worn or slow tooth rubs on the waves that it cuts, and damps them."""

from __future__ import annotations

from dataclasses import replace

from metro.dynamics.stability_model import StabilityModel
from metro.effects.effect import Effect, EffectParameter, Values
from metro.units import N_MM


def apply(model: StabilityModel, values: Values) -> StabilityModel:
    """Add a radial force ``-C a v_n / v_c`` on every tooth that cuts, ``C`` being ``coefficient_n_mm``.

    ``v_n`` is the speed of the tooth into the work, ``v_c`` that of the cut. The force is in proportion to
    the depth like that of the chip.
    """
    damping = values["coefficient_n_mm"] * N_MM / model.radius
    return replace(model, cuts=tuple(replace(cut, damping=cut.damping + damping) for cut in model.cuts))


EFFECT = Effect(
    name="process_damping",
    observables=("lobes",),
    parameters=(EffectParameter("coefficient_n_mm", "N/mm", 5.0, 5000.0, 50.0, starts=(50.0, 500.0)),),
    apply=apply,
    belongs_to=("tool", "work"),
    signature=(
        "Cuts stay stable above the predicted boundary, increasingly so at low spindle speed; nothing "
        "changes at high speed. Modes that soften with speed have a similar signature."
    ),
    literature=(
        "Altintas, Eynian and Onozuka, CIRP Ann. 57 (2008) 371; Budak and Tunc, CIRP Ann. 59 (2010) 407"
    ),
    experiment="tests at a third of the lowest speed, above the boundary that is predicted there",
    remedy="count on the deeper cuts at low speed only with edges as worn as these",
)
