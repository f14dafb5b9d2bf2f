"""Labels against predicted probabilities."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from label_toy import GATES, SHIFT, SLOPE, TWIN, Line, Made, problem
from scipy.stats import norm
from worded import in_words

from metro.loop.labels.verdict import judge_labels, log_likelihood, surprise_alone

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
    found = np.array([surprise_alone(rng.random(40) < PROBABILITY, PROBABILITY, seed) for seed in range(300)])
    for level in (0.1, 0.25, 0.5, 0.75, 0.9):
        assert np.mean(found <= level) == pytest.approx(level, abs=0.09)


def test_surprise_is_small_when_labels_contradict_a_confident_prediction():
    confident = np.where(np.arange(12) < 6, 0.02, 0.98)
    agreeing = (confident > 0.5).astype(float)
    assert surprise_alone(agreeing, confident, 1) > 0.5
    assert surprise_alone(1 - agreeing, confident, 1) < 0.001
    two_wrong = agreeing.copy()
    two_wrong[:2] = 1.0
    exact = 1 - 0.98**12 - 12 * 0.02 * 0.98**11  # two or more of twelve wrong
    assert surprise_alone(two_wrong, confident, 1) == pytest.approx(exact, abs=0.012)


def test_an_undecided_prediction_is_never_surprised():
    assert surprise_alone(np.ones(20), np.full(20, 0.5), 1) == pytest.approx(1.0)


CAUSE = [{"effect": "tool_runout", "probability": 1.0, "parameters": {}}]
LABEL = np.tile([0.0, 1.0], 6)
RIGHT, WRONG = np.where(LABEL > 0.5, 0.95, 0.05), np.where(LABEL > 0.5, 0.05, 0.95)


def judged(before, after, tests=12):
    rows = pd.DataFrame(
        {"run": [f"c{i}" for i in range(12)], "measured": LABEL, "before": before, "after": after}
    )
    nowhere = Made(
        tuple(rows["run"]), ("validate",) * 12, LABEL > 0, np.ones(12), np.full(12, -1), np.full(12, np.nan),
        np.zeros(0),
    )  # fmt: skip
    return in_words(judge_labels(nowhere, rows.head(tests), CAUSE, (SHIFT,), GATES)[1])


def closed(true, effects, seed=1, **more):
    """Comparison rows, verdict and story of a toy problem; before and after are those of its base model."""
    task = problem(true, seed, **more)
    held = np.array(task.roles) == "validate"
    before = norm.cdf((np.log(task.depth) - Line().boundary(task.point_rpm)[task.point]) / 0.15)[held]
    rows = pd.DataFrame(
        {
            "run": np.array(task.runs)[held],
            "measured": task.unstable[held].astype(float),
            "before": before,
            "after": before,
        }
    )
    judged_rows, verdict, story, change = judge_labels(task, rows, [], effects, GATES)
    return judged_rows, in_words(verdict), in_words(story), change


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


def test_an_effect_found_is_told_with_its_size_and_mends_the_held_out_prediction():
    rows, verdict, story, change = closed(Line(slope=0.9), (SHIFT, SLOPE))
    assert verdict["status"] == "explained"
    (effect,) = verdict["effects"]
    assert effect["effect"] == "slope"
    assert effect["probability"] > 0.95
    assert effect["parameters"]["size"]["value"] == pytest.approx(0.9, abs=0.25)
    assert verdict["after"]["rms"] < 0.8 * verdict["before"]["rms"]
    assert (rows["after"] != rows["before"]).all()
    assert [c["effect"] for c in verdict["candidates"][:-1]] == ["shift", "slope + shift"][
        : len(verdict["candidates"])
    ]
    assert {c["effect"]: c["verdict"] for c in story["candidates"]}["slope"] == "added"
    assert change(Line()).slope == pytest.approx(0.9, abs=0.3)


def test_what_the_held_out_tests_speak_against_is_not_claimed():
    """On whole speeds that no fit has seen, the boundary is that of the base model after all."""
    task = problem(Line(slope=0.9), 1)
    held = np.array(task.roles) == "validate"
    base = Line().boundary(task.point_rpm)[task.point]
    task = replace(task, unstable=np.where(held, np.log(task.depth) > base, task.unstable))
    before = norm.cdf((np.log(task.depth) - base) / 0.15)[held]
    rows = pd.DataFrame(
        {"run": np.array(task.runs)[held], "measured": task.unstable[held].astype(float), "before": before}
    ).assign(after=before)
    after, verdict, _, change = judge_labels(task, rows, [], (SHIFT, SLOPE), GATES)
    assert verdict["status"] == "undetermined"
    assert not verdict["effects"]
    assert change is None
    assert (after["after"] == after["before"]).all()


def test_twins_are_undetermined_and_a_next_test_is_named():
    _, verdict, story, _ = closed(Line(shift=0.8), (SHIFT, TWIN))
    assert verdict["status"] == "undetermined"
    assert {"shift", "twin"} <= {name for pair in verdict["indistinguishable"] for name in pair}
    assert "rev/min" in verdict["next_experiment"]
    assert story["experiments"][0]["probability"] <= 1.0


def test_without_an_effect_the_prediction_stays_as_it_was():
    rows, verdict, _, change = closed(Line(), (SHIFT, SLOPE), seed=3)
    assert verdict["status"] == "clean"
    assert verdict["effects"] == []
    assert (rows["after"] == rows["before"]).all()
    assert change is None


def test_labels_that_contradict_every_hypothesis_are_unexplained():
    task_rows, verdict, _, _ = closed(Line(shift=1.8), (SLOPE,))
    assert verdict["status"] == "unexplained"
    assert verdict["unexplained"]["signature"].startswith("labels against the predicted boundary")
    assert len(task_rows) == len(verdict["held_out_runs"])


def test_too_few_tests_are_insufficient_for_effects():
    _, verdict, story, _ = closed(Line(), (SHIFT, SLOPE), seed=3, rpm=np.array([4000.0, 5000.0]))
    assert verdict["candidates"] == []
    assert "Effects of the boundary need" in story["noise"]["words"]
