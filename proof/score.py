"""One batch scored: what was hidden, what was found, and in which way that is right or wrong."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from metro.effects.library import library
from metro.loop.labels.search import NOTHING
from metro.loop.labels.unknown import UNKNOWN
from metro.units import JSON
from proof.estimates import Estimate, estimates

FAILED = "failed"
STATUSES = ("clean", "explained", "partly_explained", "undetermined", "unexplained", "insufficient", FAILED)
SURE = 0.9
SEEN = 1.0  # size over noise from which an effect must be found

Stated = tuple[float, bool]  # a probability, and whether it came true
ELSEWHERE = "{}, another joint"
_FORM = re.compile(r"(?P<name>\w+) \((?:joint (?P<joint>\d)|all joints)\)")


@dataclass(frozen=True)
class Score:
    """What became of a batch.

    Attributes
    ----------
    kind : none, one, two or outside. hidden : names of the effects hidden on purpose. sizes : of each over
        the noise, once all else is refitted. also : effects that a real cell always has a little of.
    named : the effects of the verdict with their stated probabilities, in order; one that is hidden, but in
        another joint, is named so; those that are always there are left out: naming one is neither demanded
        nor false. claimed : whether any of ``named`` is added to the model, or only the first of rivals.
        groups : sets that it cannot distinguish. unexplained : whether it states an unexplained part.
        advised : whether it recommends what to measure next.
    enough : whether the batch has tests enough for any verdict.
    before, after : rms error on held-out runs. oracle, floor : that of the fit that knows which effects act,
        and the noise. at_truth : that with their true parameters, where the measurement is a label.
    expected : that the verdict states as its floor, with the uncertainty of the base parameters.
    stated, rejected : probability of every effect named, or tried and not named, and whether it was there;
        those of effects too small to be seen left out.
    cannot_be_seen : effects that these data cannot reveal, by the verdict.
    p_value : that is stated for nothing being missing.
    seconds : the stages took.
    failure : why the batch failed, where it did.
    """

    batch: str
    kind: str
    hidden: tuple[str, ...]
    sizes: dict[str, float]
    status: str
    named: dict[str, float]
    also: frozenset[str] = frozenset()
    claimed: bool = False
    groups: tuple[frozenset[str], ...] = ()
    unexplained: bool = False
    advised: bool = False
    enough: bool = True
    before: float | None = None
    after: float | None = None
    oracle: float | None = None
    at_truth: float | None = None
    floor: float | None = None
    expected: float | None = None
    estimates: tuple[Estimate, ...] = ()
    stated: tuple[Stated, ...] = ()
    rejected: tuple[Stated, ...] = ()
    cannot_be_seen: tuple[str, ...] = ()
    p_value: float | None = None
    seconds: float | None = None
    failure: str | None = None

    @property
    def seen(self) -> bool:
        """Whether every hidden effect is large enough to be found, or its size is not known."""
        return bool(self.hidden) and self.enough and all(self._large(name) for name in self.hidden)

    @cached_property
    def extra(self) -> frozenset[str]:
        """Effects named that are neither there nor declared a rival of one that is, or of nothing."""
        true = (set(self.hidden) or {NOTHING}) | self.also
        rivals = frozenset().union(*(group for group in self.groups if group & true))
        return frozenset(self.named) - frozenset(self.hidden) - rivals

    @property
    def added(self) -> bool:
        """Whether an effect is added to the model, or is named though none of its rivals is there."""
        return self.claimed or bool(self.extra)

    @property
    def among(self) -> bool:
        """Whether every hidden effect is named, or declared a rival of what is."""
        return set(self.hidden) <= set(self.named).union(*self.groups)

    @property
    def both(self) -> bool:
        """Whether every hidden effect is named."""
        return self.status != FAILED and set(self.hidden) <= set(self.named)

    @property
    def exact(self) -> bool:
        """Whether what is hidden is named first, and nothing else but declared rivals."""
        first = list(self.named)[: len(self.hidden)]
        return self.status != FAILED and set(first) == set(self.hidden) and not self.extra

    @property
    def right(self) -> bool:
        """Whether it is exact; of what is too small to be found, "clean" is right as well."""
        if self.exact or self.seen:
            return self.exact
        return self.seen_named and not self.extra and (bool(self.named) or self.status == "clean")

    @property
    def seen_named(self) -> bool:
        """Whether those of the hidden effects that are large enough are named."""
        return all(name in self.named for name in self.hidden if self._large(name))

    def _large(self, name: str) -> bool:
        return self.sizes.get(name, SEEN) >= SEEN

    @property
    def detected(self) -> bool:
        """Whether the verdict states that an effect is present."""
        return self.status not in {"clean", "insufficient", FAILED}

    @property
    def undecided(self) -> bool:
        """Whether the verdict states that the data cannot decide."""
        return self.status in {"undetermined", "insufficient"}

    @property
    def surely_wrong(self) -> bool:
        """Whether an effect that is not there is named with a probability above 0.9."""
        return any(probability > SURE for name, probability in self.named.items() if name not in self.hidden)

    @property
    def admitted(self) -> bool:
        """Whether the verdict states a remaining error that the library does not account for."""
        return self.status in {"unexplained", "partly_explained"} or (
            self.status == "undetermined" and self.unexplained
        )

    @property
    def misattributed(self) -> bool:
        """Whether an outside effect is called explained, or a wrong one surely accounts for all of it."""
        return self.status == "explained" or (self.surely_wrong and not self.unexplained)

    @property
    def share(self) -> float | None:
        """Share of the oracle's reduction of the held-out error that was reached."""
        if self.before is None or self.after is None or self.oracle is None or self.oracle >= self.before:
            return None
        return (self.before - self.after) / (self.before - self.oracle)


def score(truth: JSON, oracle: JSON | None, said: JSON | None, *, teeth: int, observable: str) -> Score:
    """Score a batch.

    Parameters
    ----------
    truth : of the batch. oracle : what :func:`proof.oracle.oracle` found; None where nothing is hidden.
    said : what a program says of the observable (:func:`proof.answers.answer`); None where it failed.
    """
    hidden: JSON = truth["effects"]
    always: JSON = truth.get("always_on", {})
    entries = [(name, one) for name, values in always.items() for one in forms(values)]
    also = frozenset(attributed(name, one, hidden, always) for name, one in entries) - set(hidden)
    beside = frozenset(always) - set(hidden)
    oracle = oracle or {"after": None, "floor": None, "sizes": {}}
    if said is None:
        return Score(truth["batch"], truth["kind"], tuple(hidden), oracle["sizes"], FAILED, {})
    pairs = [[_without_form(name, hidden, always) for name in group] for group in said["indistinguishable"]]
    groups = tuple(frozenset(group) for group in pairs)
    effects = [
        one | {"effect": attributed(one["effect"], one["parameters"], hidden, always)}
        for one in said["effects"]
    ]
    # What is claimed without a probability is claimed for sure.
    every = {one["effect"]: 1.0 if one["probability"] is None else one["probability"] for one in effects}
    named = {name: probability for name, probability in every.items() if name not in also}
    if not every and said["status"] == "undetermined":
        candidates = {c["effect"]: c["probability"] for c in said["candidates"]}
        lacking = _lacking(observable)
        firsts = [group[0] for group in pairs if group[0] not in lacking]
        named = {first: candidates.get(first.split(",")[0], 0.0) for first in firsts if first not in also}
    return Score(
        batch=truth["batch"],
        kind=truth["kind"],
        hidden=tuple(hidden),
        sizes=oracle["sizes"],
        status=said["status"],
        named=named,
        also=also,
        claimed=bool(every.keys() - also),
        groups=groups,
        unexplained=said["unexplained"] is not None,
        advised=bool(said["next_experiment"]),
        enough=oracle.get("enough", True),
        before=_rms(said["before"]),
        after=_rms(said["after"]),
        oracle=oracle["after"],
        at_truth=oracle.get("exact"),
        floor=oracle["floor"],
        expected=said["noise_floor"],
        estimates=tuple(
            one
            for effect in effects
            if effect["effect"] in hidden
            for one in estimates(
                effect["effect"],
                hidden[effect["effect"]],
                effect["parameters"],
                teeth,
                truth.get("translation_error", {}).get(effect["effect"], 0.0),
            )
        ),
        stated=_stated(effects, {*hidden, *also}, oracle["sizes"]),
        rejected=_rejected(said["candidates"], hidden, beside, oracle["sizes"], observable),
        cannot_be_seen=tuple(said["cannot_be_seen"]),
        p_value=said["p_value"],
        seconds=said["seconds"],
    )


def joint(parameters: Mapping[str, Any]) -> Any:
    """Return the joint that an effect is of; "all" where it is not one joint's."""
    return parameters.get("joint", "all")


def forms(values: JSON | list[JSON]) -> list[JSON]:
    """Return the parameters of each form of an effect that is always there: of one, or of several joints."""
    return values if isinstance(values, list) else [values]


def attributed(effect: str, parameters: Mapping[str, Any], hidden: JSON, always: JSON) -> str:
    """Name an effect of a verdict: one that is there in another joint alone is not the one that is there.

    One that is hidden in one joint and always there in another is named with that joint.
    """
    mine = joint(parameters)
    there = {joint(one) for one in forms(always.get(effect, []))}
    if effect in hidden:
        if mine == joint(hidden[effect]):
            return effect
        return f"{effect}, joint {mine}" if mine in there else ELSEWHERE.format(effect)
    return ELSEWHERE.format(effect) if there and mine not in there else effect


def _without_form(name: str, hidden: JSON, always: JSON) -> str:
    """Name an effect of which a verdict writes the joint behind its name."""
    match = _FORM.fullmatch(name)
    if not match:
        return name
    where = {"joint": int(match["joint"])} if match["joint"] else {}
    return attributed(match["name"], where, hidden, always)


@cache
def _lacking(observable: str) -> frozenset[str]:
    """Names of hypotheses that are no effect of the library."""
    return frozenset({UNKNOWN, *(effect.name for effect in library(observable) if effect.resembled)})


def _stated(said: Iterable[JSON], there: Collection[str], sizes: Mapping[str, float]) -> tuple[Stated, ...]:
    return tuple(
        (one["probability"], one["effect"] in there)
        for one in said
        if one["probability"] is not None and sizes.get(one["effect"], SEEN) >= SEEN
    )


def _rejected(
    said: list[JSON], hidden: JSON, also: frozenset[str], sizes: Mapping[str, float], observable: str
) -> tuple[Stated, ...]:
    """Return what was stated of the candidates; those of labels are whole hypotheses, "a + b" and no more.

    How large an effect is that is always there is not known, so nothing is demanded of its probability.
    """
    if observable != "lobes":
        return _stated([one for one in said if one["effect"] not in also], hidden, sizes)
    if any(sizes.get(name, SEEN) < SEEN for name in hidden):
        return ()
    tried = [(one["probability"], set(one["effect"].split(" + "))) for one in said]
    return tuple((p, names - also == set(hidden)) for p, names in tried if not names & _lacking(observable))


def _rms(error: JSON | None) -> float | None:
    return None if error is None else float(error["rms"])
