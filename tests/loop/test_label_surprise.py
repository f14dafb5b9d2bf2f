"""Surprise: as often as it says where the model is right, small where labels are wrong together."""

from dataclasses import replace

import numpy as np
import pytest
from label_toy import GATES, Line, problem
from scipy import stats

from metro.loop.labels.evidence import drawn_errors
from metro.loop.labels.hypotheses import Hypothesis, LabelEvidence, hypothesis
from metro.loop.labels.problem import every_test
from metro.loop.labels.surprise import drawn, surprise


def surprised(task, seed=1):
    tests = every_test(task)
    errors = drawn_errors(tests, np.zeros((128, len(tests.rpm))), seed)
    evidence = LabelEvidence(task.boundaries, task.estimates, tests, errors, GATES.seed)
    return surprise(tests, hypothesis((), evidence), errors, seed)


def labelled(true, seed):
    """Tests of the toy with labels in error as the model says: all alike, each speed, and each test."""
    task, rng = problem(Line(), 1), np.random.default_rng(seed)
    tests = every_test(task)
    errors = drawn_errors(tests, np.zeros((7, len(tests.rpm))), seed + 1000).of_size(tests.model_sd)
    one = rng.integers(len(errors.sd))
    boundary = true.boundary(task.point_rpm) + errors.deviations[one]
    return replace(task, unstable=drawn(tests, boundary, float(errors.sd[one]), rng) > 0.5)


@pytest.mark.parametrize("batches", [20, pytest.param(50, marks=pytest.mark.slow)])
def test_where_the_model_is_right_it_is_small_as_often_as_it_says(batches):
    found = np.array([surprised(labelled(Line(), seed), seed) for seed in range(batches)])
    assert stats.kstest(found, "uniform").pvalue > 0.01
    assert np.mean(found < 0.01) < 0.1


def test_what_all_tests_get_wrong_alike_is_within_the_error_that_they_share():
    found = [
        [surprised(labelled(Line(shift=shift), seed), seed) for seed in range(8)] for shift in (0.1, 0.9)
    ]
    assert np.median(found[0]) > 0.1
    assert np.median(found[1]) < 0.01


def test_labels_that_follow_a_curve_the_model_lacks_are_a_surprise():
    found = [surprised(labelled(Line(slope=0.5), seed), seed) for seed in range(10)]
    assert np.median(found) < 0.01


def loose(seed):
    """A hypothesis whose parameters leave many boundaries, and labels of a further one of these."""
    task, rng = problem(Line(), 1), np.random.default_rng(seed)
    tests = every_test(task)
    many = rng.normal(size=(401, len(tests.rpm))) * 0.6
    depth = Line().boundary(task.point_rpm) + many
    errors = drawn_errors(tests, np.zeros((128, len(tests.rpm))), seed + 1000).of_size(tests.model_sd)
    one = rng.integers(len(errors.sd))
    labels = drawn(tests, depth[0] + errors.deviations[one], float(errors.sd[one]), rng)
    none, alike = np.zeros((400, 0)), np.full(400, 1.0 / 400)
    size = (400, len(errors.sd), len(tests.speeds))
    mine = Hypothesis((), none, none, alike, depth[1:], depth[1:], np.zeros_like(depth[1:]), np.zeros(size))
    return replace(tests, unstable=labels), mine, errors


@pytest.mark.parametrize("batches", [20, pytest.param(60, marks=pytest.mark.slow)])
def test_where_parameters_leave_many_boundaries_it_is_small_as_often_as_it_says(batches):
    found = np.array([surprise(*loose(seed), seed) for seed in range(batches)])
    assert stats.kstest(found, "uniform").pvalue > 0.01
    assert np.mean(found < 0.05) < 0.15


def test_there_is_no_surprise_without_tests():
    task = problem(Line(), 1)
    assert surprised(replace(task, point=np.full(len(task.point), -1))) == 1.0
