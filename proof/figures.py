"""The figures that the loop is judged by, from the scores of a suite."""

from __future__ import annotations

from collections.abc import Sequence

from proof.score import Score
from proof.statistics import Demand, Figure, brier, median, share
from proof.suite import ABSORBED


def demanded(scores: Sequence[Score]) -> list[Figure]:
    """Return the figures that something is demanded of; effects below the noise are not asked for."""
    none, one, two, outside = (kind(scores, name) for name in ("none", "one", "two", "outside"))
    one, two, outside = ([s for s in group if s.seen] for group in (one, two, outside))
    inside = [*one, *two]
    covered = [e.covered for s in inside for e in s.estimates if e.covered is not None]
    return [
        share("nothing hidden: an effect is added", [s.added for s in none], Demand(most=0.02)),
        share("one effect: named, alone or first of declared rivals", [s.exact for s in one], Demand(0.95)),
        share("one effect: a wrong one named with p > 0.9", [s.surely_wrong for s in one], Demand(most=0.01)),
        share("two effects: both named", [s.both for s in two], Demand(0.85)),
        share("outside the library: a rest is admitted", [s.admitted for s in outside], Demand(0.95)),
        share(
            "outside the library: wrong attribution", [s.misattributed for s in outside], Demand(most=0.05)
        ),
        median(
            "share of the oracle's reduction reached",
            [s.share for s in inside if s.share is not None],
            Demand(0.9),
        ),
        median("held-out error after, over the noise", over_floor(inside), Demand(most=1.1)),
        share("95 % intervals of parameters that hold the truth", covered, Demand(0.90, 0.98)),
        median(
            "time per batch", [s.seconds for s in scores if s.seconds is not None], Demand(most=60.0), "s"
        ),
    ]


def further(scores: Sequence[Score]) -> list[Figure]:
    """Return figures that explain the demanded ones."""
    one, two = ([s for s in kind(scores, name) if s.seen] for name in ("one", "two"))
    inside = [*one, *two]
    small = [s for s in kind(scores, "one") if not s.seen]
    half = [s for s in kind(scores, "two") if not s.seen]
    outside = kind(scores, "outside")
    absorbed = [s for s in kind(scores, "one") if s.hidden[0] in ABSORBED]
    oracle = [s.oracle / s.floor for s in inside if s.oracle is not None and s.floor]
    at_truth = [s.at_truth / s.floor for s in inside if s.at_truth is not None and s.floor]
    return [
        share("batches that the pipeline ran through", [s.status != "failed" for s in scores]),
        share("one effect: something is detected", [s.detected for s in one]),
        share("two effects: something is detected", [s.detected for s in two]),
        share("two effects: both and nothing else", [s.exact for s in two]),
        share("a false one beside one true effect", [bool(s.extra) for s in one]),
        share("a false one beside two true effects", [bool(s.extra) for s in two]),
        share("two effects, not both above the noise: those above are named", [s.seen_named for s in half]),
        share("one effect: right, with declared rivals", [s.exact and bool(s.groups) for s in one]),
        share("below the noise: clean, or named and nothing else", [s.right for s in small]),
        share("below the noise: called clean", [s.status == "clean" for s in small]),
        share("below the noise: a false one named", [bool(s.extra) for s in small]),
        share(
            "absorbed by the coefficients: clean, and said to be beyond these data",
            [s.status == "clean" and s.hidden[0] in s.cannot_be_seen for s in absorbed],
        ),
        share("outside, below the noise: clean", [s.status == "clean" for s in outside if not s.seen]),
        share("outside, whatever its size: wrong attribution", [s.misattributed for s in outside]),
        median("error of the oracle on held-out runs, over the noise", oracle),
        median("the same with the true parameters, of labels", at_truth),
        median("held-out error after, over the floor that the verdict states", over_stated(inside)),
        median("nothing hidden: held-out error over that before", unchanged(kind(scores, "none"))),
        _brier("Brier score of the effects named", [pair for s in scores for pair in s.stated]),
        _brier(
            "Brier score of all effects tried", [pair for s in scores for pair in (*s.stated, *s.rejected)]
        ),
    ]


def undecided(scores: Sequence[Score]) -> list[Figure]:
    """Return the outcome of batches whose tests cannot decide, where the measurement is a label."""
    none, outside = kind(scores, "none"), [s for s in kind(scores, "outside") if s.seen]
    inside = [s for s in scores if s.kind in {"one", "two"}]
    seen, small = [s for s in inside if s.seen], [s for s in inside if s.enough and not s.seen]
    few = [s for s in scores if not s.enough]
    pairs = [len(set(s.hidden) & set(s.named)) for s in kind(seen, "two")]
    return [
        share("undecided: a next experiment is named", [s.advised for s in scores if s.undecided]),
        share("too few tests: insufficient", [s.status == "insufficient" for s in few]),
        share("nothing hidden: clean", [s.status == "clean" for s in none]),
        share("nothing hidden: undecided, none added", [s.undecided and not s.added for s in none]),
        share("below what can be seen: clean", [s.status == "clean" for s in small]),
        share("below what can be seen: undecided", [s.undecided for s in small]),
        share("below what can be seen: named, and nothing else", [s.exact for s in small]),
        share("seen: claimed, and nothing else", [s.claimed and s.exact for s in seen]),
        share("seen: all named or declared rivals", [s.among for s in seen]),
        share("two effects, seen: one or both named", [count > 0 for count in pairs]),
        share("outside the library, seen: undecided", [s.undecided for s in outside]),
    ]


def kind(scores: Sequence[Score], name: str) -> list[Score]:
    """Return the scores of one kind of batch."""
    return [s for s in scores if s.kind == name]


def over_floor(scores: Sequence[Score]) -> list[float]:
    """Held-out error after the loop over the noise."""
    return [s.after / s.floor for s in scores if s.after is not None and s.floor]


def over_stated(scores: Sequence[Score]) -> list[float]:
    """Held-out error after the loop over the floor of the verdict."""
    return [s.after / s.expected for s in scores if s.after is not None and s.expected]


def unchanged(scores: Sequence[Score]) -> list[float]:
    """Held-out error after the loop over that before."""
    return [s.after / s.before for s in scores if s.after is not None and s.before]


def _brier(label: str, stated: Sequence[tuple[float, bool]]) -> Figure:
    value = brier(stated)
    return Figure(label, value, value, value, len(stated), unit="")
