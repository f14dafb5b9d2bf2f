"""Which test to make next: the speed and depth whose label would be the strongest evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.loop.labels.hypotheses import Hypothesis, changed
from metro.loop.labels.search import LEAST_SPEEDS, LEAST_TESTS, NOTHING, LabelOutcome, Weighed
from metro.loop.labels.unknown import UNKNOWN, curves
from metro.loop.statement import Statement
from metro.observables.labelled import Labelled
from metro.units import JSON, MM, Array

_DEPTHS = 9  # tried, from the least to the greatest that was tested
_DRAWS = 12  # parameters of each hypothesis, by their posterior
_WORTH = 0.02  # probability of a hypothesis below which it is not asked about


@dataclass(frozen=True)
class NextTest:
    """A test that could be made.

    Attributes
    ----------
    rpm, depth : rev/min and m.
    information : mutual information of its label and the hypothesis, bits.
    leading, leading_now : expected probability of the hypothesis that leads after the test, and that of the
        one that leads now.
    """

    rpm: float
    depth: float
    information: float
    leading: float
    leading_now: float

    @property
    def statement(self) -> Statement:
        """Its speed and depth."""
        return Statement("test", {"rpm": self.rpm, "depth_mm": self.depth / MM})


def next_tests(problem: Labelled, outcome: LabelOutcome) -> list[NextTest]:
    """Try tests between the speeds that were tested, within their depths; the most informative first."""
    speeds = np.unique(problem.point_rpm)
    between = 0.5 * (speeds[1:] + speeds[:-1])
    used = problem.depth[problem.point >= 0]
    depth = np.geomspace(used.min(), used.max(), _DEPTHS)
    asked = [one for one in outcome.weighed if one.probability > _WORTH]
    prior = np.array([one.probability for one in asked])
    prior /= prior.sum()
    chance = np.stack([_chance(problem, one, between, depth, outcome) for one in asked])
    joint = np.stack([chance, 1.0 - chance]) * prior[:, None, None]
    label = joint.sum(axis=1)
    information = np.sum(joint * np.log2(joint / (label[:, None] * prior[:, None, None])), axis=(0, 1))
    leading = joint.max(axis=1).sum(axis=0)
    order = np.argsort(-information, axis=None)
    places = [np.unravel_index(place, information.shape) for place in order]
    now = float(prior.max())
    return [
        NextTest(float(between[i]), float(depth[j]), float(information[i, j]), float(leading[i, j]), now)
        for i, j in places
    ]


def _chance(problem: Labelled, one: Weighed, rpm: Array, depth: Array, outcome: LabelOutcome) -> Array:
    """Probability (k, d) that tests are unstable, if the hypothesis holds."""
    from scipy.special import ndtr

    tests, mine = outcome.evidence.tests, one.hypothesis
    heavy = _drawn(mine, outcome.evidence.seed)
    if one.names == (UNKNOWN,):
        (base,) = problem.boundaries_at([lambda model: model], rpm)
        boundary = base + curves(mine, outcome.base_boundary, (rpm, outcome.evidence.testable(base)))[heavy]
    else:
        boundary = problem.boundaries_at([changed(mine, which) for which in heavy], rpm)
    errors = outcome.evidence.errors
    sd = float(np.sqrt(mine.of_errors(errors) @ errors.sd**2))
    chance: Array = ndtr((np.log(depth) - boundary[:, :, None]) / sd).mean(axis=0)
    return tests.label_error + (1.0 - 2.0 * tests.label_error) * chance


def _drawn(mine: Hypothesis, seed: int) -> np.ndarray:
    count = min(_DRAWS, len(mine.prior))
    return np.random.default_rng(seed).choice(len(mine.prior), size=count, p=mine.weights)


def advice(tests: Sequence[NextTest], outcome: LabelOutcome) -> Statement:
    """State which test would be most informative, and what it promises."""
    best = tests[0]
    lead = outcome.lead.names if outcome.lead else ()
    names = [*lead, *outcome.rivals] or [NOTHING]
    promise = {"information": best.information, "leading": best.leading, "leading_now": best.leading_now}
    values = {"test": best.statement, "names": names, **promise, "directly": _directly(names, outcome)}
    return Statement("next_test", values)


def _directly(names: Sequence[str], outcome: LabelOutcome) -> list[JSON]:
    """Say of each effect in question what shows it without a further cut, and at which frequency to look."""
    shown: list[JSON] = []
    for name in names:
        first = next((one for one in outcome.weighed if name in one.names), None)
        effect = next((e for e in first.hypothesis.effects if e.name == name), None) if first else None
        if first is None or effect is None or effect.resembled:
            continue
        sought = first.hypothesis.parameters(name).get("frequency_hz")
        shown.append(
            {
                "effect": name,
                "experiment": effect.experiment,
                **({"near_hz": sought["value"], "ci95_hz": sought["ci95"]} if sought else {}),
            }
        )
    return shown


def beside(rows: pd.DataFrame) -> Statement:
    """State what to test next where no effect is in question: where the prediction is least sure."""
    if rows.empty:
        return any_tests(0, 0)
    closest = rows.iloc[int(np.argmin(np.abs(rows["after"].to_numpy() - 0.5)))]
    return Statement("test_beside", {"run": str(closest["run"]), "probability": float(closest["after"])})


def any_tests(held_out: int, speeds: int) -> Statement:
    """State which tests would let effects be weighed: those held out, if they are enough to share."""
    enough = held_out >= 2 * LEAST_TESTS and speeds >= LEAST_SPEEDS
    return Statement("any_tests", {"held_out": held_out, "enough": enough})
