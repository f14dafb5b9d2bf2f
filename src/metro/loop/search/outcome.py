"""What the search for effects ends with: the fits, what was tried, and what the residual looks like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from metro.effects.effect import Effect
from metro.loop.checks import signature as residual
from metro.loop.checks.between import Between
from metro.loop.checks.evidence import missed, relieved
from metro.loop.checks.restless import Restless
from metro.loop.checks.session import Step
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.noise import Noise
from metro.loop.search.rivals import Rival
from metro.loop.search.trial import Trial
from metro.loop.statement import Statement


@dataclass(frozen=True)
class Outcome:
    """The outcome of the search, for the verdict and the report.

    ``base`` and ``final`` are fits of the identification runs; ``steps`` the fits after each addition;
    ``trials`` the last trial of each effect, ``weight`` the probability of each chosen effect against its
    rivals and against nothing; ``rivals`` effects that explain the residual as well as a chosen one;
    ``lines`` the signature of the residual, ``step`` that along the session, ``between`` that from condition
    to condition, ``restless`` that from run to run (of the base: ``base_between``, ``base_restless``);
    ``not_visible`` why effects cannot be seen, ``dim`` why others can only where they are large; ``seen``
    those that can, fitted to the batch; ``prior`` the noise before anything was known; ``likeness`` the fit
    with what the residual resembles and is no effect of the library (``final`` is without).
    """

    base: Fit
    final: Fit
    steps: tuple[Fit, ...]
    trials: tuple[Trial, ...]
    weight: Mapping[str, float]
    rivals: tuple[Rival, ...]
    base_lines: tuple[residual.Line, ...]
    lines: tuple[residual.Line, ...]
    seen: tuple[Effect, ...]
    prior: Noise
    step: Step | None = None
    base_between: Between | None = None
    between: Between | None = None
    base_restless: Restless | None = None
    restless: Restless | None = None
    offered: tuple[Effect, ...] = ()
    not_visible: Mapping[str, Statement | str] = field(default_factory=dict)
    dim: Mapping[str, Statement] = field(default_factory=dict)
    likeness: Fit | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the chosen effects, in the order of their addition."""
        return tuple(effect.name for effect in self.final.candidate.effects)

    @property
    def explained(self) -> float:
        """Share of the base model's significant residual, within and between runs, that effects explain.

        Differences between conditions or runs that only came to light as the effects took the rest away were
        there all the same: they are held neither for nor against these. So it is with places within the runs
        that a large misfit hid, as a vibration does whose phase is another in every run: what effects took of
        the misfit is explained, whether or not the base model showed it at any one place; and what base
        parameters had stood in for, against what is believed of them.
        """
        before, after = (residual.share_left(lines) ** 2 for lines in (self.base_lines, self.lines))
        taken = missed(self.base) ** 2 - missed(self.final) ** 2
        before = max(before, after + taken + relieved(self.base, self.final) ** 2)
        for base, final in ((self.base_between, self.between), (self.base_restless, self.restless)):
            shown = base.relative**2 if base else 0.0
            before += shown
            after += min(final.relative**2, shown) if final else 0.0
        return 1.0 - after / max(before, after) if after else 1.0

    def probability(self, name: str) -> float:
        """Return the probability that a chosen effect is the cause.

        Its weight against its rivals and against nothing; where a significant residual remains, the library
        lacks a cause, and what is missing may have lent the effect its part: the weight counts by the share
        explained.
        """
        return self.weight[name] * self.explained

    def some(self, name: str) -> float:
        """Return the probability that a chosen effect or one of its rivals is the cause."""
        titles = {effect.title for effect in self.final.candidate.effects if effect.name == name} | {name}
        others = sum(rival.weight for rival in self.rivals if rival.effect in titles)
        return min(1.0, self.weight[name] + others) * self.explained


def withdrawn(outcome: Outcome, why: Statement) -> Outcome:
    """Return an outcome without effects: a correction that is less likely than not is not applied."""
    return replace(
        outcome,
        final=outcome.base,
        steps=(),
        rivals=(),
        trials=tuple(
            replace(trial, why_not=why) if trial.effect.name in outcome.names else trial
            for trial in outcome.trials
        ),
        weight={},
        lines=outcome.base_lines or outcome.lines,  # what only the effect laid bare is there all the same
        between=outcome.base_between or outcome.between,
        restless=outcome.base_restless or outcome.restless,
    )
