"""Labels against predicted probabilities."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from label_toy import GATES, SHIFT, SLOPE, TWIN, Line, problem
from scipy.stats import norm
from worded import in_words

from metro.loop.labels.next_test import any_tests
from metro.loop.labels.verdict import judge_labels
from metro.loop.labels.verification import log_likelihood, surprise_alone
from metro.wording.statements import worded

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


def shifted(task, by):
    """The problem with its base model's boundary moved by ``by`` in log depth: that of other coefficients."""
    return replace(task, moved=by)


def with_upstream(first_by, now_by, seed=1):
    """Verdict where the effects of the force move the base boundary from one place to another."""
    task = problem(Line(), seed)
    held = np.array(task.roles) == "validate"
    rows = pd.DataFrame({"run": np.array(task.runs)[held], "measured": task.unstable[held].astype(float)})
    for name, by in (("before", first_by), ("after", now_by)):
        boundary = Line().boundary(task.point_rpm)[task.point] + by
        rows[name] = norm.cdf((np.log(task.depth) - boundary) / 0.15)[held]
    given = shifted(task, now_by), rows, CAUSE, (), GATES
    return in_words(judge_labels(*given, first=shifted(task, first_by))[1])


@pytest.mark.parametrize(
    ("first", "now", "status", "effects"),
    [(0.0, 0.0, "clean", []), (1.5, 0.0, "explained", CAUSE), (1.5, 1.5, "unexplained", [])],
)
def test_force_effects_explain_labels_that_only_the_refitted_coefficients_predict(
    first, now, status, effects
):
    verdict = with_upstream(first, now)
    assert (verdict["status"], verdict["effects"]) == (status, effects)
    assert verdict["verification"]["holds"] is (now == 0.0)


def test_labels_that_nothing_predicts_are_named_of_the_tests_that_decide():
    verdict = with_upstream(1.5, 1.5)
    task = problem(Line(), 1)
    held = {run for run, role in zip(task.runs, task.roles, strict=True) if role == "validate"}
    named = set(re.findall(r"[a-z]+\d+", verdict["unexplained"]["signature"]))
    assert named
    assert not named & held


def test_tests_of_verification_alone_decide_nothing():
    task = problem(Line(shift=1.8), 1)
    task = replace(task, roles=("validate",) * len(task.roles))
    rows = pd.DataFrame({"run": task.runs, "measured": task.unstable.astype(float)})
    rows["before"] = norm.cdf((np.log(task.depth) - Line().boundary(task.point_rpm)[task.point]) / 0.15)
    verdict = in_words(judge_labels(task, rows.assign(after=rows["before"]), [], (SHIFT,), GATES)[1])
    assert verdict["status"] == "insufficient"
    assert verdict["effects"] == []
    assert verdict["verification"]["holds"] is False
    assert "Verification contradicts the boundary" in verdict["verification"]["words"]


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


def judged(task, before):
    """Verdict on a toy problem whose held-out tests are unstable with probabilities ``before``."""
    held = np.array(task.roles) == "validate"
    rows = pd.DataFrame(
        {"run": np.array(task.runs)[held], "measured": task.unstable[held].astype(float), "before": before}
    ).assign(after=before)
    return in_words(judge_labels(task, rows, [], (SHIFT, SLOPE), GATES)[1])


def test_held_out_tests_that_speak_against_an_effect_name_no_cause_but_something_remains():
    """On whole speeds that no fit has seen, the boundary is that of the base model after all."""
    task = problem(Line(slope=0.9), 1)
    held = np.array(task.roles) == "validate"
    base = Line().boundary(task.point_rpm)[task.point]
    against = replace(task, unstable=np.where(held, np.log(task.depth) > base, task.unstable))
    before = norm.cdf((np.log(task.depth) - base) / 0.15)[held]
    verdicts = [judged(one, before) for one in (task, against)]
    for key in ("candidates", "indistinguishable"):
        assert verdicts[0][key] == verdicts[1][key]
    (surely,), (less,) = (one["effects"] for one in verdicts)
    assert (surely["effect"], surely["parameters"]) == (less["effect"], less["parameters"])
    assert verdicts[1]["after"]["rms"] > verdicts[1]["before"]["rms"]  # it explains nothing of these
    assert (surely["probability"] > 0.95, less["probability"]) == (True, 0.0)
    assert "0 % of the residual of the held-out runs" in less["lowered"]
    assert [one["verification"]["holds"] for one in verdicts] == [True, False]
    assert [one["status"] for one in verdicts] == ["explained", "partly_explained"]
    assert verdicts[0]["unexplained"] is None
    tests = verdicts[1]["unexplained"]["signature"]
    assert re.search(r"\d+ of \d+ held-out tests contradict the predicted boundary: ", tests)


def test_a_boundary_that_held_out_tests_contradict_is_not_clean():
    task = problem(Line(), 3)
    held = np.array(task.roles) == "validate"
    against = replace(task, unstable=np.where(held, ~np.asarray(task.unstable, dtype=bool), task.unstable))
    before = norm.cdf((np.log(task.depth) - Line().boundary(task.point_rpm)[task.point]) / 0.15)[held]
    said = [judged(one, before) for one in (task, against)]
    assert [one["status"] for one in said] == ["clean", "unexplained"]
    assert [one["effects"] for one in said] == [[], []]
    wrong = np.array(task.runs)[held][np.abs(against.unstable[held] - before) > 0.5]
    count = f"{len(wrong)} of {held.sum()} held-out tests contradict the predicted boundary"
    assert said[1]["unexplained"]["signature"] == f"{count}: {', '.join(wrong)}"  # and nothing of the others


def test_twins_are_undetermined_and_a_next_test_is_named():
    _, verdict, story, _ = closed(Line(shift=0.8), (SHIFT, TWIN))
    assert verdict["status"] == "undetermined"
    assert {"shift", "twin"} <= {name for pair in verdict["indistinguishable"] for name in pair}
    assert "rev/min" in verdict["next_experiment"]
    for effect in (SHIFT, TWIN):
        assert f"What shows {effect.name} directly: {effect.experiment}" in verdict["next_experiment"]
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
    assert "tests contradict the predicted boundary" in verdict["unexplained"]["signature"]
    assert len(task_rows) == len(verdict["held_out_runs"])


def test_too_few_tests_are_insufficient_for_effects():
    _, verdict, story, _ = closed(Line(), (SHIFT, SLOPE), seed=3, rpm=np.array([4000.0, 5000.0]))
    assert verdict["candidates"] == []
    assert "at least 6 at 3 speeds are needed that are not held out" in story["noise"]["words"]


def test_a_mode_that_may_be_missing_is_to_be_sought_at_its_frequency():
    mode = {"effect": "missing_mode", "experiment": "an impact test", "near_hz": 567.3, "ci95_hz": [560, 575]}
    promise = {"information": 0.5, "leading": 0.9, "leading_now": 0.6}
    test = {"code": "test", "values": {"rpm": 3000.0, "depth_mm": 1.0}}
    values = {"test": test, "names": ["missing_mode"], **promise, "directly": [mode]}
    words = worded({"code": "next_test", "values": values})
    assert words.endswith("What shows missing mode at about 567 Hz directly: an impact test")
    assert "expected to rise from 0.60 to 0.90" in words
    still = worded({"code": "next_test", "values": {**values, "leading": 0.602}})
    assert "One test changes little: the most probable cause has a probability of 0.60" in still


@pytest.mark.parametrize(("tests", "speeds", "enough"), [(12, 3, True), (11, 3, False), (12, 2, False)])
def test_who_has_tests_enough_is_asked_to_share_them_and_not_to_cut_more(tests, speeds, enough):
    asked = in_words(any_tests(tests, speeds))
    assert ("give about half of them" in asked) is enough
    assert ("two depths at each" in asked) is not enough
