"""A cause that the library lacks: known where it acts, and no rival where an effect explains the labels."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest
from label_toy import GATES, RPM, SHIFT, SLOPE, Line, problem
from worded import in_words

from metro.loop.labels.evidence import Errors
from metro.loop.labels.hypotheses import LabelEvidence, hypothesis
from metro.loop.labels.problem import tests_of as told_by
from metro.loop.labels.search import search_labels
from metro.loop.labels.unknown import UNKNOWN, curves, unknown
from metro.loop.labels.verdict import judge_labels


@dataclass(frozen=True)
class Arch(Line):
    """A boundary that is highest in the middle of the speeds, as no effect of the toy makes it."""

    rise: float = 0.0

    def boundary(self, rpm):
        x = (rpm - 3800.0) / 1800.0
        return super().boundary(rpm) + self.rise * (1.0 - 3.0 * x**2)


def judged(true, seed=4):
    task = problem(true, seed)
    held = np.array(task.roles) == "validate"
    told = (np.log(task.depth) - Line().boundary(task.point_rpm)[task.point])[held]
    chance = 1.0 / (1.0 + np.exp(-told / 0.09))
    rows = pd.DataFrame(
        {
            "run": np.array(task.runs, dtype=object)[held],
            "measured": task.unstable[held].astype(float),
            "before": chance,
            "after": chance,
        }
    )
    _, verdict, _, change = judge_labels(task, rows, [], (SHIFT, SLOPE), GATES)
    return in_words(verdict), change


def test_what_no_effect_does_is_laid_to_none_and_described():
    verdict, change = judged(Arch(rise=0.8))
    assert verdict["status"] == "unexplained"
    assert verdict["effects"] == []
    assert change is None
    assert "a cause outside the library" in verdict["unexplained"]["signature"]


@pytest.mark.parametrize("true", [Line(slope=0.8), Line(slope=-0.8)])
def test_what_an_effect_does_is_laid_to_it(true):
    outcome = search_labels(problem(true, 4), (SHIFT, SLOPE), GATES)
    assert outcome.lead.names == ("slope",)
    assert UNKNOWN not in outcome.rivals


def test_where_the_tests_cannot_tell_the_cause_may_be_another():
    """Few tests, and all of them say only that the boundary is lower."""
    task = problem(Line(shift=-0.6), 4)
    few = tuple("identify" if i in (2, 8, 14, 20, 26, 32) else "validate" for i in range(len(task.runs)))
    outcome = search_labels(replace(task, roles=few), (SHIFT,), GATES)
    assert outcome.probability(UNKNOWN) > 0.2 * outcome.probability("shift")


def test_nothing_is_as_likely_as_a_curve_that_is_flat():
    """The curve's evidence is that of nothing, less what its freedom costs, where the model is right."""
    outcome = search_labels(problem(Line(), 4), (SHIFT,), GATES)
    assert outcome.lead is None
    assert outcome.probability(UNKNOWN) < 0.1


def test_the_curve_that_is_found_is_the_one_that_acts():
    task = problem(Arch(rise=0.5), 4)
    tests, _ = told_by(task, "identify")
    flat = Errors(np.zeros((1, len(RPM))), np.array([0.15]))
    evidence = LabelEvidence(task.boundaries, task.estimates, tests, flat, GATES.seed)
    found = unknown(hypothesis((), evidence), evidence)
    at = np.array([2400.0, 3800.0, 5200.0])
    tested = (tests.rpm, Line().boundary(tests.rpm))
    told = found.weights @ curves(found, tested, (at, Line().boundary(at)))
    true = Arch(rise=0.5).boundary(at) - Line().boundary(at)
    assert told == pytest.approx(true, abs=0.25)
    assert found.names == (UNKNOWN,)


def test_what_moves_deep_boundaries_most_is_found_as_such():
    """Lobes that lose the more the higher they are: no curve over the speeds alone does that."""
    task = problem(Line(), 4)

    def lobes(rpm):
        return np.log(1e-3) + 0.6 * np.sin(rpm / 320.0)

    point = np.repeat(np.arange(len(RPM)), 6)
    height = lobes(RPM) - lobes(RPM).mean()
    log_depth = (lobes(RPM) - 0.6 * height)[point] + np.tile([-0.5, -0.2, -0.1, 0.1, 0.2, 0.5], len(RPM))
    task = replace(task, unstable=np.tile([False] * 3 + [True] * 3, len(RPM)), depth=np.exp(log_depth))
    tests, _ = told_by(task, "identify")
    boundary = lobes(tests.rpm)

    def predict(changes):
        return np.tile(boundary, (len(changes), 1)), np.full((len(changes), len(boundary)), 300.0)

    errors = Errors(np.zeros((1, len(boundary))), np.array([0.15]))
    evidence = LabelEvidence(predict, predict, tests, errors, GATES.seed)
    found = unknown(hypothesis((), evidence), evidence)
    told = found.weights @ curves(found, (tests.rpm, boundary), (RPM, lobes(RPM)))
    assert np.corrcoef(told, -0.6 * height)[0, 1] > 0.9
    assert told.std() == pytest.approx((0.6 * height).std(), rel=0.4)
