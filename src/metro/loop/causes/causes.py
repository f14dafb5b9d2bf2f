"""The causes of a batch: which, seen in which observables, how sure, and where observables contradict.

A cause that one observable named is put to all others that could show it. One that none of them could name by
itself is named where the evidence of all together passes the gates that an effect passes in one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from metro.loop.causes.witnesses import Cause, Closed, Key, ask, denial, key_of, material, weighed
from metro.loop.checks.evidence import Evidence, weights
from metro.loop.checks.signature import q_values
from metro.loop.search.trial import LEAST_BETTER, Gates

CONTRADICTION = 0.01  # p-value of the differences below which observables do not speak of one thing
SPEAKS = 0.05  # p-value below which an observable that did not name a cause is evidence of it
AS_GOOD = 2.0 * math.log(20.0)  # twice the log-likelihood within which two causes are confounded
SEVERAL = 2  # observables that must show a cause which none of them named alone
MANY = 20.0  # logarithm of the odds beyond which nobody counts


@dataclass(frozen=True, eq=False)
class Judged:
    """A cause and its standing: what all witnesses say, and how sure it is.

    ``status``: ``together`` (named by none alone), ``contradiction``, ``confirmed`` (by another observable
    than the one that named it), ``denied`` (another one would show it, and does not), ``alone`` (the others
    do not determine it). ``or_else``: causes that explain the same as well.
    """

    cause: Cause
    status: str
    probability: float
    or_else: tuple[Key, ...] = ()


def judged(closed: Mapping[str, Closed], gates: Gates) -> list[Judged]:
    """Return the causes that several observables of a batch could show, and at least one of them does."""
    keys = _open_to_several(closed)
    named = {key_of(effect) for one in closed.values() for effect in one.outcome.final.candidate.effects}
    named_causes = [_put_to_all(key, closed) for key in keys if key in named]
    names = {name for name, _ in named}
    return named_causes + _together([key for key in keys if key[0] not in names], closed, gates)


def _open_to_several(closed: Mapping[str, Closed]) -> list[Key]:
    """Return the causes that several observables can show."""
    able = [{key_of(e) for e in one.outcome.seen if not e.resembled} for one in closed.values()]
    return sorted(key for key in set().union(*able) if sum(key in each for each in able) >= SEVERAL)


def _put_to_all(key: Key, closed: Mapping[str, Closed]) -> Judged:
    """Put a cause that one named to all that could show it.

    What they say together counts: what each gains by itself, less what it costs them to agree. Each has been
    charged for its parameters, of which the shared ones are the same for all.
    """
    finders = [one for one in closed.values() if key in map(key_of, one.outcome.final.candidate.effects)]
    first = max(
        (witness for one in finders if (witness := ask(one, key))), key=lambda witness: witness.statistic
    )
    others = [
        witness for one in closed.values() if one is not first.closed and (witness := ask(one, key, first))
    ]
    cause = weighed(key, [first, *(witness.held_out() for witness in others)])
    sure = first.closed.outcome.probability(first.effect.name)
    if cause.differ < CONTRADICTION:
        return Judged(cause, "contradiction", sure)
    seconded = any(witness.names_it or witness.evidence.p_value < SPEAKS for witness in others)
    denied = any(denial(witness, first) < SPEAKS for witness in others)
    gain = sum(witness.evidence.gain for witness in cause.witnesses[1:])
    gain += cause.together.freedom - 0.5 * cause.together.chi2
    status = "confirmed" if seconded else "denied" if denied else "alone"
    return Judged(cause, status, _updated(sure, gain))


def _updated(probability: float, gain: float) -> float:
    """Return a probability after further evidence, ``gain`` its log-likelihood ratio."""
    if not 0.0 < probability < 1.0 or not math.isfinite(gain):
        return probability
    odds = math.log(probability / (1.0 - probability)) + gain
    return 1.0 / (1.0 + math.exp(-min(max(odds, -MANY), MANY)))


def _together(keys: Sequence[Key], closed: Mapping[str, Closed], gates: Gates) -> list[Judged]:
    """Return causes that nobody named, of which all together are evidence.

    What is sought among many places is not among them: in each observable the best place is one by chance.
    """
    tried = []
    for key in keys:
        asked = [witness for one in closed.values() if (witness := ask(one, key))]
        witnesses = [witness for witness in asked if witness.effect.sought == 1.0]
        if len(witnesses) >= SEVERAL:
            tried.append(weighed(key, witnesses))
    likely = q_values([cause.p_value for cause in tried]) <= gates.false_additions
    passed = [_tested(cause, gates) for cause, good in zip(tried, likely, strict=True) if good]
    ranked = sorted((one for one in passed if one), key=lambda one: -one.cause.statistic)
    kept: list[Judged] = []
    for one in ranked:
        places = [i for i, better in enumerate(kept) if _overlap(one.cause, better.cause)]
        if not places:
            kept.append(one)
        for i in places:
            if one.cause.statistic > kept[i].cause.statistic - AS_GOOD:
                kept[i] = replace(kept[i], or_else=(*kept[i].or_else, one.cause.key))
    return kept


def _overlap(one: Cause, other: Cause) -> bool:
    """Whether two causes would explain the residual of one observable."""
    return bool({w.observable for w in one.witnesses} & {w.observable for w in other.witnesses})


def _tested(cause: Cause, gates: Gates) -> Judged | None:
    """Apply the gates to what all say together: agreement, size and gain in several, left-out conditions."""
    if cause.differ < CONTRADICTION:
        return None
    heard = replace(
        cause,
        witnesses=tuple(
            witness.sharing([other for other in cause.witnesses if other is not witness])
            for witness in cause.witnesses
        ),
    )
    if sum(material(witness, gates) for witness in heard.witnesses) < SEVERAL:
        return None
    gains = {
        f"{witness.observable}: {name}": gain
        for witness in heard.witnesses
        for name, gain in witness.evidence.held_out.items()
    }
    pooled = Evidence(cause.statistic, cause.p_value, gains, 0.0, 0.0, 0.0)
    enough = pooled.gain >= gates.held_out_gain and pooled.better_share >= LEAST_BETTER
    if (
        not enough
        or sum(witness.statistic > 0.0 and witness.evidence.gain > 0.0 for witness in heard.witnesses)
        < SEVERAL
    ):
        return None
    odds = max(witness.effect.odds for witness in heard.witnesses)
    share = weights([dict.fromkeys(gains, 0.0), gains], gates.seed, prior=[1.0, odds])
    return Judged(heard, "together", float(share[1]))
