"""Entry-exit force: a force in proportion to the feed that does not vanish with the chip at its ends."""

from __future__ import annotations

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.force.terms import AlongArc


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Add a force of each tooth, K_tc × feed × cos²φ, along its path and towards the axis."""
    return model.with_term(AlongArc("ends", values["tangential"], values["radial"]))


EFFECT = Effect(
    name="entry_exit_force",
    observables=("force",),
    parameters=tuple(
        EffectParameter(name, "1", -1.5, 1.5, 0.05, starts=(0.1,)) for name in ("tangential", "radial")
    ),
    apply=apply,
    belongs_to=("tool", "work"),
    signature=(
        "A step of the force where a tooth enters and leaves, in proportion to the feed, though the chip is "
        "thin there: multiples of the tooth passing frequency that fall slowly with the order, in a slot in "
        "the feed and across it alike. Edge forces make such steps too, but the same at every feed."
    ),
    literature=(
        "none that we know: seen in slots cut with a two-tooth end mill (docs/models.md); its cause is open. "
        "Chips that jam between tooth and wall would make it"
    ),
    experiment=(
        "the same slot with an air blast or flood coolant, which clears the chips; cuts at half immersion, "
        "up and down, at two feeds"
    ),
    remedy="clear the chips from the slot by air or coolant, or declare this force under known in batch.yaml",
)
