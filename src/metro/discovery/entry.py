"""An entry of the grammar: a term that may be missing, with its parameters, in symbols and in words."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from metro.discovery.blueprint import Blueprint, Values, built
from metro.effects.effect import Effect, EffectParameter

LITERATURE = "none: proposed by metro from the residual of a batch, not yet explained by a person"


@dataclass(frozen=True)
class Entry:
    """A term that may be missing.

    Attributes
    ----------
    name : of the effect that it would be. plan : what makes the term. quantity : what it acts in, in words.
    variables : circumstances that it is a function of. form : of that function, in a word or two.
    sizes : the parameters in which the prediction is linear near zero. lengths : those inside a function,
        each with one start. formula, words : the term in symbols and as a sentence.
    """

    name: str
    plan: Blueprint
    quantity: str
    variables: tuple[str, ...]
    form: str
    sizes: tuple[EffectParameter, ...]
    lengths: tuple[EffectParameter, ...]
    formula: str
    words: str

    @property
    def family(self) -> tuple[str, tuple[str, ...]]:
        """What entries that differ by their form alone have in common."""
        return self.plan.kind.__name__, self.variables

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """All parameters, sizes first."""
        return self.sizes + self.lengths

    def applied(self, model: Any, values: Values) -> Any:
        """Return a model with the term."""
        return model.with_term(built(self.plan, values))

    def near_zero(self, place: int) -> Values:
        """Return values of which one size is a small step, the other sizes are zero."""
        values = {one.name: 0.0 for one in self.sizes} | {one.name: one.starts[0] for one in self.lengths}
        return values | {self.sizes[place].name: STEP * self.sizes[place].scale}

    def effect(self, sizes: tuple[float, ...], sought: float) -> Effect:
        """Return the effect that is fitted from these sizes, found among ``sought`` entries."""
        started = tuple(
            replace(one, starts=(min(max(size, one.lower), one.upper),))
            for one, size in zip(self.sizes, sizes, strict=True)
        )

        def apply(model: Any, values: Values) -> Any:
            return self.applied(model, values)

        return Effect(
            name=self.name,
            observables=("force",),
            parameters=started + self.lengths,
            apply=apply,
            signature=self.words,
            literature=LITERATURE,
            experiment="",
            sought=sought,
        )


STEP = 1e-2  # of a size's scale, by which a derivative is taken
