"""Labels against predicted probabilities."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from metro.loop.labels import judge_labels, log_likelihood, surprise
from metro.loop.search import Gates

RNG = np.random.default_rng(1)
PROBABILITY = RNG.uniform(0.02, 0.98, 40)


def test_log_likelihood_is_that_of_coin_tosses():
    label = np.array([1.0, 0.0, 1.0])
    assert log_likelihood(label, np.array([0.9, 0.2, 0.5])) == pytest.approx(np.log(0.9 * 0.8 * 0.5))
    assert np.isfinite(log_likelihood(label, np.array([0.0, 1.0, 0.0])))
    many = np.stack([label, 1 - label])
    assert log_likelihood(many, np.array([0.9, 0.2, 0.5])) == pytest.approx(
        np.log([0.9 * 0.8 * 0.5, 0.1 * 0.2 * 0.5])
    )


def test_surprise_is_uniform_when_the_prediction_is_right():
    rng = np.random.default_rng(2)
    found = np.array([surprise(rng.random(40) < PROBABILITY, PROBABILITY, seed) for seed in range(300)])
    for level in (0.1, 0.25, 0.5, 0.75, 0.9):
        assert np.mean(found <= level) == pytest.approx(level, abs=0.09)


def test_surprise_is_small_when_labels_contradict_a_confident_prediction():
    confident = np.where(np.arange(12) < 6, 0.02, 0.98)
    agreeing = (confident > 0.5).astype(float)
    assert surprise(agreeing, confident, 1) > 0.5
    assert surprise(1 - agreeing, confident, 1) < 0.001
    two_wrong = agreeing.copy()
    two_wrong[:2] = 1.0
    exact = 1 - 0.98**12 - 12 * 0.02 * 0.98**11  # two or more of twelve wrong
    assert surprise(two_wrong, confident, 1) == pytest.approx(exact, abs=0.012)


def test_an_undecided_prediction_is_never_surprised():
    assert surprise(np.ones(20), np.full(20, 0.5), 1) == pytest.approx(1.0)


GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
CAUSE = [{"effect": "tool_runout", "probability": 1.0, "parameters": {}}]
LABEL = np.tile([0.0, 1.0], 6)
RIGHT, WRONG = np.where(LABEL > 0.5, 0.95, 0.05), np.where(LABEL > 0.5, 0.05, 0.95)


def judged(before, after, tests=12):
    rows = pd.DataFrame(
        {"run": [f"c{i}" for i in range(12)], "measured": LABEL, "before": before, "after": after}
    )
    return judge_labels(SimpleNamespace(notes=()), rows.head(tests), CAUSE, GATES)[1]


@pytest.mark.parametrize(
    ("before", "after", "tests", "status", "effects"),
    [
        (RIGHT, RIGHT, 12, "clean", []),
        (WRONG, RIGHT, 12, "explained", CAUSE),
        (WRONG, WRONG, 12, "unexplained", []),
        (RIGHT, RIGHT, 4, "insufficient", []),
    ],
)
def test_force_effects_explain_labels_that_only_the_refitted_coefficients_predict(
    before, after, tests, status, effects
):
    verdict = judged(before, after, tests)
    assert (verdict["status"], verdict["effects"]) == (status, effects)


def test_labels_that_nothing_predicts_are_named():
    verdict = judged(WRONG, WRONG)
    assert "12 of 12 tests: c0, c1" in verdict["unexplained"]["signature"]
    assert judged(WRONG, RIGHT)["after"]["rms"] < judged(WRONG, RIGHT)["before"]["rms"]
