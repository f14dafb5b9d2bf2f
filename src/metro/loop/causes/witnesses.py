"""What several observables of a batch say of one cause: each one's evidence, and whether they agree.

An observable is a witness of a cause if its model has the part that the cause changes and its runs can show
it. Each is asked by itself: its evidence is what the cause gains there on top of what else explains it there.
Near their optima the likelihoods are parabolas of the shared parameters, so that those of one fit for all
follow from each one's estimate and covariance: they are the mean weighted by precision, and the joint fit
gains what the witnesses gain by themselves less what it costs them to agree (twice the logarithm: the
chi-squared of their differences).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.effects.effect import Effect
from metro.loop.checks.evidence import Evidence, change, compare, hold_out, leave_out, tail
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit, refit
from metro.loop.fitting.system import inverse, moved_models, solution
from metro.loop.search.outcome import Outcome
from metro.loop.search.trial import OF_THE_RESIDUAL, Gates, without
from metro.observables.problem import Problem
from metro.units import Array

Key = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Closed:
    """An observable whose loop is closed: its problem, and the outcome of its search."""

    problem: Problem
    outcome: Outcome


@dataclass(frozen=True, eq=False)
class Witness:
    """What one observable says of a cause.

    Attributes
    ----------
    names_it : whether its own verdict names the cause.
    smaller, larger : fits without the cause and with it. evidence : the larger one's over the smaller one.
    value, covariance : of the s shared parameters, (s,) and (s, s), in the units of the contract; an infinite
        variance where it determines nothing.
    places : (s,) of the shared parameters in ``larger.theta``.
    doubt : (s,) standard deviations by the error that all of its runs may share.
    least : smallest relative change of the prediction that counts there.
    """

    closed: Closed
    effect: Effect
    names_it: bool
    smaller: Fit
    larger: Fit
    evidence: Evidence
    value: Array
    covariance: Array
    places: np.ndarray
    doubt: Array
    least: float

    @property
    def observable(self) -> str:
        """Name of the observable."""
        return self.closed.problem.observable

    @property
    def statistic(self) -> float:
        """Twice the gain in log-likelihood."""
        return max(0.0, self.evidence.statistic)

    def held_out(self) -> Witness:
        """Return the witness with its gains on conditions that are left out of the fit."""
        prior = self.closed.outcome.prior
        evidence = hold_out(self.evidence, leave_out(self.smaller, prior), self.larger, prior)
        return replace(self, evidence=evidence)

    def at(self, fitted: Fit, value: Array) -> Fit:
        """Return a fit of the candidate with the shared parameters (s,) given, its base fitted anew."""
        theta = fitted.theta.copy()
        theta[self.places] = value
        given = Candidate(fitted.candidate.model(theta))
        base = len(fitted.beta)
        covariance = fitted.covariance[:base, :base]
        start = replace(fitted, candidate=given, theta=np.zeros(0), covariance=covariance)
        return refit(start, fitted.blocks, self.closed.outcome.prior)

    def sharing(self, others: Sequence[Witness]) -> Witness:
        """Return the witness with size and held-out gains of the parameters that it shares with others.

        A condition that is left out is predicted with what its other conditions and the others say.
        """

        def together(fitted: Fit) -> Array:
            own = replace(
                self, larger=fitted, value=fitted.theta[self.places], covariance=self.errors(fitted)
            )
            every = (own, *others)
            return agreement(_unwound(every), [one.covariance for one in every]).value

        def moved(fitted: Fit) -> Fit:
            return self.at(fitted, together(fitted))

        prior = self.closed.outcome.prior
        before, after = leave_out(self.smaller, prior), leave_out(self.larger, prior, moved)
        gains = {name: after[name] - value for name, value in before.items()}
        size = change(self.smaller, moved(self.larger))
        return replace(self, evidence=replace(self.evidence, size=size, held_out=gains))

    def errors(self, fitted: Fit) -> Array:
        """Covariance of the shared parameters by a fit, (s, s)."""
        places = len(fitted.beta) + self.places
        wider = fitted.wider[self.places]
        covariance = fitted.covariance[np.ix_(places, places)] * np.outer(wider, wider)
        return np.asarray(covariance * fitted.dispersion)


@dataclass(frozen=True, eq=False)
class Agreement:
    """Estimates of the same s parameters, put together.

    ``value`` (s,) and ``covariance`` (s, s) of their mean weighted by precision; ``chi2`` of their distances
    from it, with so many ``freedom``.
    """

    value: Array
    covariance: Array
    chi2: float
    freedom: int


@dataclass(frozen=True, eq=False)
class Cause:
    """A cause that several observables can show, and what they say of it.

    Attributes
    ----------
    statistic, p_value : twice the gain in log-likelihood of one fit for all, and its p-value.
    together : the shared parameters, the systematic errors of the observables allowed for.
    differ : p-value of the differences of the estimates.
    runs : how many runs, each once, however many observables it shows.
    """

    key: Key
    witnesses: tuple[Witness, ...]
    statistic: float
    p_value: float
    together: Agreement
    differ: float
    runs: int


def key_of(effect: Effect) -> Key:
    """Return what a cause is, whatever its model is called in an observable: its name and its joint."""
    return effect.name, str(effect.where.get("joint", "all"))


def shared(effect: Effect) -> list[int]:
    """Places of the parameters that are the same quantity wherever the effect shows."""
    return [i for i, parameter in enumerate(effect.parameters) if not parameter.local]


def offered(closed: Closed, key: Key) -> Effect | None:
    """Return the effect by which an observable would show a cause, the one chosen first; None: it cannot."""
    able = [*closed.outcome.final.candidate.effects, *closed.outcome.seen]
    return next((e for e in able if key_of(e) == key and not e.resembled), None)


def ask(closed: Closed, key: Key, start: Witness | None = None) -> Witness | None:
    """Ask an observable about a cause; None where it cannot show it.

    ``start``: the witness who named it. It is then looked for where that one saw it, and nowhere else.
    """
    effect, outcome = offered(closed, key), closed.outcome
    if effect is None:
        return None
    others = tuple(e for e in outcome.final.candidate.effects if e.name != effect.name)
    alone = len(others) == len(outcome.final.candidate.effects)
    smaller = outcome.final if alone else without(outcome.base, others, outcome.prior)
    names_it = effect.key in {e.key for e in outcome.final.candidate.effects}
    if names_it:
        larger = outcome.final
    else:
        effect = _there(effect, start) if start else effect
        candidate = Candidate(closed.problem.base, (*others, effect))
        larger = fit(candidate, smaller.blocks, outcome.prior, smaller)
    return _witness(closed, effect, smaller, larger, names_it=names_it)


def _there(effect: Effect, start: Witness) -> Effect:
    """Return an effect that is looked for at the shared parameters of another observable alone."""
    names = [start.effect.parameters[i].name for i in shared(start.effect)]
    seen = dict(zip(names, start.value.tolist(), strict=True))
    parameters = [
        replace(p, starts=(seen[p.name],)) if p.name in seen and not p.local else p for p in effect.parameters
    ]
    return replace(effect, parameters=tuple(parameters), sought=1.0)


def _witness(closed: Closed, effect: Effect, smaller: Fit, larger: Fit, *, names_it: bool) -> Witness:
    first = next(part.start for each, part in larger.candidate.parts(larger.theta) if each.key == effect.key)
    places = np.array([first + i for i in shared(effect)])
    witness = Witness(
        closed=closed,
        effect=effect,
        names_it=names_it,
        smaller=smaller,
        larger=larger,
        evidence=compare(smaller, larger),
        value=larger.theta[places],
        covariance=np.zeros((len(places), len(places))),
        places=places,
        doubt=_doubt(closed.problem, larger, places),
        least=2.0 * closed.problem.systematic,
    )
    return replace(witness, covariance=witness.errors(larger))


def _doubt(problem: Problem, fitted: Fit, places: np.ndarray) -> Array:
    """How far parameters would be off if the prediction were by the error that all runs may share, (s,)."""
    blocks = [block for block in fitted.blocks if block.role != "calibrate"]
    signal = sum(float(np.sum(block.measured**2)) for block in blocks)
    moved = moved_models(fitted.candidate, fitted.theta)
    doubt = np.zeros(len(places))
    for k, place in enumerate(places):
        model, step = moved[place]
        change = 0.0
        for block in blocks:
            matrix, offset = model.design(block, fitted.nuisance[block.run], fitted.beta)
            change += float(np.sum((offset + matrix @ fitted.beta - fitted.predict(block)) ** 2))
        slope = np.sqrt(change / signal) / abs(step)
        doubt[k] = problem.systematic / slope if slope > 0.0 else 0.0
    return doubt


def agreement(values: Sequence[Array], covariances: Sequence[Array]) -> Agreement:
    """Put estimates of the same parameters together: generalised least squares, (s,) and (s, s) each."""
    weights = [_precision(covariance) for covariance in covariances]
    total = np.sum(weights, axis=0)
    right = np.sum([weight @ value for weight, value in zip(weights, values, strict=True)], axis=0)
    mean = solution(total, right)
    away = [value - mean for value in values]
    chi2 = sum(float(d @ weight @ d) for d, weight in zip(away, weights, strict=True))
    determined = [int(np.isfinite(np.diag(covariance)).sum()) for covariance in covariances]
    freedom = sum(determined) - int((np.diag(total) > 0.0).sum())
    return Agreement(mean, inverse(total), chi2, freedom)


def denial(witness: Witness, first: Witness) -> float:
    """P-value of what an observable says, were the cause as large there as where another one saw it first.

    It is small where the observable would show that and does not, and one where it determines nothing.
    """
    seen, own = _unwound([first, witness])
    weight = _precision(witness.covariance + np.diag(witness.doubt**2))
    determined = int((np.diag(weight) > 0.0).sum())
    runs = sum(block.role != "calibrate" for block in witness.larger.blocks)
    away = own - seen
    return tail(float(away @ weight @ away), determined, runs) if determined else 1.0


def _precision(covariance: Array) -> Array:
    """Invert a covariance; what has an infinite variance has no weight."""
    known = np.isfinite(np.diag(covariance)) & (np.diag(covariance) > 0.0)
    weight = np.zeros_like(covariance)
    part = covariance[np.ix_(known, known)]
    deviation = np.sqrt(np.diag(part))
    scale = np.outer(deviation, deviation)
    weight[np.ix_(known, known)] = np.linalg.pinv(part / scale, hermitian=True) / scale
    return weight


def weighed(key: Key, witnesses: Sequence[Witness]) -> Cause:
    """Add up what witnesses say of a cause, and test whether they agree."""
    values = _unwound(witnesses)
    covariances = [witness.covariance for witness in witnesses]
    plain = agreement(values, covariances)
    wide = [c + np.diag(w.doubt**2) for c, w in zip(covariances, witnesses, strict=True)]
    together = agreement(values, wide)
    runs = {block.run for w in witnesses for block in w.larger.blocks if block.role != "calibrate"}
    statistic = max(0.0, sum(witness.statistic for witness in witnesses) - plain.chi2)
    common = len(shared(witnesses[0].effect))
    parameters = common + sum(len(w.effect.parameters) - common for w in witnesses)
    differ = tail(together.chi2, together.freedom, len(runs)) if together.freedom > 0 else 1.0
    p_value = tail(statistic, parameters, len(runs))
    return Cause(key, tuple(witnesses), statistic, p_value, together, differ, len(runs))


def _unwound(witnesses: Sequence[Witness]) -> list[Array]:
    """Return the shared values, angles within half a period of the first witness's."""
    first, effect = witnesses[0].value, witnesses[0].effect
    periods = [effect.parameters[i].period for i in shared(effect)]
    values = [witness.value.copy() for witness in witnesses]
    for k, period in enumerate(periods):
        for value in values:
            value[k] -= period * np.round((value[k] - first[k]) / period) if period else 0.0
    return values


def material(witness: Witness, gates: Gates) -> bool:
    """Whether a cause changes an observable by enough to matter, and is not small beside what stays."""
    evidence = witness.evidence
    return evidence.size >= max(gates.materiality, witness.least, OF_THE_RESIDUAL * evidence.missed)
