"""The search where the measurement is a label: which effects the boundary lacks, if any.

The hypotheses are nothing, each effect of the library, causes that it lacks (likenesses, and whatever else,
:mod:`metro.loop.labels.unknown`), and, where an effect is likely and the tests can bear it, that effect with
each other, and the best of these others with the remaining ones. The identification tests weigh them; the
validation tests are not read here.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from metro.effects.effect import Effect, fitted_to
from metro.loop.labels.evidence import Errors, Labels, drawn_errors, left_out, unstable_probability
from metro.loop.labels.hypotheses import Hypothesis, LabelEvidence, hypothesis, pursued
from metro.loop.labels.problem import tests_of
from metro.loop.labels.unknown import unknown
from metro.loop.search.rivals import RIVAL_WEIGHT
from metro.loop.search.trial import Gates
from metro.loop.statement import Statement
from metro.observables.labelled import Labelled
from metro.units import JSON, Array

LEAST_TESTS, LEAST_SPEEDS = 6, 3  # fewer decide nothing
PAIR_TESTS, PAIR_SPEEDS = 16, 5  # fewer cannot bear two effects at once
PRIOR_NOTHING, PRIOR_PAIRS = 0.5, 0.1  # probabilities before any test: of no effect, of all pairs together
PRIOR_LACKING = 0.08  # of each cause that the library lacks, times its own prior
SURE = 1.0 - RIVAL_WEIGHT  # probability from which an effect is believed: no rival has a weight that counts
FIRST = 3  # sets of parameters after which a hypothesis is weighed for the first time
LIKELY = RIVAL_WEIGHT / 10.0  # probability then from which it is pursued: it may yet come to count
WORTH = 0.25  # of the likeliest hypothesis: below it, effects that are sure are not enough by themselves
MATERIAL = 0.05  # least change of a predicted probability, rms over the tests
DEVIATIONS = 128  # errors of the base model that are drawn
NOTHING = "nothing"


@dataclass(frozen=True)
class Weighed:
    """A hypothesis with its posterior probability, gain at left-out speeds over nothing, and size.

    ``size``: rms change of the predicted probabilities of the tests; ``rejected``: why it is not believed.
    """

    hypothesis: Hypothesis
    probability: float
    gain: float = 0.0
    size: float = 0.0
    rejected: Statement | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its effects."""
        return self.hypothesis.names

    @property
    def lacking(self) -> bool:
        """Whether it is a cause that the library lacks."""
        return any(effect.resembled for effect in self.hypothesis.effects)


@dataclass(frozen=True)
class LabelOutcome:
    """The outcome of the search.

    Attributes
    ----------
    weighed : all hypotheses, nothing first. evidence : that they were weighed by.
    lead : the one that is believed, or would be first; None where nothing is all that is needed.
    not_visible : why effects cannot be seen in this batch.
    """

    weighed: tuple[Weighed, ...]
    evidence: LabelEvidence
    lead: Weighed | None = None
    not_visible: Mapping[str, Statement | str] = field(default_factory=dict)

    @property
    def base_boundary(self) -> tuple[Array, Array]:
        """Speeds of all points, and the base model's log depth there, (p,) each."""
        return self.evidence.tests.rpm, self.evidence.testable(self.weighed[0].hypothesis.depth[0])

    def probability(self, name: str) -> float:
        """Probability that an effect acts, or that nothing does."""
        if name == NOTHING:
            return self.weighed[0].probability
        return float(sum(one.probability for one in self.weighed if name in one.names))

    @property
    def rivals(self) -> tuple[str, ...]:
        """Names of what may be in the place of the lead, the likeliest first."""
        if self.lead is None:
            return ()
        others = {name for one in self.weighed for name in one.names} - set(self.lead.names)
        open_names = [name for name in (*others, NOTHING) if self._without_lead(name) > RIVAL_WEIGHT]
        return tuple(sorted(open_names, key=lambda name: -self._without_lead(name)))

    @property
    def lacking(self) -> tuple[Weighed, ...]:
        """Causes that the library lacks, the likeliest first."""
        causes = [one for one in self.weighed if one.lacking]
        return tuple(sorted(causes, key=lambda one: -one.probability))

    @property
    def elsewhere(self) -> bool:
        """Whether something is missing, as it seems, and it is none of the library's effects."""
        nothing = self.weighed[0].probability
        lacking = sum(one.probability for one in self.lacking)
        return nothing < PRIOR_NOTHING and lacking > SURE * (1.0 - nothing)

    @property
    def unsettled(self) -> bool:
        """Whether nothing is missing, or something that is none of the library's effects."""
        return self.elsewhere and self.weighed[0].probability > RIVAL_WEIGHT

    @property
    def doubtful(self) -> bool:
        """Whether a cause that the library lacks may be in the place of the lead."""
        lacking = {name for one in self.lacking for name in one.names}
        return self.unsettled or bool(lacking & set(self.rivals))

    def _without_lead(self, name: str) -> float:
        lead = set(self.lead.names) if self.lead else set()
        mine = [one for one in self.weighed if not lead <= set(one.names)]
        return sum(one.probability for one in mine if name in (one.names or (NOTHING,)))


def enough(tests: Labels) -> bool:
    """Whether tests can be evidence of effects."""
    return len(tests.depth) >= LEAST_TESTS and len(tests.speeds) >= LEAST_SPEEDS


def search_labels(problem: Labelled, library: Sequence[Effect], gates: Gates) -> LabelOutcome:
    """Weigh nothing, each effect, and pairs, by the identification tests."""
    effects, unable = fitted_to(tuple(library), problem)
    tests, _ = tests_of(problem, "identify")
    errors = drawn_errors(tests, problem.deviations(DEVIATIONS, gates.seed), gates.seed)
    evidence = LabelEvidence(problem.boundaries, problem.estimates, tests, errors, gates.seed)
    nothing = hypothesis((), evidence)
    singles = [hypothesis((effect,), evidence, rounds=FIRST) for effect in effects if not effect.resembled]
    lacking = [hypothesis((effect,), evidence, rounds=FIRST) for effect in effects if effect.resembled]
    lacking.append(unknown(nothing, evidence))
    hidden: dict[str, Statement | str] = {
        one.names[0]: Statement("hidden_in_labels", {"least": MATERIAL})
        for one in singles
        if _largest(one, nothing, evidence) < MATERIAL
    }
    seen = [one for one in singles if one.names[0] not in hidden]
    weighed = _likely_pursued([nothing, *seen], [], lacking)
    if _worth_pairs(weighed, tests):
        singles = [one.hypothesis for one in weighed[: 1 + len(seen)]]
        lacking = [one.hypothesis for one in weighed[1 + len(seen) :]]
        first = max(weighed[1 : 1 + len(seen)], key=lambda one: one.probability).hypothesis
        others = [one for one in singles[1:] if one is not first]
        joined = [hypothesis(first.effects + two.effects, evidence, first, FIRST) for two in others]
        best = max(joined, key=lambda one: one.log_evidence)
        if best.log_evidence > first.log_evidence:  # the other of the two may have led instead
            (second,) = (one for one in others if one.effects == best.effects[1:])
            remaining = [one for one in others if one is not second]
            beside = replace(best, effects=second.effects, cube=best.cube[:, first.cube.shape[1] :])
            joined += [hypothesis(second.effects + two.effects, evidence, beside, FIRST) for two in remaining]
        weighed = _likely_pursued(singles, joined, lacking)
    judged = tuple(_judged(one, nothing, evidence, gates) for one in weighed)
    outcome = LabelOutcome(judged, evidence, None, unable | hidden)
    return replace(outcome, lead=_lead(outcome))


def _worth_pairs(weighed: list[Weighed], tests: Labels) -> bool:
    many = len(tests.depth) >= PAIR_TESTS and len(tests.speeds) >= PAIR_SPEEDS
    effects = sum(not one.lacking for one in weighed[1:])
    return many and effects > 1 and weighed[0].probability < PRIOR_NOTHING


def _likely_pursued(
    singles: Sequence[Hypothesis], pairs: Sequence[Hypothesis], lacking: Sequence[Hypothesis]
) -> list[Weighed]:
    """Posterior probabilities once those that may come to count have been pursued to their ends."""
    every, parts = [*singles, *pairs, *lacking], (len(singles), len(singles) + len(pairs))
    while True:
        weighed = _probabilities(every[: parts[0]], every[parts[0] : parts[1]], every[parts[1] :])
        ended = [pursued(one.hypothesis) if one.probability > LIKELY else one.hypothesis for one in weighed]
        if all(new is old for new, old in zip(ended, every, strict=True)):
            return weighed
        every = ended


def _probabilities(
    singles: Sequence[Hypothesis], pairs: Sequence[Hypothesis], lacking: Sequence[Hypothesis]
) -> list[Weighed]:
    """Posterior probabilities; ``singles`` has nothing first, what the library is ``lacking`` comes last."""
    others = [PRIOR_LACKING * effect.prior for one in lacking for effect in one.effects]
    left = 1.0 - PRIOR_NOTHING - sum(others) - (PRIOR_PAIRS if pairs else 0.0)
    prior = [PRIOR_NOTHING, *[left / max(1, len(singles) - 1)] * (len(singles) - 1)]
    prior += [*[PRIOR_PAIRS / max(1, len(pairs))] * len(pairs), *others]
    every = [*singles, *pairs, *lacking]
    log = np.log(prior) + [one.log_evidence for one in every]
    weight = np.exp(log - log.max())
    return [Weighed(one, float(w)) for one, w in zip(every, weight / weight.sum(), strict=True)]


def predicted(chosen: Hypothesis, tests: Labels, errors: Errors) -> Array:
    """Probability (n,) that tests are unstable, over the parameters that the hypothesis is left with."""
    return np.asarray(chosen.weights @ _by_parameters(chosen, tests, errors))


def _by_parameters(chosen: Hypothesis, tests: Labels, errors: Errors) -> Array:
    boundary = chosen.depth[:, None, tests.point] + errors.deviations[None, :, tests.point]
    chance = unstable_probability(tests, boundary, errors.own_sd[:, None])
    return np.asarray(np.einsum("tsn,s->tn", chance, chosen.of_errors(errors)))


def _largest(single: Hypothesis, nothing: Hypothesis, evidence: LabelEvidence) -> float:
    """Largest change of the probability of a test, which nine in ten of the parameters do not exceed."""
    tests, errors = evidence.tests, evidence.errors
    change = _by_parameters(single, tests, errors) - _by_parameters(nothing, tests, errors)
    return float(np.quantile(np.abs(change).max(axis=1), 0.9))


def _judged(one: Weighed, nothing: Hypothesis, evidence: LabelEvidence, gates: Gates) -> Weighed:
    """Put a hypothesis before the gates: probability against nothing, speeds left out, size."""
    if not one.names:
        return one
    mine, tests = one.hypothesis, evidence.tests
    gain = left_out(mine.likelihood, mine.prior) - left_out(nothing.likelihood, nothing.prior)
    change = predicted(mine, tests, evidence.errors) - predicted(nothing, tests, evidence.errors)
    size = float(np.sqrt(np.mean(change**2)))
    odds = (1.0 - PRIOR_NOTHING) / PRIOR_NOTHING * np.exp(mine.log_evidence - nothing.log_evidence)
    against = odds / (1.0 + odds)
    total, why = float(gain.sum()), None
    if against < SURE:
        why = Statement("improbable", {"probability": float(against), "needed": SURE})
    elif total < gates.held_out_gain:
        why = Statement("no_gain_at_speeds", {"gain": total, "needed": gates.held_out_gain})
    elif size < MATERIAL:
        why = Statement("immaterial_for_labels", {"size": size, "least": MATERIAL})
    return replace(one, gain=total, size=size, rejected=why)


def _lead(outcome: LabelOutcome) -> Weighed | None:
    """Return the effects that are sure, or the likeliest where the tests speak against nothing."""
    nothing = outcome.weighed[0]
    others = [one for one in outcome.weighed[1:] if not one.lacking]
    names = {name for one in others for name in one.names}
    sure = {name for name in names if outcome.probability(name) > SURE}
    heaviest = max((one.probability for one in others), default=0.0)
    exactly = [one for one in others if set(one.names) == sure and one.probability > WORTH * heaviest]
    if exactly:
        return exactly[0]
    if nothing.probability >= PRIOR_NOTHING or outcome.elsewhere:
        return None
    return max(others, key=lambda one: one.probability, default=None)


def pairs(outcome: LabelOutcome) -> list[list[str]]:
    """Return what the tests cannot distinguish: the foremost effects, each with each rival."""
    lead = outcome.lead.names if outcome.lead else ()
    if outcome.unsettled:
        return [[outcome.lacking[0].names[0], NOTHING]]
    return [list(pair) for pair in itertools.product(lead[-1:], outcome.rivals)]


def tried(outcome: LabelOutcome) -> list[JSON]:
    """Entries of the candidates: every hypothesis of one effect, and pairs under the name of the second."""
    return [
        {
            "effect": " + ".join(one.names),
            "probability": one.probability,
            "held_out_gain": one.gain,
            "size": one.size,
            "why_not": one.rejected or _beaten(one, outcome) or "",
        }
        for one in outcome.weighed[1:]
    ]


def _beaten(one: Weighed, outcome: LabelOutcome) -> Statement | None:
    """Return that the lead explains the tests better than a hypothesis that is no rival of it, if it does."""
    lead = outcome.lead
    if lead is None or lead.rejected or one is lead or set(one.names) & set(outcome.rivals):
        return None
    return Statement("beaten")
